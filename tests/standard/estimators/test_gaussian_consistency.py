"""Kalman, extended and unscented filters are consistent on matched truth, and only there."""

import numpy as np
import pytest
from scipy import stats

from vedette import Detections, Gaussian
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.estimators.unscented import UnscentedKalman
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.coordinated_turn import CoordinatedTurn
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.range_bearing import RangeBearing

RNG = np.random.default_rng(0)
"""Asked for by the signature; these filters draw nothing."""


def drawn(motion, prior, sensor, runs, scans, dt, seed):
    """Truth (scans, runs, 1, n) and returns (scans, runs, 1, m) from the models themselves, all runs at once."""
    rng = np.random.default_rng(seed)
    x = rng.multivariate_normal(prior.mean, prior.cov, size=(runs, 1))
    R = np.linalg.cholesky(sensor.noise(x))
    truth, seen = [], []
    for _ in range(scans):
        L = np.linalg.cholesky(motion.noise(x, dt))
        x = motion.move(x, dt) + (L @ rng.normal(size=(*x.shape, 1)))[..., 0]
        z = sensor.measure(x[..., sensor_axes(motion, sensor)])
        seen.append(sensor.measurement.displace(z, (R @ rng.normal(size=(*z.shape, 1)))[..., 0]))
        truth.append(x)
    return truth, seen


def sensor_axes(motion, sensor):
    return motion.state.locate(sensor.observes)


def consistency(estimator, prior, sensor, truth, seen, dt):
    """NEES and NIS (scans, runs)"""
    runs, n = truth[0].shape[0], len(estimator.state)
    at_start = Gaussian(np.broadcast_to(prior.mean, (runs, 1, n)), np.broadcast_to(prior.cov, (runs, 1, n, n)))
    belief = estimator.start(at_start, estimator.state, RNG)
    nees, nis = [], []
    for x, z in zip(truth, seen, strict=True):
        belief = estimator.predict(belief, dt, RNG)
        innovation = estimator.evaluate(belief, sensor, Detections(z, np.ones((runs, 1), bool)), 1.0)
        belief = estimator.update(belief, innovation, np.broadcast_to([0.0, 1.0], (runs, 1, 2)))
        error = estimator.state.difference(x, belief.mean)
        nees.append((error[..., None, :] @ np.linalg.solve(belief.cov, error[..., None]))[:, 0, 0, 0])
        nis.append(innovation.nis[:, 0, 0])
    return np.array(nees), np.array(nis)


def in_band(total, freedom, alpha=1e-7):
    """Whether a sum of squares lies in chi-square's two-sided band."""
    return stats.chi2.ppf(alpha / 2, freedom) < total < stats.chi2.isf(alpha / 2, freedom)


CV_PRIOR = Gaussian(np.array([800.0, 500.0, -10.0, 5.0]), np.diag([400.0, 400.0, 25.0, 25.0]))


@pytest.mark.parametrize(
    ("sigma_accel", "sigma", "consistent"),
    [(0.5, 10.0, True), (0.4, 10.0, False), (0.5, 9.5, False), (0.5, 10.5, False)],
    ids=["matched", "too little process noise", "too little measurement noise", "too much"],
)
def test_kalman_nees_and_nis_lie_in_their_bands_on_matched_truth(sigma_accel, sigma, consistent):
    """500 runs of 40 scans. NEES at the last scan ~ chi2(500 n), NIS over all ~ chi2(20000 m); false alarms 2e-7 in all."""
    motion, sensor = ConstantVelocity(0.5), CartesianPosition(10.0)
    truth, seen = drawn(motion, CV_PRIOR, sensor, 500, 40, 2.0, seed=1)
    told = Kalman(ConstantVelocity(sigma_accel))
    nees, nis = consistency(told, CV_PRIOR, CartesianPosition(sigma), truth, seen, 2.0)
    assert (in_band(nees[-1].sum(), nees[-1].size * 4) and in_band(nis.sum(), nis.size * 2)) == consistent


def within_a_tenth(values, freedom):
    """Whether the mean of `values` (scans, runs) over `freedom` lies in .9 to 1.1 by all of 5.2 of its standard errors.

    The run is the unit: values within one are not independent. A mean outside passes once in 1e7.
    """
    of_runs = values.mean(axis=0) / freedom
    margin = 5.2 * of_runs.std(ddof=1) / np.sqrt(of_runs.size)
    return margin < 0.05 and 0.9 + margin < of_runs.mean() < 1.1 - margin


@pytest.mark.parametrize("kind", [ExtendedKalman, UnscentedKalman])
@pytest.mark.parametrize(("sigma_bearing", "consistent"), [(0.01, True), (0.0085, False)], ids=["matched", "too sure"])
@pytest.mark.by_turns
def test_nonlinear_filters_are_consistent_on_a_mild_problem(kind, sigma_bearing, consistent):
    """A boat 1 km from a radar of 10 m and 0.6 deg, turning a little; 3000 runs of 25 scans, standard errors below .006.

    By normal theory the matched case fails less than once in 1e12 while the filter's own mean is within .98 to 1.02.
    """
    motion, sensor = CoordinatedTurn(0.3, 0.003), RangeBearing(10.0, 0.01)
    prior = Gaussian(np.append(CV_PRIOR.mean, 0.02), np.diag([400.0, 400.0, 25.0, 25.0, 1e-4]))
    truth, seen = drawn(motion, prior, sensor, 3000, 25, 2.0, seed=2)
    nees, nis = consistency(kind(motion), prior, RangeBearing(10.0, sigma_bearing), truth, seen, 2.0)
    assert (within_a_tenth(nees, 5) and within_a_tenth(nis, 2)) == consistent
