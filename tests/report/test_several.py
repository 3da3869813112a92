"""Whether targets that give several returns a scan are told."""

import numpy as np
import pytest

import vedette
from vedette import Detections, Scan
from vedette.tracking import History
from vedette_report.warnings.several import several

CONFIG = {
    "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
    "sensors": {"radar": {"kind": "cartesian_position", "sigma": 1.0, "clutter_density": 1e-4}},
    "associator": {"kind": "jpda"},
    "birth": {"kind": "from_returns", "spread": {"vx": 8, "vy": 8}},
    "lifecycle": {"kind": "existence"},
}


def told(each, apart=1.0, clutter=4.0, seed=1, scans=40):
    """Return what is told of four targets that give so many returns on average, of that spread, in clutter."""
    tracker, rng = vedette.build(CONFIG), np.random.default_rng(seed)
    place, speed = rng.uniform(-100, 100, (4, 2)), rng.uniform(-8, 8, (4, 2))
    seen = []
    for k in range(scans):
        count = [each if isinstance(each, int) else rng.poisson(each) for _ in range(4)]
        own = np.repeat(place + speed * k, count, axis=0)
        own = own + rng.uniform(-apart, apart, own.shape) + rng.normal(0.0, 0.7, own.shape)
        z = np.concatenate([own, rng.uniform(-200, 200, (rng.poisson(clutter), 2))])
        seen.append(Scan(float(k), "radar", Detections.of(z)))
    return _told(tracker, seen)


def _told(tracker, seen):
    state, history = tracker.start(seed=1), History(tracker)
    for scan in seen:
        state = tracker.step(state, scan)
        history.add(state)
    return list(several(tracker, seen, history.tracks()))


@pytest.mark.parametrize("each", [1.5, 3.0, 8])
def test_several_returns_of_a_target_are_told_and_what_makes_them_one(each):
    (said,) = told(each)
    assert said.startswith("radar: beside a return that a track takes lie ")
    assert "grouped_returns" in said


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("clutter", [0.0, 4.0, 100.0])
def test_clutter_around_targets_of_one_return_is_not_taken_for_theirs(clutter, seed):
    assert told(1, clutter=clutter, seed=seed) == []


def test_targets_that_meet_are_not_taken_for_one():
    """Half-way they lie within their noise of each other, for a third of the time."""
    tracker, rng, seen = vedette.build(CONFIG), np.random.default_rng(2), []
    for k in range(60):
        at = (k - 30.0) * np.array([[0.2, 0.1], [-0.2, 0.1], [0.1, -0.2], [-0.1, -0.2]])
        seen.append(Scan(float(k), "radar", Detections.of(at + rng.normal(0.0, 1.0, at.shape))))
    assert _told(tracker, seen) == []
