"""JPDA*: of associations that differ by an exchange only, the best; by enumeration, and by tracks that stay apart."""

from collections import defaultdict
from itertools import product

import numpy as np
import pytest

import vedette
from vedette import Detections, Scan
from vedette_standard.associators.jpda import Jpda
from vedette_standard.associators.jpda_star import JpdaStar


def enumerated(scores, *, of_all=False):
    """Marginals (t, 1+k) of the best association of each set of tracks and returns, or of all."""
    groups = defaultdict(list)
    for choice in product(range(scores.shape[1]), repeat=len(scores)):
        taken = [one for one in choice if one]
        score = sum(scores[t, one] for t, one in enumerate(choice))
        if len(set(taken)) == len(taken) and np.isfinite(score):
            detected = frozenset(t for t, one in enumerate(choice) if one)
            groups[choice if of_all else (detected, frozenset(taken))].append((score, choice))
    weights = np.zeros(scores.shape)
    for score, choice in map(max, groups.values()):
        weights[range(len(scores)), choice] += np.exp(score)
    return weights / weights.sum(axis=-1, keepdims=True)


@pytest.mark.parametrize("seed", range(12))
def test_it_sums_over_the_best_of_each_exchange(seed):
    rng = np.random.default_rng(seed)
    t, k = int(rng.integers(1, 5)), int(rng.integers(1, 5))
    scores = 2.0 * rng.standard_normal((t, 1 + k))
    scores[:, 1:][rng.random((t, k)) < 0.2] = -np.inf
    found = JpdaStar(m=2000).associate(scores, None)
    np.testing.assert_allclose(found, enumerated(scores), atol=1e-12)
    np.testing.assert_allclose(Jpda().associate(scores, None), enumerated(scores, of_all=True), atol=1e-12)


def test_tracks_of_close_targets_do_not_run_together():
    """Two targets 6 m apart, sigma 5 m: the tracks of `jpda` come to lie nearer to each other than those of `jpda_star`."""
    apart = dict.fromkeys(("jpda", "jpda_star"), 0.0)
    motion = {"kind": "constant_velocity", "sigma_accel": 0.1}
    for kind in apart:
        tracker = vedette.build({
            "estimator": {"kind": "kalman", "motion": motion},
            "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0, "clutter_density": 1e-6,
                                  "detection_probability": 0.95}},
            "associator": {"kind": kind}, "lifecycle": {"kind": "single_target"},
        })  # fmt: skip
        for seed in range(12):
            rng = np.random.default_rng(seed)
            mean = np.zeros((2, 4))
            names = tracker.state.names
            mean[:, names.index("y")], mean[:, names.index("vx")] = (-3.0, 3.0), 5.0
            state = tracker.start(vedette.Gaussian(mean, np.tile(np.diag([4.0, 4.0, 0.1, 0.1]), (2, 1, 1))))
            for time in range(40):
                at = np.array([[5.0 * time, -3.0], [5.0 * time, 3.0]])[rng.random(2) < 0.95]
                z = at + 5.0 * rng.standard_normal(at.shape)
                state = tracker.step(state, Scan(float(time), "radar", Detections.of(z, 2)))
            y = tracker.estimate(state).mean[:, names.index("y")]
            apart[kind] += abs(float(y[1] - y[0])) / 12
    assert apart["jpda"] < 0.75 * apart["jpda_star"], apart
    assert apart["jpda_star"] > 5.0, apart
