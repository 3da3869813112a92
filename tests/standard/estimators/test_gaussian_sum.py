"""Gaussian sums: how a prior is split, and what its parts follow."""

import numpy as np
import pytest

from support.boats import prior
from vedette import Detections, Gaussian, kernels
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.gaussian_sum import GaussianSum
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.sensors.bearing_only import BearingOnly
from vedette_standard.sensors.cartesian_position import CartesianPosition

RNG = np.random.default_rng(0)
"""Asked for by the signature; these filters draw nothing."""
CV = ConstantVelocity(0.5)


# Sums.
def test_a_prior_is_split_without_a_change_of_its_moments():
    at_start = prior(4, 3)
    for axis in ("", "x", "vy"):
        estimator = GaussianSum(ExtendedKalman(CV), parts=5, share=0.7, axis=axis)
        belief = estimator.start(at_start, CV.state, RNG)
        found = estimator.moments(belief)
        np.testing.assert_allclose(found.mean, at_start.mean, rtol=1e-12)
        np.testing.assert_allclose(found.cov, at_start.cov, rtol=1e-9, atol=1e-9)
        assert all(np.all(np.linalg.eigvalsh(part.cov) > 0) for part in belief.beliefs)


def test_a_split_has_the_normals_higher_moments():
    """Along the axis, up to order 2 parts - 1: a standard normal's are 1, 3, 15, 105 for 2, 4, 6, 8."""
    estimator = GaussianSum(Kalman(CV), parts=5, share=0.6, axis="x")
    belief = estimator.start(Gaussian(np.zeros((1, 4)), np.eye(4)[None]), CV.state, RNG)
    w = estimator.mode_prob(belief)[0]
    nodes, weights = np.polynomial.hermite_e.hermegauss(12)
    weights = weights / np.sum(weights)
    for order, expected in ((2, 1), (4, 3), (6, 15), (8, 105)):
        each = [np.sum(weights * (part.mean[0, 0] + np.sqrt(part.cov[0, 0, 0]) * nodes) ** order) for part in belief.beliefs]
        assert w @ each == pytest.approx(expected, rel=1e-9)


def test_parts_never_switch_and_follow_bayes():
    estimator = GaussianSum(Kalman(CV), parts=4, axis="x")
    one = Kalman(CV)
    at_start, sensor = prior(4, 1), CartesianPosition(5.0)
    belief = estimator.start(at_start, CV.state, RNG)
    parts, log_w = list(belief.beliefs), np.log(estimator.mode_prob(belief)[0])
    for z in ([790.0, 505.0], [770.0, 515.0]):
        belief = estimator.predict(belief, 2.0, RNG)
        innovation = estimator.evaluate(belief, sensor, Detections.of([z]), 1.0)
        belief = estimator.update(belief, innovation, np.array([[0.0, 1.0]]))
        parts = [one.predict(part, 2.0, RNG) for part in parts]
        told = [one.evaluate(part, sensor, Detections.of([z]), 1.0) for part in parts]
        log_w = log_w + [each.loglik[0, 1] for each in told]
        parts = [one.update(part, each, np.array([[0.0, 1.0]])) for part, each in zip(parts, told, strict=True)]
    np.testing.assert_allclose(estimator.mode_prob(belief)[0], np.exp(log_w - kernels.log_sum(log_w)), rtol=1e-9)
    for part, alone in zip(belief.beliefs, parts, strict=True):
        np.testing.assert_allclose(part.mean, alone.mean, rtol=1e-10)
        np.testing.assert_allclose(part.cov, alone.cov, rtol=1e-9)


def test_a_sum_holds_the_range_behind_a_bearing():
    """Bearings from two places, range unknown from 200 m to 4 km: mean error of the sum against the extended filter's.

    100 geometries, the same for both; the ratio is 0.3 with a standard error of about 0.05.
    """
    rng = np.random.default_rng(6)
    runs = 100
    r = rng.uniform(400, 3600, runs)
    truth = np.stack([r, np.zeros(runs), np.zeros(runs), np.zeros(runs)], axis=-1)
    wide = Gaussian(
        np.broadcast_to([2000.0, 0, 0, 0], (runs, 1, 4)),
        np.broadcast_to(np.diag([900.0**2, 40.0**2, 0.01, 0.01]), (runs, 1, 4, 4)),
    )
    motion = ConstantVelocity(1e-3)
    errors = {}
    for estimator in (ExtendedKalman(motion), GaussianSum(ExtendedKalman(motion), parts=11, share=0.95)):
        noise = np.random.default_rng(7)
        belief = estimator.start(wide, motion.state, RNG)
        for y in np.linspace(0, 300, 7):
            sensor = BearingOnly(0.01, y=-y)
            z = sensor.measure(truth[:, None, :2]) + 0.01 * noise.normal(size=(runs, 1, 1))
            belief = estimator.predict(belief, 1.0, RNG)
            innovation = estimator.evaluate(belief, sensor, Detections(z, np.ones((runs, 1), bool)), 1.0)
            belief = estimator.update(belief, innovation, np.broadcast_to([0.0, 1.0], (runs, 1, 2)))
        errors[estimator.kind] = np.sqrt(np.mean((estimator.moments(belief).mean[:, 0, 0] - r) ** 2))
    assert errors["gaussian_sum"] < 0.7 * errors["ekf"]


@pytest.mark.parametrize("axis", ["z", "turn"])
def test_a_sum_names_an_axis_that_is_there(axis):
    with pytest.raises(ValueError, match="axis: must be one of x, y, vx"):
        GaussianSum(Kalman(CV), axis=axis)
