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


def scene(detection: float = 1.0) -> dict[str, Any]:
    """Return the source: 400 m/s, 60 m/s^2 to the right from 20 s on and 40 m/s^2 to the left from 55 s on, 15 s each."""
    legs = [
        {"do": "straight", "seconds": 20},
        {"do": "turn", "seconds": 15, "lateral_accel": -60},
        {"do": "straight", "seconds": 20},
        {"do": "turn", "seconds": 15, "lateral_accel": 40},
    ]
    missing = {} if detection == 1.0 else {"detection_probability": detection}
    return {
        "kind": "simulation",
        "duration": 90,
        "looks": {
            "radar": {"interval": 1, "clutter": {"x": {"low": 2000, "high": 23000}, "y": {"low": -7000, "high": 12000}}}
        },
        "ships": {"aircraft": {"start": list(START), "course": COURSE, "speed": SPEED, "legs": legs}},
        "sensors": {"radar": {"kind": "cartesian_position", "sigma": SIGMA, "clutter_density": CLUTTER} | missing},
    }


def config(
    title: str, modes: list[dict[str, Any]], transition: list[list[float]], spread: dict[str, Any], detection: float = 1.0
) -> dict[str, Any]:
    """Return an IMM-PDAF on the scene. The filter allows for one miss in a hundred at least; the scene may have none."""
    stated = min(detection, 0.99)
    sensor = {"kind": "cartesian_position", "sigma": SIGMA, "clutter_density": CLUTTER, "detection_probability": stated}
    return {
        "title": title,
        "seed": 1,
        "source": scene(detection),
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


def _reset(
    kind: str, forward: float, side: float, turning: float, speed: float, more: dict[str, float] | None = None
) -> list[dict[str, Any]]:
    common = {"kind": kind, "sigma_forward": forward} | (more or {})
    return _modes(
        "ekf",
        common | {"sigma_side": side},
        common | {"sigma_side": turning, "side_speed": speed},
        common | {"sigma_side": turning, "side_speed": -speed},
    )


_PLACE = {"x": SIGMA, "y": SIGMA}
_CARTESIAN = {"spread": _PLACE | {"vx": 20.0, "vy": 20.0}}
_TURNS = [[0.9, 0.05, 0.05], [0.1, 0.9, 0.0], [0.1, 0.0, 0.9]]


def filters(noise: float = 1.0, detection: float = 1.0) -> dict[str, dict[str, Any]]:
    """Return the filters on the scene: their process noises times `noise`, each target seen with `detection`."""
    straight: dict[str, Any] = {"kind": "constant_velocity_piecewise"}
    singer: list[dict[str, Any]] = [
        straight | {"sigma_accel": 5.0 * noise},
        {"kind": "singer", "tau": 10.0, "sigma_accel": 20.0 * noise},
        {"kind": "singer", "tau": 10.0, "sigma_accel": 60.0 * noise},
    ]
    turning: dict[str, Any] = {"kind": "known_turn", "sigma_accel": 5.0 * noise}
    car = [straight | {"sigma_accel": 3.0 * noise}, *(turning | {"turn_rate": rate} for rate in (-0.14, 0.14))]
    calm: dict[str, Any] = {"kind": "target_oriented", "sigma_forward": 3.0 * noise, "sigma_side": 3.0 * noise}
    wild = calm | {"sigma_side": 10.0 * noise}
    tom = [calm, *(wild | {"side_accel": accel} for accel in (56.0, -56.0))]
    literal = (2.0 * noise, 10.0 * noise, 20.0 * noise, 70.0)
    made = {
        "Singer": (
            "Constant velocity and two Singer models",
            _modes("kalman", *singer),
            [[0.9, 0.08, 0.02], [0.1, 0.8, 0.1], [0.05, 0.15, 0.8]],
            {"spread": _CARTESIAN["spread"] | {"ax": 10.0, "ay": 10.0}},
        ),
        "CAR": ("Constant velocity and two known turn rates", _modes("kalman", *car), _TURNS, _CARTESIAN),
        "TOM literal": (
            "Three target-oriented models as printed, the covariance kept at the reset",
            _reset("target_oriented_literal", *literal),
            _TURNS,
            _frame(),
        ),
        "TOM smoothed": (
            "The same with a heading from a filter of its own",
            _reset("target_oriented_smoothed", *literal, {"heading_gain": 0.5}),
            _TURNS,
            _frame(),
        ),
        "TOM certain": (
            "Three target-oriented models as printed, the side speed known after the reset",
            _reset("target_oriented_certain", 5.0 * noise, 46.0 * noise, 60.0 * noise, 70.0),
            _TURNS,
            _frame(),
        ),
        "TOM": ("Three target-oriented models, consistent", _modes("ekf", *tom), _TURNS, _CARTESIAN),
    }
    return {name: config(*parts, detection) for name, parts in made.items()}


FILTERS = filters()
"""The paper gives turn rates, side speeds and the radar; the rest is chosen (docs/papers.md)."""

MODES = {"Singer": ("straight", "Singer 20 m/s^2", "Singer 60 m/s^2")}
"""What the modes are, where they are not straight flight and turns to the right and to the left."""
