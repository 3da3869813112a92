"""The H-infinity filter, the filters of constant gains, least squares and the ensemble, against the textbooks' own lines."""

import numpy as np
import pytest

import vedette
from vedette import Gaussian
from vedette.config import ConfigError
from vedette_standard.estimators.ensemble import EnsembleKalman
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.g_h import GH
from vedette_standard.estimators.h_infinity import HInfinity
from vedette_standard.estimators.least_squares import LeastSquares
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.range_bearing import RangeBearing

MOTION = ConstantVelocity(0.3)
RNG = np.random.default_rng(0)
BELIEF = Gaussian(np.array([[1.0, 2.0, 3.0, -1.0]]), np.diag([4.0, 9.0, 1.0, 2.0])[None])
SURE = np.array([[0.0, 1.0]])


def test_h_infinity_is_the_textbooks_recursion():
    """P = F P (I - theta S P + H' R^-1 H P)^-1 F' + Q, K = P (I - theta S P + H' R^-1 H P)^-1 H' R^-1."""
    theta, S, H, R = 0.01, np.diag([1.0, 2.0, 0.5, 0.0]), np.eye(2, 4), 4.0 * np.eye(2)
    one = HInfinity(MOTION, theta, {"x": 1.0, "y": 2.0, "vx": 0.5})
    sensor, belief = CartesianPosition(sigma=2.0), BELIEF
    F, Q = MOTION.jacobian(BELIEF.mean, 1.0), MOTION.noise(BELIEF.mean, 1.0)
    x, P = F @ BELIEF.mean[0], F @ BELIEF.cov[0] @ F.T + Q  # before the first return
    for k in range(1, 20):
        z = np.array([3.0 * k, 2.0 - k])
        belief = one.predict(belief, 1.0, RNG)
        belief = one.update(belief, one.evaluate(belief, sensor, vedette.Detections.of([z.tolist()]), 1.0), SURE)
        inner = np.linalg.inv(np.eye(4) - theta * S @ P + H.T @ np.linalg.inv(R) @ H @ P)
        x = x + P @ inner @ H.T @ np.linalg.inv(R) @ (z - H @ x)
        np.testing.assert_allclose(belief.mean[0], x, rtol=1e-9, atol=1e-12)  # one is 0, rounded as the processor does
        np.testing.assert_allclose(belief.cov[0], P @ inner, rtol=1e-9, atol=1e-9)
        x, P = F @ x, F @ P @ inner @ F.T + Q


def test_h_infinity_without_theta_is_the_extended_filter_and_with_too_much_stays_a_covariance():
    plain, bold = (HInfinity(MOTION, theta, {"x": 1.0}).predict(BELIEF, 1.0, RNG) for theta in (0.0, 1e6))
    wanted = ExtendedKalman(MOTION).predict(BELIEF, 1.0, RNG)
    np.testing.assert_allclose(plain.cov, wanted.cov, rtol=1e-9, atol=1e-12)
    assert np.all(np.linalg.eigvalsh(bold.cov[0]) > 0)
    assert wanted.cov[0, 0, 0] < bold.cov[0, 0, 0] < 101 * wanted.cov[0, 0, 0]


def test_a_weight_of_no_axis_is_refused():
    with pytest.raises(ValueError, match=r"weight\.z: there is no such axis"):
        HInfinity(MOTION, 0.1, {"z": 1.0})


def test_the_covariance_of_constant_gains_is_that_of_their_errors():
    """Over 4000 targets that move as stated, with gains that no Kalman filter would choose."""
    one, sensor, rng, runs = GH(MOTION, 0.7, 0.4), CartesianPosition(sigma=2.0), np.random.default_rng(3), 4000
    truth = BELIEF.mean + rng.standard_normal((runs, 1, 4)) * np.sqrt(np.diagonal(BELIEF.cov, axis1=-2, axis2=-1))
    belief = Gaussian(np.tile(BELIEF.mean, (runs, 1, 1)), np.tile(BELIEF.cov, (runs, 1, 1, 1)))
    root = np.linalg.cholesky(MOTION.noise(BELIEF.mean, 1.0))
    for _ in range(15):
        truth = MOTION.move(truth, 1.0) + rng.standard_normal((runs, 1, 4)) @ root.T
        seen = vedette.Detections(truth[..., :2] + 2.0 * rng.standard_normal((runs, 1, 2)), np.ones((runs, 1), dtype=bool))
        belief = one.predict(belief, 1.0, rng)
        belief = one.update(belief, one.evaluate(belief, sensor, seen, 1.0), np.tile(SURE, (runs, 1, 1)))
    ratio = np.var((belief.mean - truth)[:, 0], axis=0) / np.diagonal(belief.cov[0, 0])
    assert np.all(np.abs(ratio - 1) < 5 * np.sqrt(2 / runs))


def test_constant_gains_take_a_polar_return_to_the_plane():
    """The residual of a range and a bearing, taken back by the inverse of H, is that of the position it gives."""
    one, sensor = GH(MOTION, 0.5, 0.2), RangeBearing(1.0, 1e-3)
    start = Gaussian(np.array([[3000.0, 4000.0, 5.0, 5.0]]), BELIEF.cov)
    moved = np.array([[3000.6, 4000.8, 5.0, 5.0]])
    seen = vedette.Detections.of(sensor.measure(moved[:, :2]).tolist())
    after = one.update(start, one.evaluate(start, sensor, seen, 1.0), SURE)
    np.testing.assert_allclose(after.mean - start.mean, [[0.3, 0.4, 0.12, 0.16]], rtol=1e-3)


def test_gains_whose_errors_grow_are_refused():
    with pytest.raises(ValueError, match=r"h: must be < 4 - 2 g = 3, or errors.*got 3\.5"):
        GH(MOTION, 0.5, 3.5)


def test_least_squares_is_the_line_through_all_returns():
    """Also where returns come at uneven times, and are forgotten by age."""
    rng, times = np.random.default_rng(5), np.array([0.0, 1.0, 1.5, 4.0, 7.0, 7.5])
    z = 3.0 + 2.0 * times[:, None] * [1.0, -1.0] + rng.standard_normal((6, 2))
    for forgetting in (1.0, 0.9):
        one, sensor = LeastSquares(MOTION, forgetting, 2.0), CartesianPosition(sigma=2.0)
        belief = one.start(Gaussian(np.zeros((1, 4)), 1e14 * np.eye(4)[None]), one.state, RNG)
        for k, row in enumerate(z):
            belief = one.predict(belief, times[k] - times[k - 1] if k else 0.0, RNG)
            belief = one.update(belief, one.evaluate(belief, sensor, vedette.Detections.of([row.tolist()]), 1.0), SURE)
        age = times - times[-1]
        weights = np.sqrt(forgetting ** (-age / 2.0))[:, None]
        design = np.stack([np.ones(6), age], axis=1) * weights
        fit = np.linalg.lstsq(design, z * weights, rcond=None)[0]
        np.testing.assert_allclose(one.moments(belief).mean[0], fit.ravel(), rtol=1e-6)
        np.testing.assert_allclose(one.moments(belief).cov[0, ::2, ::2], 4.0 * np.linalg.inv(design.T @ design), rtol=1e-6)


def test_an_ensemble_grows_into_the_kalman_filter():
    sensor, ends = CartesianPosition(sigma=2.0), []
    for one in (ExtendedKalman(MOTION), EnsembleKalman(MOTION, 200_000)):
        rng = np.random.default_rng(1)
        belief = one.start(BELIEF, one.state, rng)
        for k in range(1, 6):
            belief = one.predict(belief, 1.0, rng)
            seen = vedette.Detections.of([[1.0 + 3.0 * k, 2.0 - k], [3.0 + 3.0 * k, 1.0 - k]])
            belief = one.update(belief, one.evaluate(belief, sensor, seen, 1.0), np.array([[0.2, 0.5, 0.3]]))
        ends.append(one.moments(belief))
    spread = np.sqrt(np.diagonal(ends[0].cov[0]))
    assert np.max(np.abs(ends[1].mean - ends[0].mean) / spread) < 0.02
    assert np.max(np.abs(ends[1].cov - ends[0].cov) / (spread[:, None] * spread)) < 0.02


def test_two_scans_at_one_time_perturb_apart():
    """An ensemble without a prediction in between draws anew for the second scan."""
    one, sensor = EnsembleKalman(MOTION, 50), CartesianPosition(sigma=2.0)
    before = one.start(BELIEF, one.state, np.random.default_rng(2))
    seen = vedette.Detections.of([[1.0, 2.0]])
    after = one.update(before, one.evaluate(before, sensor, seen, 1.0), SURE)
    assert np.all(after.key != before.key)
    again = one.update(before, one.evaluate(before, sensor, seen, 1.0), SURE)
    np.testing.assert_array_equal(again.points, after.points)


@pytest.mark.parametrize(("given", "meant"), [("EnKF", "ensemble_kalman"), ("alpha-beta", "g_h"), ("MMAE", "imm")])
def test_the_fields_names_are_understood(given, meant):
    parts = {"sensors": {"s": {"kind": "cartesian_position", "sigma": 2.0}}, "associator": {"kind": "gnn"}}
    with pytest.raises(ConfigError, match=f"did you mean '{meant}'"):
        vedette.build(
            {**parts, "birth": {"kind": "from_returns"}, "lifecycle": {"kind": "m_of_n"}, "estimator": {"kind": given}}
        )
