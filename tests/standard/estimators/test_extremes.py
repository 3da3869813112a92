"""Gaps of 1e-9 to 1e8 s and noises of 1e-9 to 1e9: every estimator and motion, and the linear ones against 60 digits."""

import numpy as np
import pytest

import vedette
from support.extremes import ESTIMATORS, MOTIONS, case, power
from vedette import Detections, Gaussian
from vedette.testing.comparisons import covariance
from vedette_standard.estimators.cubature import CubatureKalman
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.fading_memory import FadingMemory
from vedette_standard.estimators.h_infinity import HInfinity
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.estimators.least_squares import LeastSquares
from vedette_standard.estimators.square_root import SquareRootKalman
from vedette_standard.estimators.unscented import UnscentedKalman
from vedette_standard.motion.constant_acceleration import ConstantAcceleration
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.gauss_markov import GaussMarkov
from vedette_standard.motion.ornstein_uhlenbeck import OrnsteinUhlenbeck
from vedette_standard.motion.singer import Singer
from vedette_standard.motion.wiener_acceleration_piecewise import WienerAccelerationPiecewise
from vedette_standard.sensors.linear import LinearSensor


def judged(estimator, motion, seeds):
    """Carry out some cases; return how many were refused at build."""
    return sum(case(estimator, motion, seed) != "held" for seed in seeds)


@pytest.mark.parametrize("estimator", ESTIMATORS)
@pytest.mark.by_turns
def test_every_estimator_stays_whole_with_every_motion(estimator):
    for motion in MOTIONS:
        judged(estimator, motion, range(1))


@pytest.mark.nightly("thousands of cases")
@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_every_estimator_stays_whole_in_many_cases(estimator):
    for motion in MOTIONS:
        refused = judged(estimator, motion, range(100, 140))
        assert refused in (0, 40), f"{estimator} with {motion}: refuses some numbers, not the pair"


mpmath = pytest.importorskip("mpmath")
EXACT = {
    "constant_velocity": lambda rng: ConstantVelocity(power(rng), axes=("x",)),
    "constant_acceleration": lambda rng: ConstantAcceleration(power(rng), axes=("x",)),
    "gauss_markov": lambda rng: GaussMarkov(("x",), power(rng), power(rng)),
    "ornstein_uhlenbeck": lambda rng: OrnsteinUhlenbeck(power(rng), power(rng), axes=("x",)),
    "singer": lambda rng: Singer(power(rng), power(rng), axes=("x",)),
}


def in_many_digits(F, Q, x, P, z, R):
    """A Kalman filter's step of a state whose first axis is measured, in mpmath's matrices."""
    x, P = F * x, F * P * F.T + Q
    S = P[0, 0] + R
    K = P[:, 0] / S
    return x + K * (z - x[0]), P - K * P[0, :]


@pytest.mark.parametrize("kind", EXACT)
@pytest.mark.parametrize("cls", [Kalman, ExtendedKalman, SquareRootKalman, UnscentedKalman, CubatureKalman])
def test_linear_kinds_have_the_answer_of_many_digits(cls, kind):
    """F and Q are the model's, as stored; all else has 60 digits more than the 16 of the filter. Its error is measured in
    its own deviations and in 1e-6 of those before each return, moved on: less is not in a covariance of 16 digits;
    that of the mean also in the rounding of what is subtracted from the return.
    """
    for seed in range(12):
        rng = np.random.default_rng([seed, sorted(EXACT).index(kind)])
        estimator = cls(EXACT[kind](rng))
        n, state = len(estimator.state), estimator.state
        sensor = LinearSensor(("x",), [[1.0]])
        deviations = np.full(n, 10.0 ** rng.uniform(-3, 3))
        mean, cov = rng.normal(size=n) * deviations, np.diag(deviations**2)
        doubt, off = np.zeros(n), np.zeros(n)
        with mpmath.workdps(76):
            belief = estimator.start(Gaussian(mean[None], cov[None]), state, rng)
            x, P = mpmath.matrix(mean.tolist()), mpmath.matrix(cov.tolist())
            for _ in range(3):
                dt, sigma = 10.0 ** rng.uniform(-9, 8), power(rng)
                belief = estimator.predict(belief, dt, rng)
                before = estimator.moments(belief)
                z = before.mean[0, 0] + sigma * rng.standard_normal()
                scan = Detections(np.array([[z]]), np.ones(1, bool), None, np.array([[[sigma**2]]]))
                found = estimator.evaluate(belief, sensor, scan, 1.0)
                belief = estimator.update(belief, found, np.array([[0.0, 1.0]]))
                F, Q = estimator.motion.jacobian(mean, dt), estimator.motion.noise(mean, dt)
                parts = (mpmath.matrix(F.tolist()), mpmath.matrix(Q.tolist()))
                gain = np.abs(before.cov[0, :, 0]) / (before.cov[0, 0, 0] + sigma**2)
                doubt = (np.abs(F) @ np.sqrt(doubt)) ** 2 + 1e-12 * np.diagonal(before.cov[0])
                doubt += gain**2 * doubt[0]
                off = np.abs(F) @ off + 1e-14 * (np.abs(before.mean[0]) + gain * np.abs(before.mean[0, 0])) + 1e-300
                x, P = in_many_digits(*parts, x, P, mpmath.mpf(float(z)), mpmath.mpf(float(sigma)) ** 2)
                after = estimator.moments(belief)
                wanted = np.array([[float(P[i, j]) for j in range(n)] for i in range(n)])
                scale = np.sqrt(np.diagonal(wanted) + doubt)
                np.testing.assert_array_less(np.abs(after.cov[0] - wanted) / scale / scale[:, None], 1e-3)
                apart = after.mean[0] - np.array([float(value) for value in x])
                np.testing.assert_array_less(np.abs(apart), 1e-3 * scale + off)


@pytest.mark.parametrize("kind", ["bootstrap_particles", "auxiliary_particles", "ensemble_kalman", "ekf", "iekf", "ukf"])
def test_a_user_may_have_numpy_raise(kind):
    """Weights that underflow are 0 on purpose."""
    tracker = vedette.build(
        {
            "estimator": {"kind": kind, "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
            "sensors": {"s": {"kind": "cartesian_position", "sigma": 5.0, "clutter_density": 1e-6}},
            "associator": {"kind": "nearest"},
            "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
            "lifecycle": {"kind": "m_of_n"},
        }
    )
    state, rng = tracker.start(seed=1), np.random.default_rng(0)
    with np.errstate(all="raise"):
        for k in range(12):
            z = np.concatenate([[[100.0 + 9 * k, 50.0], [-400.0, 9.0 * k]], rng.uniform(-500, 500, (3, 2))])
            state = tracker.step(state, vedette.Scan(2.0 * k, "s", z))
    assert state.confirmed.sum() >= 2


def gap_of_hours(estimator):
    belief = estimator.start(Gaussian(np.zeros((1, 4)), 25.0 * np.eye(4)[None]), estimator.state, np.random.default_rng(0))
    return estimator.moments(estimator.predict(belief, 9000.0, np.random.default_rng(0)))


@pytest.mark.parametrize("estimator", [FadingMemory(ConstantVelocity(0.5), 1.05), LeastSquares(ConstantVelocity(0.5), 0.9)])
def test_a_filter_that_forgets_outlives_a_gap_of_hours(estimator):
    """Alpha = 1.05 over 2.5 h, as a power, is an overflow."""
    variances = np.diagonal(gap_of_hours(estimator).cov[0])
    assert np.isfinite(variances).all()
    assert np.all(variances > 1e20)


@pytest.mark.parametrize("dt", [0.5, 40.0])
def test_over_usual_gaps_it_forgets_as_stated(dt):
    prior = Gaussian(np.zeros((1, 4)), np.diag([4.0, 9.0, 1.0, 2.0])[None])
    rng = np.random.default_rng(0)
    motion = ConstantVelocity(0.5)
    F, Q = motion.jacobian(prior.mean, dt), motion.noise(prior.mean, dt)
    faded = FadingMemory(motion, 1.05, step=2.0)
    ahead = faded.predict(faded.start(prior, motion.state, rng), dt, rng)
    np.testing.assert_allclose(ahead.cov, 1.05**dt * F @ prior.cov @ F.T + Q, rtol=1e-12)
    fitted = LeastSquares(motion, 0.9, step=2.0)
    start = fitted.start(prior, motion.state, rng)
    np.testing.assert_allclose(fitted.moments(fitted.predict(start, dt, rng)).cov, 0.9 ** (-dt / 2) * F @ prior.cov @ F.T)
    np.testing.assert_allclose(fitted.cross_covariance(start, dt), 0.9 ** (-dt / 2) * prior.cov @ F.T)


@pytest.mark.parametrize("kind", [CubatureKalman, UnscentedKalman])
def test_after_a_year_a_precise_return_leaves_a_covariance(kind):
    """Deviations of 1e21 m, of rank one an axis: what the gain leaves of a point is rounding, the same in all its uses."""
    motion, rng = WienerAccelerationPiecewise(0.2), np.random.default_rng(1)
    estimator, state = kind(motion), motion.state
    for dt in 10 ** rng.uniform(6, 8, 40):
        belief = estimator.start(Gaussian(rng.normal(size=(1, 6)), np.eye(6)[None]), state, rng)
        belief = estimator.predict(belief, dt, rng)
        sensor = LinearSensor(("x", "y"), np.diag(10 ** rng.uniform(-2, 6, 2)))
        found = estimator.evaluate(belief, sensor, Detections.of(belief.mean[:, :2]), 1.0)
        after = estimator.update(belief, found, np.array([[0.0, 1.0]]))
        covariance(f"after {dt:.3g} s", after.cov, definite=False)


@pytest.mark.parametrize("sigma", [1e-9, 1e-12])
@pytest.mark.parametrize("kind", [HInfinity, CubatureKalman, UnscentedKalman, ExtendedKalman])
def test_a_perfect_sensor_leaves_no_negative_variance(kind, sigma):
    """`h_infinity` and `iekf` had variances of -1e-15, `ckf` a negative NIS."""
    motion = ConstantVelocity(0.5)
    estimator = kind(motion, 1e-3, {"x": 1.0}) if kind is HInfinity else kind(motion)
    sensor, rng = LinearSensor(("x", "y"), sigma**2 * np.eye(2)), np.random.default_rng(1)
    belief = estimator.start(Gaussian(np.full((1, 4), 1e3), 1e6 * np.eye(4)[None]), motion.state, rng)
    for k in range(20):
        belief = estimator.predict(belief, 1.0, rng)
        z = estimator.moments(belief).mean[:, :2] + (1e3 if not k else 1.0) * rng.standard_normal((1, 2))
        found = estimator.evaluate(belief, sensor, Detections.of(z), 1.0)
        assert np.min(found.nis) >= 0
        belief = estimator.update(belief, found, np.array([[0.0, 1.0]]))
        assert np.min(np.diagonal(estimator.moments(belief).cov[0])) >= 0
