"""The scene and the filters of the study, as configs; examples/bayes_risk holds the same to be changed."""

from __future__ import annotations

import math
from typing import Any

SIGMA = 6.7
"""In m; the paper does not state it. Chosen so that its filter has the published error: agreement there is calibration."""
THRESHOLD = 4 * SIGMA
CLUTTER = 0.3e-6
SENSORS = tuple(f"s{i}" for i in range(1, 8))
GATE = 0.9999


def scene() -> dict[str, Any]:
    """Return the source: table 1 of the paper, seen by seven sensors each second for 90 s."""
    legs = [
        {"do": "straight", "seconds": 20},
        {"do": "push", "seconds": 10, "push": [-5, 5]},
        {"do": "straight", "seconds": 20},
        {"do": "push", "seconds": 20, "push": [-5, -5]},
        {"do": "push", "seconds": 20, "push": [5, 5]},
    ]
    area = {"x": {"low": -500, "high": 5000}, "y": {"low": -500, "high": 11000}}
    target = {"start": [0, 0], "course": math.pi / 4, "speed": math.hypot(100, 100), "legs": legs}
    return {
        "kind": "simulation",
        "duration": 90,
        "looks": {name: {"interval": 1, "clutter": area} for name in SENSORS},
        "ships": {"target": target},
    }


def sensor(clutter: float) -> dict[str, Any]:
    """Return the config of one of the seven identical sensors."""
    return {"kind": "cartesian_position", "sigma": SIGMA, "clutter_density": clutter}


def _config(
    title: str, estimator: dict[str, Any], associator: str, clutter: float, rest: dict[str, float]
) -> dict[str, Any]:
    return {
        "title": title,
        "seed": 1,
        "source": scene(),
        "sensors": {name: sensor(clutter) for name in SENSORS},
        "estimator": estimator,
        "gate": {"probability": GATE},
        "associator": {"kind": associator},
        "birth": {"kind": "given", "spread": {"x": SIGMA, "y": SIGMA, **rest}},
        "lifecycle": {"kind": "single_target"},
    }


_SPEED = {"vx": 10.0, "vy": 10.0}


def proposed(detection: str, estimator: str, associator: str = "bayes_risk", clutter: float = CLUTTER) -> dict[str, Any]:
    """Return detection over the seven sensors, one constant-velocity filter per return; the fused sigma is not used."""
    motion = {"kind": "constant_velocity_piecewise", "sigma_accel": 6.0}
    config = _config("", {"kind": estimator, "motion": motion}, associator, clutter, _SPEED)
    detector = {"kind": detection, "sensors": config["sensors"], "base": "s1", "threshold": THRESHOLD}
    title = f"Distributed detection over seven sensors: {detection}, {estimator}"
    return config | {"title": title, "preprocessors": {"fused": detector}, "sensors": {"fused": sensor(clutter)}}


def baseline(q: tuple[float, float], transition: list[list[float]], title: str) -> dict[str, Any]:
    """Return IMM over constant velocity and constant acceleration; PDA processes simultaneous scans one after the other."""
    modes = [
        {"kind": "kalman", "motion": {"kind": "constant_velocity_piecewise", "sigma_accel": q[0]}},
        {"kind": "kalman", "motion": {"kind": "wiener_acceleration_piecewise", "sigma_change": q[1]}},
    ]
    estimator = {"kind": "imm", "transition": transition, "modes": modes}
    return _config(title, estimator, "pda", CLUTTER, _SPEED | {"ax": 2.0, "ay": 2.0})


FILTERS: dict[str, dict[str, Any]] = {
    "proposed": proposed("bayes_risk_detection", "kalman"),
    "proposed, printed": proposed("bayes_risk_printed", "parallel_kalman_printed"),
    "IMM/MSPDA tuned": baseline((1.0, 2.0), [[0.95, 0.05], [0.1, 0.9]], "IMM of CV and CA with multi-sensor PDA, tuned"),
    "IMM/MSPDA soft": baseline((0.05, 0.5), [[0.8, 0.2], [0.2, 0.8]], "IMM of CV and CA with multi-sensor PDA, soft"),
}
"""Process noises, transition probabilities, threshold and gate are chosen: the paper states none."""

DENSE = 100 * CLUTTER
CONTESTED: dict[str, dict[str, Any]] = {
    "printed weights, printed P": proposed("bayes_risk_printed", "parallel_kalman_printed", clutter=DENSE),
    "printed weights, with spread": proposed("bayes_risk_printed", "kalman", clutter=DENSE),
    "corrected weights, printed P": proposed("bayes_risk_detection", "parallel_kalman_printed", clutter=DENSE),
    "corrected weights, with spread": proposed("bayes_risk_detection", "kalman", clutter=DENSE),
    "likelihood ratio, with spread": proposed("count_likelihood_detection", "kalman", clutter=DENSE),
    "likelihood ratio, PDA": proposed("count_likelihood_detection", "kalman", "pda", clutter=DENSE),
}
"""At 100 times the published clutter, where returns compete often enough to tell the variants apart."""
