"""Three targets that a tracker must find by itself in clutter, and that may leave the region in which clutter lies."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import numpy as np

import vedette
from vedette import Recording
from vedette_files import write_recording

TRUTH = {
    "estimator.motion.sigma_accel": 0.2,
    "sensors.radar.sigma": 8.0,
    "sensors.radar.detection_probability": 0.85,
    "sensors.radar.clutter_density": 1e-6,
}
RANGES = {
    "estimator.motion.sigma_accel": "0.02..2",
    "sensors.radar.sigma": "0.8..80",
    "sensors.radar.detection_probability": "0.3..0.99",
    "sensors.radar.clutter_density": "1e-7..1e-5",
}
CONFIG: dict[str, Any] = {
    "title": "Three targets",
    "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.2}},
    "sensors": {
        "radar": {"kind": "cartesian_position", "sigma": 8.0, "detection_probability": 0.85, "clutter_density": 1e-6}
    },
    "associator": {"kind": "jpda"},
    "birth": {"kind": "from_returns", "spread": {"vx": 5, "vy": 5}},
    "lifecycle": {"kind": "existence"},
}
VIEW = {"low": -1500.0, "high": 1500.0}
STARTS = (
    {"x": [-800, 50], "y": [0, 50], "vx": [4, 1], "vy": [0, 1]},
    {"x": [500, 50], "y": [-700, 50], "vx": [0, 1], "vy": [4, 1]},
    {"x": [0, 50], "y": [600, 50], "vx": [-2, 1], "vy": [-1, 1]},
)


def drawn(seed: int, scans: int, starts: tuple[dict[str, Any], ...] = STARTS) -> Recording:
    """Return the returns of targets that begin at `starts`, a scan a second."""
    motion = CONFIG["estimator"]["motion"]
    scene = {
        "kind": "simulation",
        "duration": float(scans),
        "looks": {"radar": {"interval": 1.0, "clutter": {"x": VIEW, "y": VIEW}}},
        "drawn": {f"target {i}": {"models": [motion], "start": start} for i, start in enumerate(starts)},
    }
    experiment = vedette.load(CONFIG | {"source": scene})
    assert experiment.source is not None
    return experiment.source.open(experiment.tracker.sensors, np.random.default_rng(seed))


def written(path: Path, recording: Recording) -> dict[str, Any]:
    """Write a recording, and return the config with the true values on it."""
    sensors = vedette.load(CONFIG).tracker.sensors
    write_recording(path, recording, {"radar": sensors["radar"].measurement})
    return copy.deepcopy(CONFIG) | {"source": {"kind": "jsonl", "path": str(path)}}
