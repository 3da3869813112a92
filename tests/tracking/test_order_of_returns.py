"""In which order a scan holds its returns says nothing, nor how the axes lie: the tracks are the same."""

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


KINDS = ["nearest", "pda", "gnn", "jpda", "jpda_star", "m_best_jpda", "variational", "k_best", "n_scan", "lmb"]
TURNS = {
    "turned": [[0.6, -0.8], [0.8, 0.6]],
    "half a turn": [[-1.0, 0.0], [0.0, -1.0]],
    "mirrored": [[1.0, 0.0], [0.0, -1.0]],
}


@pytest.mark.parametrize("by", KINDS)
@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.by_turns
def test_a_scene_in_other_axes_gives_the_same_tracks(by, turn):
    """Young tracks that share returns: which of them has one is not for the axes to say."""
    rng, axes = np.random.default_rng(3), np.array(TURNS[turn])
    targets = rng.uniform(-60, 60, (8, 2))
    scans = [np.concatenate([targets + rng.normal(0, 5.0, (8, 2)), rng.uniform(-100, 100, (6, 2))]) for _ in range(5)]
    found = tracks(by, "from_returns", scans)
    other = tracks(by, "from_returns", [z @ axes.T + 40.0 for z in scans])
    other[:, :2] -= 40.0
    for plane in (slice(2), slice(2, 4)):
        other[:, plane] = other[:, plane] @ axes
    np.testing.assert_allclose(other[np.lexsort(other.round(3).T)], found, rtol=1e-6, atol=1e-6)
