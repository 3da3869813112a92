"""The cut of a bearing is a direction like any other."""

import numpy as np
import pytest

from support.boats import start
from vedette import Detections, Gaussian, Space, kernels
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.unscented import UnscentedKalman
from vedette_standard.motion.coordinated_turn import CoordinatedTurn
from vedette_standard.sensors.range_bearing import RangeBearing

RNG = np.random.default_rng(0)
"""Asked for by the signature; these filters draw nothing."""
REAL_RETURNS, REAL_TWIN, REAL_POINTS = kernels.evaluate_returns, kernels.evaluate_twin, kernels.evaluate_points_twin


def turned(angle, belief):
    c, s = np.cos(angle), np.sin(angle)
    T = np.eye(belief.mean.shape[-1])
    T[:2, :2] = T[2:4, 2:4] = [[c, -s], [s, c]]
    return Gaussian(belief.mean @ T.T, T @ belief.cov @ T.T), T


def check_turned(estimator, angle):
    """Five scans of a wide bearing sensor in a frame that is turned, turned back."""
    sensor = RangeBearing(10.0, 0.05)
    ahead = turned(-np.arctan2(500.0, 800.0), start(estimator, 1))[0]  # about bearing 0

    def walk(by):
        belief, T = turned(by, ahead)
        rng = np.random.default_rng(4)
        for _ in range(5):
            belief = estimator.predict(belief, 2.0, RNG)
            x = ahead.mean[..., :2] @ T[:2, :2].T
            z = sensor.measurement.displace(sensor.measure(x), rng.normal(size=(1, 2)) * [10, 0.1])
            innovation = estimator.evaluate(belief, sensor, Detections.of(z), 1.0)
            belief = estimator.update(belief, innovation, np.array([[0.0, 1.0]]))
        return turned(-by, belief)[0]

    straight, around = walk(0.0), walk(angle)
    np.testing.assert_allclose(around.mean, straight.mean, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(around.cov, straight.cov, rtol=1e-9, atol=1e-7)


NONLINEAR = [ExtendedKalman(CoordinatedTurn(0.5, 0.01)), UnscentedKalman(CoordinatedTurn(0.5, 0.01))]
TURNS = [(NONLINEAR[0], np.pi - 0.03), (NONLINEAR[0], np.pi), (NONLINEAR[0], 2.0), (NONLINEAR[1], np.pi)]


@pytest.mark.parametrize(("estimator", "angle"), TURNS)
def test_the_cut_of_the_bearing_is_a_direction_like_any_other(estimator, angle):
    """A half turn maps the points of the UKF onto each other; by other angles they differ, as Cholesky's factor does."""
    check_turned(estimator, angle)


def plain_mean(self, points, weights):
    mean = (weights[..., None, :] @ points)[..., 0, :]
    return mean, points - mean[..., None, :]


@pytest.mark.parametrize(("estimator", "angle"), [TURNS[1], TURNS[3]])
def test_so_it_is_with_the_sensors_own_methods(monkeypatch, estimator, angle):
    without_twins(monkeypatch)
    check_turned(estimator, angle)


def without_twins(monkeypatch):
    for name in ("evaluate_twin", "evaluate_points_twin", "predict_twin", "predict_points_twin"):
        monkeypatch.setattr(kernels, name, lambda *given: None)


@pytest.mark.parametrize(
    ("estimator", "where", "name", "mutant", "compiled"),
    [
        (NONLINEAR[0], kernels, "evaluate_returns", lambda *given: REAL_RETURNS(*given[:-1], ()), False),
        (NONLINEAR[1], Space, "difference", lambda self, a, b: a - b, False),
        (NONLINEAR[1], Space, "mean", plain_mean, False),
        (NONLINEAR[0], kernels, "evaluate_twin", lambda *given: REAL_TWIN(*given[:-1], ()), True),
        (NONLINEAR[1], kernels, "evaluate_points_twin", lambda *given: REAL_POINTS(*given[:-1], ()), True),
    ],
    ids=["ekf unwrapped residual", "ukf unwrapped residual", "ukf plain mean", "ekf's twin", "ukf's twin"],
)
def test_the_turned_frame_bites(monkeypatch, estimator, where, name, mutant, compiled):
    if compiled and not kernels.RUNNING.startswith("compiled"):
        pytest.skip("the kernels that run call no twin")
    if not compiled:
        without_twins(monkeypatch)
    monkeypatch.setattr(where, name, mutant)
    with pytest.raises(AssertionError):
        check_turned(estimator, np.pi)
