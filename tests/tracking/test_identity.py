"""What a track is called is kept while the best hypothesis changes what it takes to be the track's past."""

import numpy as np
import pytest
from attrs import evolve

import vedette
from vedette import Detections, Gaussian, Scan
from vedette.tracking import conclusion

CONFIG = {
    "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.3}},
    "sensors": {
        "radar": {"kind": "cartesian_position", "sigma": 2.0, "detection_probability": 0.9, "clutter_density": 1e-4}
    },
    "birth": {"kind": "given", "start": {"x": [0.0, 1.0], "y": [0.0, 1.0], "vx": [0.0, 1.0], "vy": [0.0, 1.0]}},
    "lifecycle": {"kind": "existence", "confirm": 0.5, "delete": 1e-6},
}
RUNS = range(6)


def states_of(kind, seed):
    """Two tracks that are given, whose targets cross slowly among false returns."""
    tracker, rng = vedette.build(CONFIG | {"associator": {"kind": kind}}), np.random.default_rng(seed)
    start = np.array([[0.0, 10.0, 4.0, -1.0], [0.0, -10.0, 4.0, 1.0]])
    mean = start[:, [tracker.state.names.index(axis) for axis in ("x", "y", "vx", "vy")]]
    states = [tracker.start(Gaussian(mean, np.tile(np.diag([4.0, 4.0, 0.25, 0.25]), (2, 1, 1))), 0.0)]
    for time in np.arange(1.0, 21.0):
        at = (start[:, :2] + time * start[:, 2:])[rng.random(2) < 0.9]
        false = at.mean(axis=0) + rng.uniform(-15, 15, (rng.poisson(2), 2)) if len(at) else np.zeros((0, 2))
        z = np.concatenate([at + rng.normal(0, 2, at.shape), false])
        states.append(tracker.step(states[-1], Scan(time, "radar", Detections.of(z, 2))))
    return tracker, states


def changes(tracker, states):
    """In how many scans a leaf is shown that does not continue the one shown before."""
    shown = [tracker.associator.reported(state.leaves.hypotheses, state.leaves.existence) for state in states]
    pairs = zip(states[1:], shown, shown[1:], strict=False)
    return sum(not np.isin(state.leaves.parent[now], before).all() for state, before, now in pairs)


@pytest.mark.parametrize("kind", ["k_best", "n_scan", "lmb"])
@pytest.mark.by_turns
def test_a_track_is_called_the_same_whichever_hypothesis_is_best(kind):
    changed = 0
    for seed in RUNS:
        tracker, states = states_of(kind, seed)
        changed += changes(tracker, states)
        for state in states:
            assert state.ids.tolist() == [0, 1]
    assert changed >= 3


def test_names_by_leaf_are_noticed(monkeypatch):
    """The mutant calls a track by the row of its leaf."""
    real = conclusion.next_state

    def renamed(*given, **changes):
        state = real(*given, **changes)
        return evolve(state, ids=state.ids + state.leaves.choice[: len(state.ids)])

    monkeypatch.setattr(conclusion, "next_state", renamed)
    with pytest.raises(AssertionError):
        test_a_track_is_called_the_same_whichever_hypothesis_is_best("k_best")
