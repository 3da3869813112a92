"""Jobs that users have, each as the libraries do it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import vedette
from benchmarks.problems import MODES, switching

CV = {"kind": "constant_velocity", "sigma_accel": MODES[0][0]}
EKF = {"kind": "ekf", "motion": CV}
TWO = [EKF, {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": MODES[1][0]}}]
IMM = {"kind": "imm", "modes": TWO, "transition": switching(2).tolist()}
UKF = {"kind": "ukf", "motion": CV}

Run = Callable[[], Any]
"""Does a job once, and returns what it found: a position (2,), or None where none is compared."""


def built(estimator: Any, sensor: Any, associator: str = "pda", **parts: Any) -> vedette.Tracker:
    """Return a tracker of these parts; of a given track unless `parts` say otherwise."""
    start = {name: [0.0, 1.0] for name in ("x", "y", "vx", "vy")}
    usual = {"birth": {"kind": "given", "start": start}, "lifecycle": {"kind": "single_target"}}
    whole = {"estimator": estimator, "sensors": {"radar": sensor}, "associator": {"kind": associator}}
    return vedette.build(whole | usual | parts)
