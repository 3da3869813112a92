"""Smoothing: equal to conditioning on all scans where that is exact, near enumeration where it is not, safe at the seams."""

import itertools
import json
import math
import os
import runpy
from pathlib import Path

import numpy as np
import pytest
from attrs import evolve, field, frozen
from scipy import stats
from scipy.linalg import block_diag

import vedette
from vedette import Associator, Detections, Estimator, Gaussian, MotionModel, Scan, Sensor, Space, Tracker
from vedette.cli import main
from vedette.errors import ConfigError
from vedette.io import read_tracks
from vedette.kernels import backward
from vedette.report.smoothed import smooth_result
from vedette.sampling.trajectories import draw_jump_markov, draw_states
from vedette.tracking import trees
from vedette.tracking.smoothing import check_smoothing, smooth, smoothed
from vedette_standard.associators.pda import Pda
from vedette_standard.estimators import imm as imm_module
from vedette_standard.estimators import unmixing
from vedette_standard.estimators.bootstrap import BootstrapParticles
from vedette_standard.estimators.cubature import CubatureKalman
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.gaussian_sum import GaussianSum
from vedette_standard.estimators.imm import Imm
from vedette_standard.estimators.iterated import IteratedExtendedKalman
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.estimators.square_root import SquareRootKalman
from vedette_standard.estimators.unscented import UnscentedKalman
from vedette_standard.lifecycles.m_of_n import MOfN
from vedette_standard.lifecycles.single_target import SingleTarget
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.coordinated_turn import CoordinatedTurn
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.range_bearing import RangeBearing

ALL = [Kalman, ExtendedKalman, UnscentedKalman, IteratedExtendedKalman, CubatureKalman, SquareRootKalman]
RNG = np.random.default_rng(0)
"""Asked for by the signature; these estimators draw nothing."""


def space(prefix, n):
    return Space.of(**{f"{prefix}{i}": "m" for i in range(n)})


@frozen(eq=False)
class Linear(MotionModel):
    """x' = (I + A dt) x + w, w ~ N(0, C dt)"""

    A: np.ndarray
    C: np.ndarray
    state: Space = field(init=False)
    kind = "test_linear"
    linear = True

    @state.default
    def _state(self):
        return space("x", len(self.A))

    def jacobian(self, x, dt):
        return np.eye(len(self.A)) + self.A * dt

    def move(self, x, dt):
        return x @ self.jacobian(x, dt).T

    def noise(self, x, dt):
        return self.C * dt


@frozen(eq=False)
class Looking(Sensor):
    """z = H x + v, v ~ N(0, R), over the first axes of the state."""

    H: np.ndarray
    R: np.ndarray
    p: float = 1.0
    kind = "test_looking"
    linear = True

    @property
    def observes(self):
        return space("x", self.H.shape[1])

    @property
    def measurement(self):
        return space("z", len(self.H))

    def measure(self, x):
        return x @ self.H.T

    def jacobian(self, x):
        return self.H

    def noise(self, x):
        return self.R

    def detects(self, x):
        return np.asarray(self.p)

    def clutter(self, z):
        return np.asarray(0.02)


@frozen
class Sure(Associator):
    """Whatever came is the target's."""

    kind = "test_sure"

    def associate(self, scores, evidence):
        weights = np.zeros_like(scores)
        weights[..., 1 if scores.shape[-1] > 1 else 0] = 1.0
        return weights


def tracker_of(estimator, sensors, associator=None):
    return Tracker(estimator, sensors, associator or Sure(), SingleTarget())


def states_of(tracker, given, scans, begin=0.0):
    state = tracker.start(given, begin)
    states = [state]
    for scan in scans:
        state = tracker.step(state, scan)
        states.append(state)
    return states


def estimates(tracker, states):
    found = [tracker.estimate(state) for state in states]
    return np.stack([each.mean for each in found]), np.stack([each.cov for each in found])


def random_cov(rng, n, least=0.1):
    a = rng.standard_normal((n, n))
    return a @ a.T + least * np.eye(n)


def random_problem(seed):
    """A linear model and prior, and scans of three sensors: irregular, several at one time, some without a return."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 5))
    motion = Linear(0.5 * rng.standard_normal((n, n)), random_cov(rng, n))
    sensors = {f"s{m}": Looking(rng.standard_normal((m, n)), random_cov(rng, m)) for m in (1, 2, 3)}
    scans, time = [], 0.0
    for _ in range(8):
        time += float(rng.choice([0.0, 0.4, 1.0, rng.random()]))
        name = f"s{rng.integers(1, 4)}"
        m = int(name[1])
        z = np.zeros((0, m)) if rng.random() < 0.25 else 3 * rng.standard_normal((1, m))
        scans.append(Scan(time, name, Detections.of(z, m)))
    return motion, sensors, Gaussian(rng.standard_normal((1, n)), random_cov(rng, n)[None]), scans


def conditioned(motion, sensors, prior, scans, lag=math.inf):
    """Mean (s, n) and cov (s, n, n) at the prior's time and after each scan, given the returns of up to `lag` s later.

    All states as one Gaussian vector, a linear function of the prior and the noises; then the formula of conditioning.
    """
    n, s = prior.mean.shape[-1], len(scans) + 1
    times = [0.0, *(scan.time for scan in scans)]
    gain, mean = [np.eye(n, n * s)], [prior.mean[0]]
    noises = [prior.cov[0]]
    for k in range(1, s):
        dt = times[k] - times[k - 1]
        F = motion.jacobian(mean[-1], dt)
        gain.append(F @ gain[-1] + np.eye(n, n * s, k * n))
        mean.append(F @ mean[-1])
        noises.append(motion.noise(mean[-1], dt))
    gain, mean = np.concatenate(gain), np.concatenate(mean)
    cov = gain @ block_diag(*noises) @ gain.T
    means, covs = [], []
    for k in range(s):
        rows, noise, z = [np.zeros((0, n * s))], [np.zeros((0, 0))], [np.zeros(0)]
        for i, scan in enumerate(scans):
            if scan.detections.z.shape[0] and scan.time <= times[k] + lag:
                sensor = sensors[scan.sensor]
                row = np.zeros((len(sensor.H), n * s))
                row[:, (i + 1) * n : (i + 2) * n] = sensor.H
                rows.append(row)
                noise.append(sensor.R)
                z.append(scan.detections.z[0])
        H, R, z = np.concatenate(rows), block_diag(*noise), np.concatenate(z)
        own = slice(k * n, (k + 1) * n)
        K = np.linalg.solve(H @ cov @ H.T + R, H @ cov[:, own]).T if len(z) else np.zeros((n, 0))
        means.append(mean[own] + K @ (z - H @ mean))
        covs.append(cov[own, own] - K @ H @ cov[:, own])
    return np.array(means), np.array(covs)


def check_exact(kinds=ALL, seeds=range(25)):
    for seed in seeds:
        motion, sensors, prior, scans = random_problem(seed)
        mean, cov = conditioned(motion, sensors, prior, scans)
        scale = np.abs(cov).max()
        for kind in kinds:
            tracker = tracker_of(kind(motion), sensors)
            states = states_of(tracker, prior, scans)
            means, covs = estimates(tracker, smoothed(tracker, states))
            np.testing.assert_allclose(means[:, 0], mean, rtol=1e-9, atol=1e-9)
            np.testing.assert_allclose(covs[:, 0], cov, rtol=1e-9, atol=1e-9 * max(scale, 1.0))
            _, before = estimates(tracker, states)
            np.testing.assert_array_equal(covs, np.swapaxes(covs, -1, -2))
            assert np.linalg.eigvalsh(covs).min() > 0
            assert np.linalg.eigvalsh(before - covs).min() > -1e-9 * scale


def test_on_linear_problems_it_is_the_joint_gaussians_conditional_and_never_less_certain_than_the_filter():
    check_exact()


REAL = {"smooth_step": backward.smooth_step, "future": unmixing.future, "foreseen": unmixing.foreseen}


@pytest.mark.parametrize(
    "mutant",
    [
        lambda P, ahead, cross, step, later: REAL["smooth_step"](P, ahead, np.swapaxes(cross, -1, -2), step, later),
        lambda P, ahead, cross, step, later: REAL["smooth_step"](P, ahead, cross, 0.99 * step, later),
        lambda P, ahead, cross, step, later: REAL["smooth_step"](P, ahead, cross, step, ahead),
        lambda P, ahead, cross, step, later: (REAL["smooth_step"](P, ahead, cross, step, later)[0], P),
        lambda P, ahead, cross, step, later: (0 * step, P),
    ],
    ids=["transposed", "short step", "nothing learnt of the covariance", "filter's covariance", "filter"],
)
def test_the_comparison_finds_a_wrong_step_back(monkeypatch, mutant):
    monkeypatch.setattr(backward, "smooth_step", mutant)
    with pytest.raises(AssertionError):
        check_exact([Kalman])


@pytest.mark.parametrize("kind", [ExtendedKalman, UnscentedKalman])
def test_the_comparison_finds_a_wrong_cross_covariance(monkeypatch, kind):
    real = kind.cross_covariance
    monkeypatch.setattr(kind, "cross_covariance", lambda self, belief, dt: real(self, belief, 0.9 * dt))
    with pytest.raises(AssertionError):
        check_exact([kind])


def test_a_gaussian_sum_is_the_mixture_of_its_parts_own_conditionals():
    """Parts never switch: each is smoothed alone, and weighs what all scans leave it."""
    motion, sensors, prior, scans = random_problem(6)
    estimator = GaussianSum(Kalman(motion), parts=3)
    tracker = tracker_of(estimator, sensors)
    states = states_of(tracker, prior, scans)
    found = estimates(tracker, smoothed(tracker, states))
    start = states[0].belief
    parts = [conditioned(motion, sensors, part, scans) for part in start.beliefs]
    weights = estimator.mode_prob(states[-1].belief)[0]
    means, covs = np.stack([part[0] for part in parts]), np.stack([part[1] for part in parts])
    mean = np.einsum("q,qkn->kn", weights, means)
    apart = means - mean
    cov = np.einsum("q,qkab->kab", weights, covs + apart[..., :, None] * apart[..., None, :])
    np.testing.assert_allclose(found[0][:, 0], mean, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(found[1][:, 0], cov, rtol=1e-8, atol=1e-9)


def check_lag(lag, seeds=range(8)):
    for seed in seeds:
        motion, sensors, prior, scans = random_problem(seed)
        tracker = tracker_of(Kalman(motion), sensors)
        states = states_of(tracker, prior, scans)
        means, covs = estimates(tracker, smoothed(tracker, states, lag))
        mean, cov = conditioned(motion, sensors, prior, scans, lag)
        np.testing.assert_allclose(means[:, 0], mean, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(covs[:, 0], cov, rtol=1e-9, atol=1e-9 * max(np.abs(cov).max(), 1.0))


@pytest.mark.parametrize("lag", [0.0, 0.7, 1.5, 4.0])
def test_a_fixed_lag_is_conditioning_on_the_scans_inside_it(lag):
    """Lag 0 still joins the scans of one moment."""
    check_lag(lag)


def test_a_lag_of_the_whole_span_or_more_is_the_whole_recording():
    motion, sensors, prior, scans = random_problem(3)
    tracker = tracker_of(UnscentedKalman(motion), sensors)
    states = states_of(tracker, prior, scans)
    for one, other in zip(smoothed(tracker, states, scans[-1].time), smoothed(tracker, states), strict=True):
        np.testing.assert_array_equal(one.belief.mean, other.belief.mean)
        np.testing.assert_array_equal(one.belief.cov, other.belief.cov)


def test_a_state_comes_back_as_soon_as_its_lag_is_over():
    tracker = tracker_of(Kalman(Linear(np.zeros((1, 1)), np.eye(1))), {"s": Looking(np.eye(1), np.eye(1))})
    scans = [Scan(float(time), "s", Detections.of([[1.0]])) for time in range(1, 7)]
    states = states_of(tracker, Gaussian(np.zeros((1, 1)), np.ones((1, 1, 1))), scans)
    read = []

    def live():
        for state in states:
            read.append(state.time)
            yield state

    seen = [(state.time, read[-1]) for state in smoothed(tracker, live(), 2.0)]
    assert seen == [(0, 3), (1, 4), (2, 5), (3, 6), (4, 6), (5, 6), (6, 6)]


TURN = CoordinatedTurn(sigma_accel=0.5, sigma_turn_rate=0.05)
RADAR = RangeBearing(sigma_range=5.0, sigma_bearing=0.01, detection_probability=0.8, clutter_per_scan=3.0, max_range=3e3)
UNLIKE = Imm(
    (ExtendedKalman(ConstantVelocity(0.2)), UnscentedKalman(TURN)),
    transition=[[0.9, 0.1], [0.2, 0.8]],
    absent={"turn_rate": (0.0, 0.02)},
)


def turning(rng, runs, count):
    """States (runs, count, 5), the scans of them all (batched), and the prior."""
    mean = np.array([800.0, 500.0, 5.0, 3.0, 0.03])
    cov = np.diag([20.0, 20.0, 1.0, 1.0, 0.02]) ** 2
    x0 = rng.multivariate_normal(mean, cov, size=runs)
    times = np.cumsum(rng.choice([0.0, 1.0, 2.5], size=count))
    truth = draw_states(TURN, x0, np.concatenate([[-1.0], times]), rng)[:, 1:]
    noise = rng.standard_normal((runs, count, 2)) * [5.0, 0.01]
    z = RADAR.measurement.displace(RADAR.measure(truth[..., RADAR_AXES]), noise)
    z = np.stack([z, RADAR.measurement.displace(z, 4 * rng.standard_normal(z.shape) * [5.0, 0.01])], axis=-2)
    valid = rng.random((runs, count, 2)) < [0.8, 0.3]
    scans = [Scan(time, "radar", Detections(z[:, k], valid[:, k])) for k, time in enumerate(times)]
    return truth, scans, Gaussian(np.broadcast_to(mean, (runs, 1, 5)), np.broadcast_to(cov, (runs, 1, 5, 5)))


RADAR_AXES = TURN.state.locate(RADAR.observes)


@pytest.mark.parametrize("estimator", [ExtendedKalman(TURN), UnscentedKalman(TURN), UNLIKE], ids=lambda e: e.kind)
def test_runs_in_lock_step_are_those_runs_alone(estimator):
    _, scans, prior = turning(np.random.default_rng(1), 3, 12)
    tracker = tracker_of(estimator, {"radar": RADAR}, Pda())
    means, covs = estimates(tracker, smoothed(tracker, states_of(tracker, prior, scans, -1.0), 9.0))
    assert np.isfinite(means).all()
    assert np.linalg.eigvalsh(covs).min() > 0
    for run in range(3):
        own = [evolve(scan, detections=trees.take(scan.detections, run, 0)) for scan in scans]
        alone = states_of(tracker, Gaussian(prior.mean[run], prior.cov[run]), own, -1.0)
        mean, cov = estimates(tracker, smoothed(tracker, alone, 9.0))
        np.testing.assert_allclose(means[:, run], mean, rtol=1e-12, atol=1e-10)
        np.testing.assert_allclose(covs[:, run], cov, rtol=1e-10, atol=1e-10)


def check_one_mode():
    """Two returns to either side of the target in each scan: either may be its own."""
    _, scans, prior = turning(np.random.default_rng(2), 5, 8)
    aside = np.array([[12.0, 0.03], [-12.0, -0.03]])
    both = [Detections(scan.detections.z[:, :1] + aside, np.ones((5, 2), dtype=bool)) for scan in scans]
    scans = [evolve(scan, detections=seen) for scan, seen in zip(scans, both, strict=True)]
    found = []
    for estimator in (ExtendedKalman(TURN), Imm((ExtendedKalman(TURN),), transition=[[1.0]])):
        tracker = tracker_of(estimator, {"radar": RADAR}, Pda())
        states = states_of(tracker, prior, scans, -1.0)
        found.append(estimates(tracker, smoothed(tracker, states)))
    np.testing.assert_allclose(found[1][0], found[0][0], rtol=1e-8, atol=1e-7)
    np.testing.assert_allclose(found[1][1], found[0][1], rtol=1e-7, atol=1e-6)


def test_one_mode_is_that_modes_own_smoothing_in_clutter_too():
    """There the belief after an ambiguous scan is at times wider than before, and no likelihood says so."""
    check_one_mode()


def test_the_comparison_needs_the_wider_belief(monkeypatch):
    monkeypatch.setattr(
        imm_module,
        "future",
        lambda *given: evolve(REAL["future"](*given), growth=np.ones_like(REAL["future"](*given).growth)),
    )
    with pytest.raises(AssertionError):
        check_one_mode()


POSITION = Looking(np.array([[1.0, 0.0]]), np.eye(1))
STRAIGHT = np.array([[0.0, 1.0], [0.0, 0.0]])
WHITE = np.array([[1 / 3, 1 / 2], [1 / 2, 1.0]])
CASES = {
    "unlike noise": (Linear(STRAIGHT, 0.01 * WHITE), Linear(STRAIGHT, 4.0 * WHITE), np.array([[0.9, 0.1], [0.2, 0.8]])),
    "brakes": (
        Linear(STRAIGHT, 0.02 * WHITE),
        Linear(np.array([[0.0, 1.0], [0.0, -0.7]]), 0.02 * WHITE),
        np.array([[0.8, 0.2], [0.2, 0.8]]),
    ),
}


def enumerated(models, transition, sensor, prior, dts, zs):
    """Smoothed moments of jump-Markov models over every sequence of modes; zs (runs, s, m), NaN where nothing came.

    A Kalman filter and its step back for each sequence, weighed by its prior and likelihood. Mean (runs, 1+s, n), cov,
    and the probability of each mode after each step (runs, s, r).
    """
    r, s = len(models), len(dts)
    sequences = np.array(list(itertools.product(range(r), repeat=s)))
    start = np.full(r, 1 / r) @ transition
    log_w = np.log(start[sequences[:, 0]]) + np.log(transition[sequences[:, :-1], sequences[:, 1:]]).sum(axis=1)
    runs, n = len(zs), prior.mean.shape[-1]
    m = np.broadcast_to(prior.mean[0], (runs, len(sequences), n))
    P = np.broadcast_to(prior.cov[0], (runs, len(sequences), n, n))
    log_w = np.broadcast_to(log_w, (runs, len(sequences)))
    kept, H = [(m, P)], sensor.H
    ahead = []
    for k, dt in enumerate(dts):
        F = np.stack([model.jacobian(None, dt) for model in models])[sequences[:, k]]
        Q = np.stack([model.noise(None, dt) for model in models])[sequences[:, k]]
        m, P = (F @ m[..., None])[..., 0], F @ P @ np.swapaxes(F, -1, -2) + Q
        ahead.append((F, m, P))
        seen = np.isfinite(zs[:, k, 0])[:, None]
        S = H @ P @ H.T + sensor.R
        nu = np.where(seen[..., None], zs[:, None, k] - m @ H.T, 0.0)
        K = P @ H.T @ np.linalg.inv(S) * seen[..., None, None]
        step = (np.linalg.inv(S) @ nu[..., None])[..., 0]
        log_w = log_w - 0.5 * (np.sum(nu * step, -1) + np.linalg.slogdet(2 * np.pi * S)[1]) * seen
        m, P = m + (K @ nu[..., None])[..., 0], P - K @ H @ P
        kept.append((m, P))
    ms, Ps = [m], [P]
    for (F, a, A), (m, P) in zip(ahead[::-1], kept[-2::-1], strict=True):
        G = P @ np.swapaxes(F, -1, -2) @ np.linalg.inv(A)
        ms.append(m + (G @ (ms[-1] - a)[..., None])[..., 0])
        Ps.append(P + G @ (Ps[-1] - A) @ np.swapaxes(G, -1, -2))
    w = np.exp(log_w - np.logaddexp.reduce(log_w, axis=1, keepdims=True))
    ms, Ps = np.stack(ms[::-1], axis=2), np.stack(Ps[::-1], axis=2)
    mean = np.einsum("rq,rqkn->rkn", w, ms)
    apart = ms - mean[:, None]
    cov = np.einsum("rq,rqkab->rkab", w, Ps + apart[..., :, None] * apart[..., None, :])
    prob = np.stack([np.einsum("rq,qk->rk", w, sequences == j) for j in range(r)], axis=-1)
    return mean, cov, prob


def smoothed_imm(imm, sensor, prior, dts, zs):
    """Filtered and smoothed estimates (runs, 1+s, n), their covariances, and smoothed mode probabilities (runs, s, r)."""
    runs = len(zs)
    tracker = tracker_of(imm, {"s": sensor})
    given = Gaussian(
        np.broadcast_to(prior.mean, (runs, *prior.mean.shape)), np.broadcast_to(prior.cov, (runs, *prior.cov.shape))
    )
    state, time = tracker.start(given, 0.0), 0.0
    states = [state]
    for k, dt in enumerate(dts):
        time += dt
        seen = np.isfinite(zs[:, k, :1])
        # What did not come is a miss of each run alone: weight on column 0.
        moved = imm.predict(state.belief, dt, RNG)
        innovation = imm.evaluate(moved, sensor, Detections(np.nan_to_num(zs[:, k, None]), seen), 1.0)
        weights = np.stack([1.0 - seen, 1.0 * seen], axis=-1)
        state = evolve(state, time=time, belief=imm.update(moved, innovation, weights))
        states.append(state)
    before, _ = estimates(tracker, states)
    after = list(smoothed(tracker, states))
    mean, cov = estimates(tracker, after)
    prob = np.stack([imm.mode_prob(each.belief)[:, 0] for each in after[1:]], axis=1)
    return np.moveaxis(before[:, :, 0], 0, 1), np.moveaxis(mean[:, :, 0], 0, 1), np.moveaxis(cov[:, :, 0], 0, 1), prob


def drawn(models, transition, sensor, prior, dts, runs, seed, missed=0.15):
    rng = np.random.default_rng(seed)
    x0 = rng.multivariate_normal(prior.mean[0], prior.cov[0], size=runs)
    times = np.concatenate([[0.0], np.cumsum(dts)])
    _, truth = draw_jump_markov(models, transition, x0, rng.integers(len(models), size=runs), times, rng)
    zs = truth[:, 1:] @ sensor.H.T + rng.multivariate_normal(np.zeros(len(sensor.R)), sensor.R, size=(runs, len(dts)))
    zs[rng.random(zs.shape[:-1]) < missed] = np.nan
    return truth, zs


PRIOR = Gaussian(np.zeros((1, 2)), 4.0 * np.eye(2)[None])
SEEN = Looking(np.array([[1.0, 0.0]]), np.eye(1), p=0.5)
"""With p = 1/2 a miss says the same in every mode, as does a return: the modes' P_D is one."""


@pytest.mark.parametrize("case", CASES)
def test_one_scan_after_a_common_prior_it_is_the_exact_mixture(case):
    *models, transition = CASES[case]
    _, zs = drawn(models, transition, SEEN, PRIOR, [1.3], 6, 1, missed=0.0)
    imm = Imm(tuple(Kalman(model) for model in models), transition=transition)
    _, mean, cov, prob = smoothed_imm(imm, SEEN, PRIOR, [1.3], zs)
    expected = enumerated(models, transition, SEEN, PRIOR, [1.3], zs)
    for found, exact in zip((mean, cov, prob), expected, strict=True):
        np.testing.assert_allclose(found, exact, rtol=1e-9, atol=1e-10)


def check_near_enumeration(case):
    """The means' squared distance in units of the exact covariance, the covariances' ratio, the probabilities' error."""
    *models, transition = CASES[case]
    dts = [1.0, 0.7, 1.0, 1.5, 1.0, 0.5]
    _, zs = drawn(models, transition, SEEN, PRIOR, dts, 100, 2)
    imm = Imm(tuple(Kalman(model) for model in models), transition=transition)
    _, mean, cov, prob = smoothed_imm(imm, SEEN, PRIOR, dts, zs)
    exact_mean, exact_cov, exact_prob = enumerated(models, transition, SEEN, PRIOR, dts, zs)
    apart = mean - exact_mean
    distance = np.mean(np.sum(apart * np.linalg.solve(exact_cov, apart[..., None])[..., 0], -1)) / 2
    ratio = np.mean(np.trace(np.linalg.solve(exact_cov, cov), axis1=-2, axis2=-1)) / 2
    wrong = np.mean(np.abs(prob - exact_prob))
    assert distance < 0.03
    assert abs(ratio - 1) < 0.1
    assert wrong < 0.05


@pytest.mark.parametrize("case", CASES)
def test_on_short_runs_it_is_near_enumeration_of_all_mode_sequences(case):
    check_near_enumeration(case)


def at_the_later_mean(predicted, origin, seen, state):
    """The later belief as it is for every pair, and the pair's density at its mean: what the integral replaces."""
    shift = np.swapaxes(seen.back @ (seen.pull / (1.0 + seen.info))[..., None], -1, -2)[..., 0, :]
    mean = np.broadcast_to(state.displace(origin, shift)[..., None, :], predicted.mean.shape)
    scaled = seen.back * (seen.growth / np.sqrt(1.0 + seen.info))[..., None, :]
    cov = np.broadcast_to((scaled @ np.swapaxes(scaled, -1, -2))[..., None, :, :], predicted.cov.shape)
    apart = state.difference(mean, predicted.mean)
    distance = np.sum(apart * np.linalg.solve(predicted.cov, apart[..., None])[..., 0], -1)
    return Gaussian(mean, cov), -0.5 * (distance + np.linalg.slogdet(predicted.cov)[1])


@pytest.mark.parametrize(
    "mutant",
    [
        lambda *given: (REAL["foreseen"](*given)[0], np.zeros(given[0].mean.shape[:-1])),
        lambda *given: (REAL["foreseen"](*given)[0], -REAL["foreseen"](*given)[1]),
        lambda *given: (given[0], REAL["foreseen"](*given)[1]),
        at_the_later_mean,
    ],
    ids=["no weights", "weights upside down", "nothing learnt", "one point"],
)
def test_the_comparison_with_enumeration_finds_wrong_pairs(monkeypatch, mutant):
    monkeypatch.setattr(imm_module, "foreseen", mutant)
    with pytest.raises(AssertionError):
        check_near_enumeration("unlike noise")


@frozen
class OneAxisVelocity(MotionModel):
    """Position and velocity on a line."""

    q: float
    kind = "test_line_velocity"
    linear = True
    state = space("x", 2)

    def jacobian(self, x, dt):
        return np.array([[1.0, dt], [0.0, 1.0]])

    def move(self, x, dt):
        return x @ self.jacobian(x, dt).T

    def noise(self, x, dt):
        return self.q * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])


@frozen
class OneAxisAcceleration(MotionModel):
    """The same with an acceleration, a random walk."""

    q: float
    kind = "test_line_acceleration"
    linear = True
    state = space("x", 3)

    def jacobian(self, x, dt):
        return np.array([[1.0, dt, dt**2 / 2], [0.0, 1.0, dt], [0.0, 0.0, 1.0]])

    def move(self, x, dt):
        return x @ self.jacobian(x, dt).T

    def noise(self, x, dt):
        g = np.array([[dt**2 / 2], [dt], [1.0]])
        return self.q * g @ g.T + 1e-6 * dt * np.eye(3)


@frozen
class Whole(MotionModel):
    """A model without the last axis, over all axes: that one is drawn anew, as `absent` says."""

    part: MotionModel
    deviation: float
    kind = "test_whole"
    linear = True
    state = space("x", 3)

    def jacobian(self, x, dt):
        return block_diag(self.part.jacobian(x, dt), 0.0)

    def move(self, x, dt):
        return x @ self.jacobian(x, dt).T

    def noise(self, x, dt):
        return block_diag(self.part.noise(x, dt), self.deviation**2)


def check_unlike(dts, distance_below, wrong_below):
    cv, ca, deviation = OneAxisVelocity(0.01), OneAxisAcceleration(0.2), 0.8
    transition = np.array([[0.9, 0.1], [0.2, 0.8]])
    sensor = Looking(np.array([[1.0, 0.0, 0.0]]), 0.25 * np.eye(1), p=0.5)
    prior = Gaussian(np.zeros((1, 3)), np.diag([4.0, 4.0, deviation**2])[None])
    models = (Whole(cv, deviation), ca)
    _, zs = drawn(models, transition, sensor, prior, dts, 100, 3)
    imm = Imm((Kalman(cv), Kalman(ca)), transition=transition, absent={"x2": (0.0, deviation)})
    imm_sensor = Looking(np.array([[1.0]]), sensor.R, p=0.5)
    _, mean, _, prob = smoothed_imm(imm, imm_sensor, prior, dts, zs)
    exact_mean, exact_cov, exact_prob = enumerated(models, transition, sensor, prior, dts, zs)
    # A mode that lacks the axis has it as `absent` in the mixture, so only the shared axes are compared.
    apart, own = (mean - exact_mean)[..., :2], exact_cov[..., :2, :2]
    distance = np.mean(np.sum(apart * np.linalg.solve(own, apart[..., None])[..., 0], -1)) / 2
    assert distance < distance_below
    assert np.mean(np.abs(prob - exact_prob)) < wrong_below


def test_modes_of_unlike_states_equal_enumeration_with_the_absent_axis_drawn_anew():
    check_unlike([1.3], 1e-16, 1e-9)
    check_unlike([1.0, 0.7, 1.0, 1.5, 1.0, 0.5], 0.01, 0.03)


def matched(estimator, models, transition, prior, runs, count, seed):
    """Mean squared position errors (runs,) of filter and smoother, and the smoother's NEES (runs,), on matched truth."""
    sensor = Looking(np.array([[1.0, 0.0]]), 4.0 * np.eye(1), p=0.5)
    dts = np.tile([1.0, 0.5, 2.0, 1.0], count // 4)
    truth, zs = drawn(models, transition, sensor, prior, dts, runs, seed)
    before, mean, cov, _ = smoothed_imm(estimator, sensor, prior, dts, zs)
    error = mean - truth
    nees = np.sum(error * np.linalg.solve(cov, error[..., None])[..., 0], -1)
    errors = [np.mean((found - truth)[:, 1:, 0] ** 2, axis=1) for found in (before, mean)]
    return (*errors, np.mean(nees[:, 1:], axis=1))


def test_on_jump_markov_truth_the_imm_gains_and_its_covariance_stays_right():
    """The gain is judged on differences within a run, the NEES on run means; both with the run as the unit.

    False alarms: six standard errors of 300 runs, about 2e-9 each.
    """
    *models, transition = CASES["unlike noise"]
    imm = Imm(tuple(Kalman(model) for model in models), transition=transition)
    before, after, nees = matched(imm, models, transition, PRIOR, 300, 40, 5)
    gain = before - after
    error = np.std(gain, ddof=1) / np.sqrt(len(gain))
    assert np.mean(gain) > 0.5 * np.mean(before) - 6 * error
    assert np.mean(gain) > 6 * error
    assert abs(np.mean(nees) / 2 - 1) < 0.1 + 6 * np.std(nees / 2, ddof=1) / np.sqrt(len(nees))


@pytest.mark.parametrize("kind", [ExtendedKalman, UnscentedKalman])
def test_on_a_mildly_nonlinear_problem_errors_are_as_large_as_said(kind):
    """NEES over runs at one time in the middle: chi-square's band at 1e-6, widened by a tenth for what is not linear."""
    runs = 400
    truth, scans, prior = turning(np.random.default_rng(6), runs, 13)
    scans = [evolve(scan, detections=Detections(scan.detections.z[:, :1], scan.detections.valid[:, :1])) for scan in scans]
    tracker = tracker_of(kind(TURN), {"radar": RADAR}, FirstOfEach())
    states = states_of(tracker, prior, scans, -1.0)
    mean, cov = estimates(tracker, smoothed(tracker, states))
    k = 6
    error = mean[k + 1, :, 0] - truth[:, k]
    nees = np.sum(error * np.linalg.solve(cov[k + 1, :, 0], error[..., None])[..., 0], -1)
    low, high = stats.chi2.ppf([5e-7, 1 - 5e-7], 5 * runs) / (5 * runs)
    assert 0.9 * low < np.mean(nees) / 5 < 1.1 * high


@frozen
class FirstOfEach(Associator):
    """The first return where it is valid, else the miss."""

    kind = "test_first"

    def associate(self, scores, evidence):
        seen = np.isfinite(scores[..., 1])
        return np.stack([~seen, seen], axis=-1).astype(float)


def test_tracks_keep_all_but_their_estimates_and_end_and_begin_where_they_did():
    """Two ships far apart, one of which comes late and leaves early, and clutter that starts tracks."""
    rng = np.random.default_rng(7)
    sensor = CartesianPosition(sigma=2.0, detection_probability=0.9, clutter_density=1e-7)
    tracker = Tracker(
        Kalman(ConstantVelocity(0.3)),
        {"radar": sensor},
        Pda(),
        MOfN(hits=2, looks=3, misses=2, spread={"vx": 5.0, "vy": 5.0}),
    )
    state, states, scans = tracker.start(), [], []
    for k in range(20):
        ships = [[10.0 + 4.0 * k, 5.0]] + ([[5000.0, 3.0 * k]] if 4 <= k < 12 else [])
        clutter = rng.uniform(-2e4, 2e4, size=(1, 2))
        scans.append(
            Scan(
                float(k),
                "radar",
                Detections.of(np.concatenate([ships + 2.0 * rng.standard_normal((len(ships), 2)), clutter])),
            )
        )
        state = tracker.step(state, scans[-1])
        states.append(state)
    assert any(set(one.ids) - set(other.ids) for one, other in itertools.pairwise(states))
    filtered = smooth(tracker, states, 0.0)
    found = smooth(tracker, states)
    assert [track.id for track in found] == [track.id for track in filtered]
    assert len(found) == 2
    assert len(found[1].times) < len(found[0].times) == 20
    for one, other in zip(found, filtered, strict=True):
        for name in ("times", "confirmed", "existence", "nis", "hit"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
        for weights, same in zip(one.weights, other.weights, strict=True):
            np.testing.assert_array_equal(weights, same)
        np.testing.assert_array_equal(one.mean[-1], other.mean[-1])
        assert np.all(np.any(one.mean[:-3] != other.mean[:-3], axis=1))
        # The same track smoothed as if there were no other.
        alone = [
            evolve(
                each,
                **{
                    name: trees.take(getattr(each, name), each.ids == one.id, 0)
                    for name in ("belief", "memory", "ids", "existence", "confirmed", "weights", "distances")
                },
            )
            for each in states
            if one.id in each.ids
        ]
        own = smooth(tracker, alone)[0]
        np.testing.assert_allclose(own.mean, one.mean, rtol=1e-12)
        np.testing.assert_allclose(own.cov, one.cov, rtol=1e-12, atol=1e-12)


@frozen
class Heading(MotionModel):
    """A heading that wanders, and a mark that is zero_variance: it turns by .1 rad/s without noise."""

    kind = "test_heading"
    state = Space.of(heading="rad mod 2pi", mark="rad mod 2pi")
    zero_variance = Space.of(mark="rad mod 2pi")

    def move(self, x, dt):
        return self.state.displace(x, np.array([0.0, 0.1 * dt]))

    def noise(self, x, dt):
        return np.diag([0.01 * dt, 0.0])


@frozen
class Compass(Sensor):
    """The heading."""

    kind = "test_compass"
    observes = Space.of(heading="rad mod 2pi")
    measurement = Space.of(compass="rad mod 2pi")

    def measure(self, x):
        return x

    def noise(self, x):
        return 0.05 * np.eye(1)

    def detects(self, x):
        return np.asarray(0.9)

    def clutter(self, z):
        return np.asarray(0.01)


@pytest.mark.parametrize(
    "estimator",
    [
        ExtendedKalman(Heading()),
        UnscentedKalman(Heading()),
        Imm((ExtendedKalman(Heading()), UnscentedKalman(Heading())), transition=[[0.9, 0.1], [0.1, 0.9]]),
    ],
    ids=lambda e: e.kind,
)
def test_a_turn_of_all_angles_turns_the_result_and_carried_axes_stay(estimator):
    def run(turn):
        given = Gaussian(estimator.state.displace(np.array([[turn, 1.0]]), np.zeros((1, 2))), np.diag([0.2, 0.0])[None])
        tracker = tracker_of(estimator, {"compass": Compass()}, Pda())
        zs = 0.1 * np.random.default_rng(8).standard_normal(9) + turn
        scans = [Scan(1.0 + k, "compass", Detections.of([[z]])) for k, z in enumerate(zs)]
        return estimates(tracker, smoothed(tracker, states_of(tracker, given, scans)))

    mean, cov = run(0.0)
    turned, same = run(np.pi)
    apart = estimator.state.difference(turned, mean)[:, 0]
    np.testing.assert_allclose(np.abs(apart[:, 0]), np.pi, atol=1e-9)
    np.testing.assert_allclose(apart[:, 1], 0.0, atol=1e-9)
    np.testing.assert_allclose(same, cov, atol=1e-12)
    assert np.abs(mean[:, 0, 0]).max() < 0.5
    np.testing.assert_allclose(mean[:, 0, 1], 1.0 + 0.1 * np.arange(10), atol=1e-12)
    np.testing.assert_array_equal(cov[..., 1, :], 0.0)


def test_a_noiseless_model_is_smoothed_too():
    """The predicted covariance is then singular after a start from what is known: nothing moves, nothing is NaN."""
    motion = Linear(np.array([[0.0, 1.0], [0.0, 0.0]]), np.zeros((2, 2)))
    tracker = tracker_of(UnscentedKalman(motion), {"s": POSITION})
    prior = Gaussian(np.array([[1.0, 2.0]]), np.diag([1.0, 0.0])[None])
    scans = [Scan(float(k), "s", Detections.of([[3.0 * k]])) for k in range(1, 6)]
    mean, cov = estimates(tracker, smoothed(tracker, states_of(tracker, prior, scans)))
    np.testing.assert_allclose(mean[:, 0, 1], 2.0, atol=1e-9)
    np.testing.assert_allclose(cov[:, 0], np.broadcast_to(np.diag([1 / 6, 0.0]), (6, 2, 2)), atol=1e-9)


def test_a_mode_that_cannot_be_and_one_that_cannot_be_reached_do_no_harm():
    modes = tuple(Kalman(model) for model in CASES["unlike noise"][:2])
    tracker = tracker_of(Imm(modes, transition=[[1.0, 0.0], [1.0, 0.0]]), {"s": SEEN})
    plain = tracker_of(modes[0], {"s": SEEN})
    scans = [Scan(float(k), "s", Detections.of([[0.5 * k]])) for k in range(1, 6)]
    found = estimates(tracker, smoothed(tracker, states_of(tracker, PRIOR, scans)))
    expected = estimates(plain, smoothed(plain, states_of(plain, PRIOR, scans)))
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9)


@frozen
class Silent(Estimator):
    """A Kalman filter that does not state its cross-covariance, as a third party's may."""

    inner: Kalman
    kind = "test_silent"

    @property
    def state(self):
        return self.inner.state

    def start(self, prior, axes, rng):
        return self.inner.start(prior, axes, rng)

    def predict(self, belief, dt, rng, combined=None):
        return self.inner.predict(belief, dt, rng, combined)

    def evaluate(self, belief, sensor, seen, p_gate):
        return self.inner.evaluate(belief, sensor, seen, p_gate)

    def update(self, belief, innovation, weights):
        return self.inner.update(belief, innovation, weights)

    def moments(self, belief):
        return self.inner.moments(belief)


@frozen
class Stating(Silent):
    """The same with the one method that smoothing asks for."""

    kind = "test_stating"

    def cross_covariance(self, belief, dt):
        return belief.cov @ self.inner.motion.jacobian(belief.mean, dt).T


def test_one_method_makes_a_third_partys_filter_smooth():
    motion, sensors, prior, scans = random_problem(4)
    tracker = tracker_of(Stating(Kalman(motion)), sensors)
    check_smoothing(tracker)
    mean, _ = estimates(tracker, smoothed(tracker, states_of(tracker, prior, scans)))
    np.testing.assert_allclose(mean[:, 0], conditioned(motion, sensors, prior, scans)[0], rtol=1e-9, atol=1e-9)


class Turning(Linear):
    kind = "test_turning"

    def reframe(self, own, combined):
        return own


def test_what_cannot_be_smoothed_is_told_with_its_place():
    motion, sensors, prior, scans = random_problem(4)
    silent = tracker_of(Silent(Kalman(motion)), sensors)
    with pytest.raises(ConfigError, match="estimator: cannot smooth: 'test_silent' does not state how"):
        check_smoothing(silent)
    with pytest.raises(ConfigError, match="estimator: cannot smooth: 'bootstrap"):
        check_smoothing(tracker_of(BootstrapParticles(motion), sensors))
    for kind in (ExtendedKalman, UnscentedKalman, SquareRootKalman):
        with pytest.raises(ConfigError, match="motion 'test_turning' turns its frame"):
            check_smoothing(tracker_of(kind(Turning(motion.A, motion.C)), sensors))
    tracker = tracker_of(Kalman(motion), sensors)
    states = states_of(tracker, prior, scans)
    for lag in (-1.0, math.nan):
        with pytest.raises(ValueError, match="lag: must be >= 0 s, got"):
            smooth(tracker, states, lag)
    with pytest.raises(ValueError, match="states: times must not go backwards"):
        smooth(tracker, states[::-1])
    assert smooth(tracker, []) == ()


def config(tmp_path):
    """A line of returns in a file, and a tracker for them."""
    rng = np.random.default_rng(9)
    rows = [f"{k},{k},{3.0 * k + rng.normal():.6f},{rng.normal():.6f}" for k in range(30)]
    (tmp_path / "returns.csv").write_text("\n".join(["scan,time,x,y", *rows]) + "\n")
    (tmp_path / "truth.csv").write_text("\n".join(["time,x,y", *(f"{k},{3.0 * k},0" for k in range(30))]) + "\n")
    data = {
        "source": {
            "kind": "csv",
            "path": str(tmp_path),
            "detections": {"file": "returns.csv", "time": "time", "scan": "scan", "columns": {"x": "x", "y": "y"}},
            "truth": {"file": "truth.csv", "time": "time", "columns": {"x": "x", "y": "y"}},
        },
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.1}},
        "sensors": {"radar": {"kind": "cartesian_position", "sigma": 1.0, "detection_probability": 0.9}},
        "associator": {"kind": "gnn"},
        "lifecycle": {"kind": "m_of_n", "spread": {"vx": 5.0, "vy": 5.0}},
    }
    path = tmp_path / "line.json"
    path.write_text(json.dumps(data))
    return path


def test_the_command_writes_smoothed_tracks_beside_the_filters_and_both_figures(tmp_path, capsys):
    path = config(tmp_path)
    assert main(["run", str(path), "--out", str(tmp_path / "plain"), "--json"]) == 0
    plain = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert main(["run", str(path), "--out", str(tmp_path / "both"), "--json", "--smooth"]) == 0
    found = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert found["position_rmse_m"] == plain["position_rmse_m"]
    assert found["smoothed"]["lag_s"] is None
    assert found["smoothed"]["position_rmse_m"] < 0.8 * found["position_rmse_m"]
    for name in ("tracks.csv", "tracks.jsonl"):
        assert (tmp_path / "both" / name).read_bytes() == (tmp_path / "plain" / name).read_bytes()
    experiment = vedette.load(path)
    result = experiment.run(keep_states=True)
    (track,) = vedette.smooth(experiment.tracker, result.states)
    (written,) = read_tracks(tmp_path / "both" / "smoothed.jsonl")
    np.testing.assert_array_equal(written.mean, track.mean)
    np.testing.assert_array_equal(written.cov, track.cov)
    assert "Smoothed by all later scans" in (tmp_path / "both" / "summary.txt").read_text()
    assert main(["run", str(path), "--out", str(tmp_path / "lag"), "--json", "--smooth", "0.05 min"]) == 0
    lagged = json.loads(capsys.readouterr().out.splitlines()[-1])["smoothed"]
    assert lagged["lag_s"] == 3.0
    assert found["smoothed"]["position_rmse_m"] < lagged["position_rmse_m"] < found["position_rmse_m"]


@pytest.mark.parametrize("lag", ["-1", "3 m", "soon", "inf"])
def test_the_command_refuses_a_wrong_lag_before_it_writes(tmp_path, capsys, lag):
    assert main(["run", str(config(tmp_path)), "--out", str(tmp_path / "out"), f"--smooth={lag}"]) == 2
    assert "--smooth: must be" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_the_example_runs_and_each_later_scan_helps(capsys):
    runpy.run_path(str(Path(__file__).parent.parent.parent / "examples" / "smooth.py"))
    told = [float(line.split("RMSE")[1].split()[0]) for line in capsys.readouterr().out.splitlines()]
    assert len(told) == 3
    assert told[0] > told[1] > told[2]


def test_on_recorded_radar_data_smoothing_lowers_the_error():
    """joyride, one given target, as docs/smoothing.md tells it."""
    folder = Path(os.environ.get("VEDETTE_DATA", "")) / "joyride"
    if "VEDETTE_DATA" not in os.environ or not folder.is_dir():
        pytest.skip("needs the recording joyride in the folder that VEDETTE_DATA names")
    experiment = vedette.load(
        Path(__file__).parent.parent.parent / "examples" / "joyride.toml",
        overrides=[
            f"source.path={folder}",
            "lifecycle.kind=single_target",
            "lifecycle.offset.x=10.0",
            "judge.last_scan=211",
            "judge.offset=[-4.0, 8.0]",
        ],
    )
    result = experiment.run(keep_states=True)
    found = smooth_result(experiment, result, math.inf).score
    before = smooth_result(experiment, result, 0.0).score
    assert before.position_rmse_m < 21.0
    assert found.position_rmse_m < 18.0
    assert found.velocity_rmse_mps < 0.7 * before.velocity_rmse_mps
