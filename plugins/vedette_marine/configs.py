"""The filters of the study, as configs; examples/marine_picture.toml and joyride_marine.toml are meant to be changed."""

from __future__ import annotations

import math
from typing import Any

PROBABILITY_DETECTION = 0.95


def cv_pdaf(sigma: float, sigma_turn: float = 1e-3) -> dict[str, Any]:
    """Return the estimator of CV-PDAF: `sigma` in m/s^2, that of the turn rate in rad/s^2.

    Its axes are the five of the paper's state; the turn rate is a random walk beside the others.
    """
    turn = {"kind": "random_walk", "axes": ["turn_rate"], "unit": "rad/s", "sigma": sigma_turn}
    motion = {"kind": "product", "models": [{"kind": "constant_velocity", "sigma_accel": sigma}, turn]}
    return {"kind": "ekf", "motion": motion}


def ct_pdaf(sigma: float, sigma_turn: float) -> dict[str, Any]:
    """Return the estimator of CT-PDAF, whose turn rate is estimated."""
    return {"kind": "ekf", "motion": {"kind": "coordinated_turn", "sigma_accel": sigma, "sigma_turn_rate": sigma_turn}}


def imm_pdaf(cv: float, ct: tuple[float, float], stay: float, turn: float = 0.05) -> dict[str, Any]:
    """Return IMM-PDAF whose constant-velocity mode has no turn rate; a turn is taken to begin at 0 +- `turn` rad/s.

    `cv`: sigma of acceleration; `ct`: those of acceleration and turn rate; `stay`: probability that a mode stays, per scan.
    """
    straight = {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": cv}}
    return {
        "kind": "imm",
        "transition": _switching(stay),
        "modes": [straight, ct_pdaf(*ct)],
        "absent": {"turn_rate": [0.0, turn]},
    }


def _switching(stay: float) -> list[list[float]]:
    leave = round(1 - stay, 12)
    return [[stay, leave], [leave, stay]]


_ACCEL, _TURN_ACCEL = 0.1 * math.sqrt(10), 1e-3 * math.sqrt(10)
_PRINTED_CV: dict[str, Any] = {
    "kind": "ekf",
    "motion": {
        "kind": "product",
        "models": [
            {"kind": "constant_velocity_piecewise", "sigma_accel": _ACCEL},
            {"kind": "random_walk_piecewise", "axes": ["turn_rate"], "unit": "rad/s", "sigma": _TURN_ACCEL},
        ],
    },
}
_PRINTED_CT: dict[str, Any] = {
    "kind": "ekf",
    "motion": {"kind": "coordinated_turn_piecewise", "sigma_accel": _ACCEL, "sigma_turn_accel": _TURN_ACCEL},
}

TABLE_6: dict[str, dict[str, Any]] = {
    "IMM-PDAF": {"kind": "imm", "transition": _switching(0.8), "modes": [_PRINTED_CV, _PRINTED_CT]},
    "CV-PDAF": _PRINTED_CV,
    "CT-PDAF": _PRINTED_CT,
}
"""The paper's Table 6 with its dimensions and its G corrected: Q = 10 G diag(.1^2, .1^2, 1e-6) G', held in each step.

G = [T^2/2 0 0; 0 T^2/2 0; T 0 0; 0 T 0; 0 0 T], printed with T/2, in both models; the modes stay with .8 per scan.
"""

TUNED_BOATS = {
    "IMM-PDAF": imm_pdaf(0.05, (0.2, 1e-2), 0.95),
    "CV-PDAF": cv_pdaf(0.7),
    "CT-PDAF": ct_pdaf(0.2, 1e-2),
}
"""For small boats that manoeuvre hard: the two modes differ enough to be told apart."""

TUNED_SHIP = {
    "IMM-PDAF": imm_pdaf(0.02, (0.1, 1e-3), 0.95, 0.005),
    "CV-PDAF": cv_pdaf(0.1),
    "CT-PDAF": ct_pdaf(0.1, 1e-3),
}
"""For a large ship that is almost straight."""


def _in_pictures(chain: dict[str, Any], sigma: float, size: dict[str, float]) -> dict[str, Any]:
    return {
        "kind": "radar_picture",
        "sensors": {"screen": {"kind": "radar_screen"}},
        "chain": chain,
        "sigma": sigma,
        "evidence": {"brightness": {"clutter": 30.0, "ship": 120.0}, "size": size},
    }


BOATS_IN_PICTURES = _in_pictures({"link": 30.0, "longest": 40.0}, 6.0, {"clutter": 1.0, "ship": 8.0})
"""The detector for boats of up to 30 m at 6 m a pixel. The evidence's means are those of simulated pictures."""

SHIP_IN_PICTURES = _in_pictures({"link": 140.0, "longest": 250.0}, 20.0, {"clutter": 2.0, "ship": 30.0})
"""The detector for a ship of 180 m at 11 m a pixel."""


def tracker(
    estimator: dict[str, Any],
    sigma: float,
    start: float = 10.0,
    clutter_density: float | None = None,
    automatic: bool = False,
) -> dict[str, Any]:
    """Return a whole tracker: `sigma` of a position in m; `start`, the standard deviation of the initial position in m.

    The gate is common to all modes; its probability is .99, so its threshold is 9.21. Table 6 prints 13.074, which is .9986.
    Without a `clutter_density` in 1/m^2 it is the number of returns in the gate over its volume. Tracks are announced by
    AIS, or started automatically.
    """
    sensor: dict[str, Any] = {
        "kind": "cartesian_position",
        "sigma": sigma,
        "detection_probability": PROBABILITY_DETECTION,
        "clutter_density": 1e-6 if clutter_density is None else clutter_density,
    }
    spread = {"vx": 1.0, "vy": 1.0, "turn_rate": 0.01}
    announced = {"kind": "announced", "spread": {"x": start, "y": start} | spread}
    birth = {"kind": "from_returns", "spread": {"vx": 6.0, "vy": 6.0, "turn_rate": 0.01}}
    return {
        "estimator": estimator,
        "sensors": {"radar": sensor},
        "gate": {"probability": 0.99, "clutter": "nonparametric" if clutter_density is None else "sensor"},
        "associator": {"kind": "pda"},
        "birth": birth if automatic else announced,
        "lifecycle": {"kind": "existence" if automatic else "announced"},
    }
