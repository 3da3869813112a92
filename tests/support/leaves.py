"""Trackers that keep hypotheses, and scans of two targets that cross, for tests of leaves."""

import numpy as np

import vedette
from vedette import Detections, Scan

MOTION = {"kind": "constant_velocity", "sigma_accel": 0.3}
RADAR = {"kind": "cartesian_position", "sigma": 2.0, "detection_probability": 0.9, "clutter_density": 1e-4}
POLAR = {
    "kind": "range_bearing", "sigma_range": 3.0, "sigma_bearing": 0.01, "max_range": 400.0, "clutter_density": 1e-2,
    "detection_probability": 0.9,
}  # fmt: skip
FILTERS = {
    "kalman": ({"kind": "kalman", "motion": MOTION}, RADAR),
    "ekf": ({"kind": "ekf", "motion": MOTION}, POLAR),
    "ukf": ({"kind": "ukf", "motion": MOTION}, POLAR),
    "imm": (
        {
            "kind": "imm",
            "modes": [{"kind": "kalman", "motion": MOTION}, {"kind": "kalman", "motion": {**MOTION, "sigma_accel": 2.0}}],
            "transition": [[0.95, 0.05], [0.1, 0.9]],
        },
        RADAR,
    ),
}
PLACE = {"x": [60.0, 60.0], "y": [60.0, 60.0], "vx": [0.0, 3.0], "vy": [0.0, 3.0]}
LIFECYCLE = {"kind": "existence", "lifetime": 200.0, "confirm": 0.6, "delete": 1e-4}
KINDS = ["k_best", "n_scan", "lmb", "variational"]


def composed(associator, estimator=FILTERS["kalman"][0], sensor=RADAR, **parts):
    config = {
        "estimator": estimator,
        "sensors": {"radar": sensor},
        "associator": {"kind": associator} if isinstance(associator, str) else associator,
        "birth": {"kind": "poisson", "appear": [{"at": PLACE, "initial": 2.0, "rate": 0.05}]},
        "lifecycle": LIFECYCLE,
    }
    return vedette.build(config | parts)


def scans(sensor, count=8, seed=3):
    """Two targets that cross, P_D .9, and some false returns, as positions or as range and bearing."""
    rng, found = np.random.default_rng(seed), []
    for time in np.arange(count, dtype=float):
        at = np.array([[40.0 + 4 * time, 60.0 + time], [40.0 + 4 * time, 68.0 - time]])[rng.random(2) < 0.9]
        xy = np.concatenate([at + rng.normal(0, 1.0, at.shape), rng.uniform(20, 100, (rng.poisson(2), 2))])
        z = xy if sensor is RADAR else np.stack([np.hypot(*xy.T), np.arctan2(*xy.T)], axis=-1)
        found.append(Scan(time, "radar", Detections.of(z, 2)))
    return found


def states_of(tracker, given):
    states = [tracker.start()]
    for scan in given:
        states.append(tracker.step(states[-1], scan))
    return states


def path_to(states, leaf):
    """The rows of a leaf and of its ancestors, the oldest first."""
    rows = [leaf]
    for state in states[:0:-1]:
        parent = int(state.leaves.parent[rows[-1]])
        if parent < 0:
            return rows[::-1]
        rows.append(parent)
    raise AssertionError("no track was given, so each begins")
