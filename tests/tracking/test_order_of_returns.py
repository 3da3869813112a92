"""In which order a scan holds its returns says nothing: permuted, they give the same tracks."""

import numpy as np
import pytest

import vedette
from vedette import Detections, Scan

RADAR = {"kind": "cartesian_position", "sigma": 5.0, "detection_probability": 0.9, "clutter_density": 1e-5}
VIEW = {axis: {"low": -300, "high": 300} for axis in "xy"}
BIRTHS = {
    "from_returns": {"spread": {"vx": 10.0, "vy": 10.0}},
    "two_point": {"max_speed": 30.0},
    "uniform": {"view": VIEW, "spread": {"vx": 10.0, "vy": 10.0}, "initial": 3.0, "rate": 0.02},
}


def tracks(by, birth, scans):
    parts = {"associator": {"kind": by}, "birth": {"kind": birth, **BIRTHS[birth]}, "lifecycle": {"kind": "existence"}}
    motion = {"kind": "constant_velocity", "sigma_accel": 0.3}
    made = vedette.build({"estimator": {"kind": "kalman", "motion": motion}, "sensors": {"radar": RADAR}, **parts})
    state = made.start(seed=1)
    for k, z in enumerate(scans):
        state = made.step(state, Scan(float(k), "radar", Detections.of(z)))
    estimate = made.estimate(state)
    found = np.column_stack([estimate.mean, state.existence, state.confirmed])
    return found[np.lexsort(found.round(3).T)]


@pytest.mark.parametrize("by", ["nearest", "pda", "gnn", "jpda", "k_best", "lmb"])
@pytest.mark.parametrize("birth", BIRTHS)
@pytest.mark.by_turns
def test_permuted_returns_give_the_same_tracks(by, birth):
    """Two targets 20 m apart: tracks that begin in one scan share their returns."""
    rng, scans = np.random.default_rng(5), []
    for k in range(8):
        targets = [[-100.0 + 20.0 * k, 0.0], [-100.0 + 20.0 * k, 20.0]] + rng.normal(0, 5, (2, 2))
        scans.append(np.concatenate([targets, rng.uniform(-300, 300, (12, 2))]))
    found = tracks(by, birth, scans)
    assert found[:, -1].any(), "the law says something"
    for _ in range(3):
        np.testing.assert_allclose(tracks(by, birth, [rng.permutation(z) for z in scans]), found, rtol=1e-6, atol=1e-6)
