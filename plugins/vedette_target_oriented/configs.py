"""The scene and the filters of the study, as configs; examples/target_oriented holds the same to be changed."""

from __future__ import annotations

import math
from typing import Any

SIGMA = 20.0
CLUTTER = 2e-6
SCANS = 91
START = (21689.0, 10840.0)
COURSE = math.atan2(-399.9, -8.3)
SPEED = 400.0


def scene() -> dict[str, Any]:
    """Return the source: 400 m/s, 60 m/s^2 to the right from 20 s on and 40 m/s^2 to the left from 55 s on, 15 s each."""
    legs = [
        {"do": "straight", "seconds": 20},
        {"do": "turn", "seconds": 15, "lateral_accel": -60},
        {"do": "straight", "seconds": 20},
        {"do": "turn", "seconds": 15, "lateral_accel": 40},
    ]
    return {
        "kind": "simulation",
        "duration": 90,
        "looks": {
            "radar": {"interval": 1, "clutter": {"x": {"low": 2000, "high": 23000}, "y": {"low": -7000, "high": 12000}}}
        },
        "ships": {"aircraft": {"start": list(START), "course": COURSE, "speed": SPEED, "legs": legs}},
        "sensors": {"radar": {"kind": "cartesian_position", "sigma": SIGMA, "clutter_density": CLUTTER}},
    }


def config(title: str, modes: list[dict[str, Any]], transition: list[list[float]], spread: dict[str, Any]) -> dict[str, Any]:
    """Return an IMM-PDAF on the scene. The filter allows for one miss in a hundred; the scene has none."""
    sensor = {"kind": "cartesian_position", "sigma": SIGMA, "clutter_density": CLUTTER, "detection_probability": 0.99}
    return {
        "title": title,
        "seed": 1,
        "source": scene(),
        "sensors": {"radar": sensor},
        "estimator": {"kind": "imm", "transition": transition, "modes": modes},
        "gate": {"probability": GATE},
        "associator": {"kind": "pda"},
        "birth": {"kind": "given", **spread},
        "lifecycle": {"kind": "single_target"},
    }


GATE = 0.99966
"""Squared distances up to 16 are in the gate, with probability 1 - exp(-8)."""


def _modes(estimator: str, *motions: dict[str, Any]) -> list[dict[str, Any]]:
    return [{"kind": estimator, "motion": motion} for motion in motions]


def _frame() -> dict[str, Any]:
    """Return the start of the axes of the paper's frame that the truth does not have."""
    before = [START[0] - SPEED * math.cos(COURSE), START[1] - SPEED * math.sin(COURSE)]
    start = {"v_forward": [SPEED, 20.0], "v_side": [0.0, 20.0], "heading": [COURSE, 0.0]}
    return {"spread": _PLACE, "start": start | {"last_x": [before[0], 0.0], "last_y": [before[1], 0.0]}}


def _reset(kind: str, forward: float, side: float, turning: float, speed: float) -> list[dict[str, Any]]:
    common = {"kind": kind, "sigma_forward": forward}
    return _modes(
        "ekf",
        common | {"sigma_side": side},
        common | {"sigma_side": turning, "side_speed": speed},
        common | {"sigma_side": turning, "side_speed": -speed},
    )


_PLACE = {"x": SIGMA, "y": SIGMA}
_CARTESIAN = {"spread": _PLACE | {"vx": 20.0, "vy": 20.0}}
_TURNS = [[0.9, 0.05, 0.05], [0.1, 0.9, 0.0], [0.1, 0.0, 0.9]]

FILTERS: dict[str, dict[str, Any]] = {
    "Singer": config(
        "Constant velocity and two Singer models",
        _modes(
            "kalman",
            {"kind": "constant_velocity_piecewise", "sigma_accel": 5.0},
            {"kind": "singer", "tau": 10.0, "sigma_accel": 20.0},
            {"kind": "singer", "tau": 10.0, "sigma_accel": 60.0},
        ),
        [[0.9, 0.08, 0.02], [0.1, 0.8, 0.1], [0.05, 0.15, 0.8]],
        {"spread": _CARTESIAN["spread"] | {"ax": 10.0, "ay": 10.0}},
    ),
    "CAR": config(
        "Constant velocity and two known turn rates",
        _modes(
            "kalman",
            {"kind": "constant_velocity_piecewise", "sigma_accel": 3.0},
            {"kind": "known_turn", "turn_rate": -0.14, "sigma_accel": 5.0},
            {"kind": "known_turn", "turn_rate": 0.14, "sigma_accel": 5.0},
        ),
        _TURNS,
        _CARTESIAN,
    ),
    "TOM literal": config(
        "Three target-oriented models as printed, the covariance kept at the reset",
        _reset("target_oriented_literal", 2.0, 10.0, 20.0, 70.0),
        _TURNS,
        _frame(),
    ),
    "TOM certain": config(
        "Three target-oriented models as printed, the side speed known after the reset",
        _reset("target_oriented_certain", 5.0, 46.0, 60.0, 70.0),
        _TURNS,
        _frame(),
    ),
    "TOM": config(
        "Three target-oriented models, consistent",
        _modes(
            "ekf",
            {"kind": "target_oriented", "sigma_forward": 3.0, "sigma_side": 3.0},
            {"kind": "target_oriented", "sigma_forward": 3.0, "sigma_side": 10.0, "side_accel": 56.0},
            {"kind": "target_oriented", "sigma_forward": 3.0, "sigma_side": 10.0, "side_accel": -56.0},
        ),
        _TURNS,
        _CARTESIAN,
    ),
}
"""The paper gives turn rates, side speeds and the radar; the rest is chosen (docs/papers.md)."""

MODES = {"Singer": ("straight", "Singer 20 m/s^2", "Singer 60 m/s^2")}
"""What the modes are, where they are not straight flight and turns to the right and to the left."""
