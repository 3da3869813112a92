"""The estimate is that of a target that exists: a track's own existence decides whether it goes on, not where it is."""

import numpy as np
import pytest
from attrs import evolve
from hypothesis import given, settings
from hypothesis import strategies as st

import vedette
from vedette import Detections, Scan, Tracker, kernels
from vedette_standard.associators.global_nearest import GlobalNearest
from vedette_standard.associators.jpda import Jpda
from vedette_standard.associators.nearest import Nearest
from vedette_standard.associators.pda import Pda
from vedette_standard.births.from_returns import FromReturns
from vedette_standard.estimators.bootstrap import BootstrapParticles
from vedette_standard.estimators.imm import Imm
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.lifecycles.existence import Existence
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.sensors.cartesian_position import CartesianPosition

RADAR = CartesianPosition(1.0, 0.9, 1e-2)
KALMAN = Kalman(ConstantVelocity(0.2))
IMM = Imm((KALMAN, Kalman(ConstantVelocity(2.0))), transition=[[0.9, 0.1], [0.1, 0.9]])
KEPT = Existence(lifetime=1e9, confirm=0.9, delete=0.0)


def second_scan(estimator, associator, existence, z):
    """The state after two scans: returns at 0 and at `z`, of a track whose existence is replaced by `existence` between."""
    birth = FromReturns(spread={"vx": 1.0, "vy": 1.0})
    tracker = Tracker(estimator, {"radar": RADAR}, associator, KEPT, birth)
    state = tracker.step(tracker.start(seed=3), Scan(0.0, "radar", Detections.of([[0.0, 0.0]])))
    state = evolve(state, existence=np.full(1, existence))
    return tracker, tracker.step(state, Scan(1.0, "radar", Detections.of(z, 2)))


@pytest.mark.parametrize("associator", [Pda(), Jpda(), Nearest(), GlobalNearest()], ids=lambda x: x.kind)
@pytest.mark.parametrize("estimator", [KALMAN, IMM, BootstrapParticles(ConstantVelocity(0.2), 500)], ids=lambda x: x.kind)
@pytest.mark.parametrize("existence", [0.01, 0.2, 0.999])
def test_the_estimate_does_not_depend_on_the_tracks_own_existence(associator, estimator, existence):
    """A return 2 m off, in dense clutter: 1.33 m from the one before for every existence that takes it at all."""
    z = [[2.0, 0.0], [-1.0, 2.0]]
    tracker, sure = second_scan(estimator, associator, 1.0, z)
    _, doubted = second_scan(estimator, associator, existence, z)
    if associator.solves == "best" and not np.array_equal(sure.weights, doubted.weights):
        return  # a hard choice may differ: it depends on the existence, and is exempt
    got, wanted = tracker.estimate(doubted), tracker.estimate(sure)  # new tracks follow: those are not compared
    np.testing.assert_allclose(got.mean[0], wanted.mean[0], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(got.cov[0], wanted.cov[0], rtol=1e-9, atol=1e-9)


def test_the_weights_that_are_kept_still_doubt_the_target():
    _, state = second_scan(KALMAN, Pda(), 0.01, [[2.0, 0.0]])
    _, sure = second_scan(KALMAN, Pda(), 1.0, [[2.0, 0.0]])
    assert state.hit[0] < 0.5 < sure.hit[0]


@settings(max_examples=200)
@given(st.integers(1, 4), st.integers(0, 4), st.integers(0, 2**32 - 1), st.sampled_from([Pda(), Jpda()]))
def test_of_several_tracks_each_ones_weights_do_not_depend_on_its_own_existence(t, k, seed, associator):
    rng = np.random.default_rng(seed)
    loglik = np.concatenate([np.log(rng.uniform(0.01, 0.9, (t, 1))), rng.normal(0.0, 3.0, (t, k))], axis=1)
    inside = rng.random((t, k)) < 0.8
    distance, valid = np.where(inside, 1.0, 99.0), np.ones(k, dtype=bool)
    existence, found = rng.uniform(0.05, 0.95, t), []
    for own in (existence[0], 0.5, 1.0):
        existence = np.concatenate([[own], existence[1:]])
        scores = kernels.gate_scores(loglik, distance, valid, existence, 9.0, np.zeros(()), None, None)
        weights = associator.associate(scores, None)
        found.append(kernels.given_existence(weights, scores, loglik, existence)[0])
    np.testing.assert_allclose(found[0], found[2], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found[1], found[2], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("existence", [0.0, 1e-300, 0.3, 1.0])
@pytest.mark.parametrize("miss", [-np.inf, -800.0, -0.1, 0.0])
@pytest.mark.parametrize("associator", [Pda(), Jpda(), Nearest(), GlobalNearest()], ids=lambda x: x.kind)
def test_no_existence_and_impossible_misses_give_no_nan(existence, miss, associator):
    loglik = np.array([[miss, 1.0, -2.0], [miss, -np.inf, 0.5]])
    given_e = np.array([existence, existence])
    scores = kernels.gate_scores(loglik, np.ones((2, 2)), np.ones(2, dtype=bool), given_e, 9.0, np.zeros(()), None, None)
    weights = associator.associate(scores, None)
    if not np.isfinite(weights).all():
        pytest.skip("every hypothesis is impossible: no weights are defined")
    used = kernels.given_existence(weights, scores, loglik, given_e)
    assert np.isfinite(used).all()
    np.testing.assert_allclose(used.sum(axis=1), 1.0)


def normalised_errors(runs, ages):
    """NEES (2, runs, ages) of tracks begun at a target's return, velocity drawn from the prior, none deleted.

    The first row is of the filter that doubts its target, the second of the one that is given e = 1, on the same returns.
    """
    rng, nees = np.random.default_rng(11), np.empty((2, runs, ages))
    for run in range(runs):
        truth, scans = np.array([0.0, 0.0, *rng.normal(0, 1.0, 2)]), []
        for age in range(ages + 1):
            own = [truth[:2] + rng.normal(0, 1.0, 2)] if age == 0 or rng.random() < 0.9 else []
            false = [] if age == 0 else list(rng.uniform(-10, 10, (rng.poisson(4.0), 2)) + truth[:2])
            scans.append((np.reshape([*own, *false], (-1, 2)), truth.copy()))
            truth[:2] += truth[2:]
        for row, initial in enumerate((0.2, 1.0)):
            birth = FromReturns(spread={"vx": 1.0, "vy": 1.0}, initial=initial)
            tracker = Tracker(Kalman(ConstantVelocity(1e-6)), {"radar": RADAR}, Pda(), KEPT, birth)
            order = [("x", "y", "vx", "vy").index(name) for name in tracker.state.names]
            state = tracker.step(tracker.start(), Scan(0.0, "radar", Detections.of(scans[0][0], 2)))
            tracker = evolve(tracker, birth=None)
            for age, (z, x) in enumerate(scans[1:]):
                state = tracker.step(state, Scan(1.0 + age, "radar", Detections.of(z, 2)))
                estimate = tracker.estimate(state)
                error = estimate.mean[0] - x[order]
                nees[row, run, age] = error @ np.linalg.solve(estimate.cov[0], error)
    return nees


@pytest.mark.costly
def test_errors_are_those_of_the_filter_that_is_told_that_its_target_exists():
    doubting, sure = normalised_errors(100, 8)
    np.testing.assert_allclose(doubting, sure, rtol=1e-6)


@pytest.mark.costly
def test_the_comparison_of_errors_bites(monkeypatch):
    """With the weights as they were, young tracks are wrong: their mean NEES is off by more than 4 standard errors."""
    monkeypatch.setattr(kernels, "given_existence", lambda weights, *rest: weights)
    doubting, sure = normalised_errors(300, 3)
    apart = doubting - sure
    error = apart.std(axis=0, ddof=1) / np.sqrt(len(apart))
    assert np.max(np.abs(apart.mean(axis=0)) / error) > 4.0


def test_the_leaf_that_is_shown_is_that_of_a_target_that_exists():
    """`lmb` shows one leaf of each track: a miss that is likely since there is no target is not the estimate of one."""
    tracker = vedette.build(
        {
            "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
            "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0, "clutter_density": 1e-4}},
            "associator": {"kind": "lmb"},
            "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
            "lifecycle": {"kind": "existence", "delete": 0.0},
        }
    )
    before = tracker.start(vedette.Gaussian(np.zeros((1, 4)), np.diag([90.0, 90.0, 9.0, 9.0])[None]), 0.0)
    found = []
    for existence in (1e-3, 1.0):
        leaves = evolve(before.leaves, existence=np.array([existence]))
        state = evolve(before, existence=np.array([existence]), leaves=leaves)
        after = tracker.step(state, vedette.Scan(1.0, "radar", vedette.Detections.of([[8.0, 4.0]])))
        found.append(tracker.estimate(after).mean[after.ids == 0])
    np.testing.assert_allclose(found[0], found[1], atol=1e-12)
    assert found[1][0, 0] > 4.0
