"""The scene and the filters of the study, as configs; examples/vts holds the same to be changed."""

from __future__ import annotations

from typing import Any

RADAR = {"sigma_range": 1.5, "sigma_bearing": "0.088 deg"}
PERIOD = 3.0
LEGS = {"CV1": (0, 149), "turn 1": (149, 159), "accel": (159, 239), "turn 2": (239, 249), "CV2": (249, 400)}
"""The legs of the target as scans, counted from 0: first, and one past the last."""


SURGES = {"by turns of 5 scans": 16, "by turns of 20 scans": 4}
"""How often the 80 scans at 1 m/s^2 change between speeding up and slowing down: the paper says only that they do."""
NOISES = {"half": 0.5, "as chosen": 1.0, "double": 2.0}
STAYS = {"stay .9": 0.9, "stay .98": 0.98, "stay .99": 0.99}


def _legs(surges: int) -> list[dict[str, Any]]:
    """Return the legs of the paper's table 1; a scan belongs to the leg that ends with it, so scan 1 at 0 s has none."""
    pushes = [{"do": "accelerate", "seconds": 80 / surges * PERIOD, "accel": (-1) ** i * 1.0} for i in range(surges)]
    return [
        {"do": "straight", "seconds": 148 * PERIOD},
        {"do": "turn", "seconds": 10 * PERIOD, "rate": "5 deg/s"},
        *pushes,
        {"do": "turn", "seconds": 10 * PERIOD, "rate": "-5 deg/s"},
    ]


def scene(surges: int = 16) -> dict[str, Any]:
    """Return the source: one vessel, seen by a radar at the origin for 400 scans."""
    vessel = {"start": [6000, 5000], "course": "200 deg", "speed": "20 kn", "legs": _legs(surges)}
    return {
        "kind": "simulation",
        "duration": 399 * PERIOD,
        "looks": {"antenna": {"interval": PERIOD}},
        "ships": {"vessel": vessel},
    }


def config(title: str, estimator: dict[str, Any], spread: dict[str, float], surges: int) -> dict[str, Any]:
    """Return an experiment on the scene; `spread` of the axes beyond position, around the true start."""
    return {
        "title": title,
        "seed": 1,
        "source": scene(surges),
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


def _imm(stay: float, *modes: dict[str, Any]) -> dict[str, Any]:
    return {"kind": "imm", "transition": [[stay, round(1 - stay, 12)], [0.05, 0.95]], "modes": list(modes)}


_SPEED = {"vx": 5.0, "vy": 5.0}
_ACCEL = {"ax": 0.5, "ay": 0.5}


def filters(surges: int = 16, noise: float = 1.0, stay: float = 0.98) -> dict[str, dict[str, Any]]:
    """Return the filters on the scene: their process noises times `noise`, the IMMs stay in straight flight with `stay`."""
    moving = {
        "CVKF": ("One constant-velocity Kalman filter, q = 0.1 m/s^2", _cv(0.1 * noise), _SPEED),
        "CVKF wide": ("One constant-velocity Kalman filter, q = 1 m/s^2", _cv(noise), _SPEED),
        "CAKF": ("One constant-acceleration Kalman filter, q = 0.6 m/s^2", _ca(0.6 * noise), _SPEED | _ACCEL),
        "CAKF tight": ("One constant-acceleration Kalman filter, q = 0.1 m/s^2", _ca(0.1 * noise), _SPEED | _ACCEL),
        "IMMCV2": ("IMM of two constant-velocity filters", _imm(stay, _cv(0.03 * noise), _cv(noise)), _SPEED),
        "IMMCVCA": (
            "IMM of constant velocity and constant acceleration",
            _imm(stay, _cv(0.03 * noise), _ca(0.6 * noise)),
            _SPEED | _ACCEL,
        ),
    }
    return {name: config(title, estimator, spread, surges) for name, (title, estimator, spread) in moving.items()}


FILTERS = filters()
"""The paper names four filters but no process noise: these values are chosen; two more show the effect of the choice."""

MODES = {
    "IMMCV2": ("constant velocity, q = 0.03 m/s^2", "q = 1 m/s^2"),
    "IMMCVCA": ("constant velocity", "constant acceleration"),
}
"""What the modes of an IMM are."""
