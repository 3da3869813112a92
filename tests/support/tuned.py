"""Simulated data sets of known noise, detection and clutter, and configs that start from ten times too small or large."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import numpy as np

import vedette
from vedette_files import write_recording

VIEW = {"low": -1500.0, "high": 1500.0}
"""Where false returns lie; the target stays within, at 3.8 standard deviations after two minutes."""
START = {"x": [0, 10], "y": [0, 10], "vx": [0, 1], "vy": [0, 1]}
CONFIG: dict[str, Any] = {
    "title": "One target in clutter",
    "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
    "sensors": {
        "radar": {"kind": "cartesian_position", "sigma": 10.0, "detection_probability": 0.8, "clutter_density": 2e-6}
    },
    "associator": {"kind": "pda"},
    "gate": {"probability": 0.9999},
    "birth": {"kind": "given", "start": START},
    "lifecycle": {"kind": "single_target"},
}
SCENE: dict[str, Any] = {
    "kind": "simulation",
    "duration": 120.0,
    "looks": {"radar": {"interval": 1.0, "clutter": {"x": VIEW, "y": VIEW}}},
    "drawn": {"target": {"models": [{"kind": "constant_velocity", "sigma_accel": 0.5}], "start": START}},
}
TRUTH = {
    "estimator.motion.sigma_accel": 0.5,
    "sensors.radar.sigma": 10.0,
    "sensors.radar.detection_probability": 0.8,
    "sensors.radar.clutter_density": 2e-6,
}
RANGES = {
    "estimator.motion.sigma_accel": "0.01..20",
    "sensors.radar.sigma": "0.3..300",
    "sensors.radar.detection_probability": "0.05..0.995",
    "sensors.radar.clutter_density": "1e-8..1e-4",
}
RATES = {"estimator.transition[0][1]": 0.1, "estimator.transition[1][0]": 0.2}
"""Of the target that switches; some 27 times each way in 400 scans."""
MODES = [{"kind": "constant_velocity", "sigma_accel": sigma} for sigma in (0.1, 1.0)]


def scene(duration: float) -> dict[str, Any]:
    """Return the source that draws the data."""
    return copy.deepcopy(SCENE) | {"duration": duration}


def wrong(value: float, factor: float) -> float:
    """Return a value that is so many times too large; of a probability its odds are."""
    if not 0.05 <= value < 1.0 or value == 0.5:
        return factor * value
    odds = factor * value / (1.0 - value)
    return odds / (1.0 + odds)


def recorded(path: Path, seed: int, duration: float = 120.0) -> dict[str, Any]:
    """Write one data set, drawn from the true values, and return the config with these values on it."""
    config = copy.deepcopy(CONFIG)
    experiment = vedette.load(config | {"source": scene(duration)})
    assert experiment.source is not None
    drawn = experiment.source.open(experiment.tracker.sensors, np.random.default_rng(seed))
    write_recording(path, drawn, {"radar": experiment.tracker.sensors["radar"].measurement})
    return config | {"source": {"kind": "jsonl", "path": str(path)}}


def transition(there: float, back: float) -> list[list[float]]:
    """Return the matrix of two modes."""
    return [[1.0 - there, there], [back, 1.0 - back]]


def switching(path: Path, seed: int, factor: float = 1.0) -> dict[str, Any]:
    """Write the returns of a target that switches between modes, and return an IMM's config that knows all but the rates.

    Its odds of a switch are so many times too large. Each scan tells position and velocity so well that both modes are as
    sure of the state after it: what the IMM loses by merging what modes did before is then next to nothing.
    """
    config: dict[str, Any] = {
        "title": "Two modes",
        "estimator": {
            "kind": "imm",
            "modes": [{"kind": "kalman", "motion": motion} for motion in MODES],
            "transition": transition(*(wrong(rate, factor) for rate in RATES.values())),
        },
        "sensors": {
            "radar": {
                "kind": "linear", "axes": ["x", "y", "vx", "vy"], "R": np.diag([0.05**2] * 2 + [0.02**2] * 2).tolist(),
                "clutter_density": 1e-12,
            }
        },
        "associator": {"kind": "pda"},
        "gate": {"probability": 0.99999},
        "birth": {"kind": "given", "start": START},
        "lifecycle": {"kind": "single_target"},
    }  # fmt: skip
    drawn = {"models": MODES, "transition": transition(*RATES.values()), "start": START}
    scene = {"kind": "simulation", "duration": 400.0, "looks": {"radar": {"interval": 1.0}}, "drawn": {"target": drawn}}
    experiment = vedette.load(config | {"source": scene})
    assert experiment.source is not None
    recording = experiment.source.open(experiment.tracker.sensors, np.random.default_rng(seed))
    write_recording(path, recording, {"radar": experiment.tracker.sensors["radar"].measurement})
    return config | {"source": {"kind": "jsonl", "path": str(path)}}


def off(truth: dict[str, float], factor: float) -> list[str]:
    """Return the overrides that make each value so many times too large."""
    return [f"{path}={wrong(value, factor)!r}" for path, value in truth.items()]
