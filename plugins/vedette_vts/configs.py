"""The scene and the filters of the study, as configs; examples/vts holds the same to be changed."""

from __future__ import annotations

from typing import Any

RADAR = {"sigma_range": 1.5, "sigma_bearing": "0.088 deg"}
PERIOD = 3.0
LEGS = {"CV1": (0, 149), "turn 1": (149, 159), "accel": (159, 239), "turn 2": (239, 249), "CV2": (249, 400)}
"""The legs of the target as scans, counted from 0: first, and one past the last."""


def _legs() -> list[dict[str, Any]]:
    """Return the legs of the paper's table 1; a scan belongs to the leg that ends with it, so scan 1 at 0 s has none."""
    surges = [{"do": "accelerate", "seconds": 5 * PERIOD, "accel": (-1) ** i * 1.0} for i in range(16)]
    return [
        {"do": "straight", "seconds": 148 * PERIOD},
        {"do": "turn", "seconds": 10 * PERIOD, "rate": "5 deg/s"},
        *surges,
        {"do": "turn", "seconds": 10 * PERIOD, "rate": "-5 deg/s"},
    ]


def scene() -> dict[str, Any]:
    """Return the source: one vessel, seen by a radar at the origin for 400 scans."""
    vessel = {"start": [6000, 5000], "course": "200 deg", "speed": "20 kn", "legs": _legs()}
    return {
        "kind": "simulation",
        "duration": 399 * PERIOD,
        "looks": {"antenna": {"interval": PERIOD}},
        "ships": {"vessel": vessel},
    }


def config(title: str, estimator: dict[str, Any], spread: dict[str, float]) -> dict[str, Any]:
    """Return an experiment on the scene; `spread` of the axes beyond position, around the true start."""
    return {
        "title": title,
        "seed": 1,
        "source": scene(),
        "preprocessors": {"radar": {"kind": "naive_conversion", "sensors": {"antenna": {"kind": "range_bearing", **RADAR}}}},
        "sensors": {"radar": {"kind": "polar_position", **RADAR}},
        "estimator": estimator,
        "gate": {"probability": 0.999},
        "associator": {"kind": "nearest"},
        "birth": {"kind": "given", "spread": {"x": 10.0, "y": 10.0, **spread}},
        "lifecycle": {"kind": "single_target"},
    }


def _cv(sigma: float) -> dict[str, Any]:
    return {"kind": "kalman", "motion": {"kind": "constant_velocity_piecewise", "sigma_accel": sigma}}


def _ca(sigma: float) -> dict[str, Any]:
    return {"kind": "kalman", "motion": {"kind": "wiener_acceleration_piecewise", "sigma_change": sigma}}


def _imm(*modes: dict[str, Any]) -> dict[str, Any]:
    return {"kind": "imm", "transition": [[0.98, 0.02], [0.05, 0.95]], "modes": list(modes)}


_SPEED = {"vx": 5.0, "vy": 5.0}
_ACCEL = {"ax": 0.5, "ay": 0.5}

FILTERS: dict[str, dict[str, Any]] = {
    "CVKF": config("One constant-velocity Kalman filter, q = 0.1 m/s^2", _cv(0.1), _SPEED),
    "CVKF wide": config("One constant-velocity Kalman filter, q = 1 m/s^2", _cv(1.0), _SPEED),
    "CAKF": config("One constant-acceleration Kalman filter, q = 0.6 m/s^2", _ca(0.6), _SPEED | _ACCEL),
    "CAKF tight": config("One constant-acceleration Kalman filter, q = 0.1 m/s^2", _ca(0.1), _SPEED | _ACCEL),
    "IMMCV2": config("IMM of two constant-velocity filters", _imm(_cv(0.03), _cv(1.0)), _SPEED),
    "IMMCVCA": config("IMM of constant velocity and constant acceleration", _imm(_cv(0.03), _ca(0.6)), _SPEED | _ACCEL),
}
"""The paper names four filters but no process noise: these values are chosen; two more show the effect of the choice."""

MODES = {
    "IMMCV2": ("constant velocity, q = 0.03 m/s^2", "q = 1 m/s^2"),
    "IMMCVCA": ("constant velocity", "constant acceleration"),
}
"""What the modes of an IMM are."""
