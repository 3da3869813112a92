"""What the tracks claim of a scan's returns, against all joint associations, and how inexact weights are told."""

from itertools import product

import numpy as np
import pytest

from vedette import Detections, Scan, Tracker
from vedette.kernels import claimed
from vedette_standard.associators.jpda import Jpda
from vedette_standard.associators.pda import Pda
from vedette_standard.births.from_returns import FromReturns
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.lifecycles.m_of_n import MOfN
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.sensors.cartesian_position import CartesianPosition


def by_enumeration(scores):
    """The probability (k,) that some track takes each return, over all associations in which no two tracks share one."""
    t, k = scores.shape[0], scores.shape[1] - 1
    total, taken = 0.0, np.zeros(k)
    for choice in product(range(1 + k), repeat=t):
        real = [c for c in choice if c]
        if len(set(real)) < len(real):
            continue
        likely = np.exp(sum(scores[i, c] for i, c in enumerate(choice)))
        total += likely
        taken[[c - 1 for c in real]] += likely
    return taken / total


@pytest.mark.parametrize("seed", range(20))
def test_claims_of_exclusive_tracks_are_the_marginals_of_the_joint_association(seed):
    rng = np.random.default_rng(seed)
    scores = rng.normal(0.0, 2.0, (rng.integers(1, 4), 1 + rng.integers(1, 4)))
    weights = Jpda().associate(scores, None)
    np.testing.assert_allclose(claimed(weights, True), by_enumeration(scores), rtol=1e-9)


def test_claims_of_tracks_that_know_nothing_of_each_other_are_independent():
    weights = np.array([[0.3, 0.5, 0.2], [0.5, 0.5, 0.0]])
    np.testing.assert_allclose(claimed(weights, False), [0.75, 0.2])
    np.testing.assert_allclose(claimed(weights, True), [1.0, 0.2])


def crowd(associator, count):
    """A state in which `count` tracks met `count` returns within each other's gates."""
    spots = np.stack([np.linspace(0.0, 4.0, count), np.zeros(count)], axis=-1)
    radar = CartesianPosition(3.0, 0.9, 1e-4)
    birth = FromReturns(spread={"vx": 1.0, "vy": 1.0})
    tracker = Tracker(Kalman(ConstantVelocity(0.1)), {"radar": radar}, associator, MOfN(), birth)
    state = tracker.step(tracker.start(), Scan(0.0, "radar", Detections.of(spots)))
    return tracker.step(state, Scan(1.0, "radar", Detections.of(spots + 0.5)))


def test_weights_that_are_not_exact_are_counted():
    assert crowd(Jpda(exact=3), 5).approximated == 5
    assert crowd(Jpda(exact=3), 3).approximated == 0
    assert crowd(Jpda(), 5).approximated == 0
    assert crowd(Pda(), 12).approximated == 0
