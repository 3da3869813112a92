"""Noise that is 1e12 times as large in one direction as across it: no filter fails, and what is singular is refused."""

import numpy as np
import pytest

import vedette
from vedette_standard import PolarPosition

FILTERS = ("kalman", "ekf", "iekf", "ukf", "ckf", "srkf", "ensemble_kalman", "bootstrap_particles", "auxiliary_particles")


def tracker(estimator, sensor):
    return vedette.build(
        {
            "estimator": {"kind": estimator, "motion": {"kind": "constant_velocity", "sigma_accel": 0.1}},
            "sensors": {"radar": sensor},
            "associator": {"kind": "nearest"},
            "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
            "lifecycle": {"kind": "m_of_n"},
        }
    )


@pytest.mark.parametrize(("sigma_range", "sigma_bearing"), [(1e-9, 0.5), (1e3, 1e-12)])
def test_a_radars_noise_is_positive_definite_in_every_direction(sigma_range, sigma_bearing):
    radar = PolarPosition(sigma_range=sigma_range, sigma_bearing=sigma_bearing)
    angle = np.linspace(0.0, 2.0 * np.pi, 97)[:, None]
    along = np.concatenate([np.cos(angle), np.sin(angle)], axis=-1)
    R = radar.noise((10.0 ** np.arange(-6, 7))[:, None, None] * along)
    np.linalg.cholesky(R)
    assert np.all(np.linalg.eigvalsh(R)[..., 0] > 0)


@pytest.mark.parametrize("estimator", FILTERS)
def test_no_filter_fails_on_noise_that_is_a_line(estimator):
    it = tracker(estimator, {"kind": "polar_position", "sigma_range": 1e-8, "sigma_bearing": 0.1, "clutter_density": 1e-9})
    state = it.start(seed=1)
    for time in range(4):
        state = it.step(state, vedette.Scan(float(time), "radar", vedette.Detections.of([[3e5, 4e5]])))
    assert np.all(np.isfinite(it.estimate(state).cov))


def detected(noise):
    return vedette.Scan(0.0, "radar", vedette.Detections([[1.0, 2.0]], [True], noise=[noise]))


def test_a_noise_of_very_different_scales_is_taken_and_a_singular_one_is_refused():
    it = tracker("ekf", {"kind": "range_bearing", "sigma_range": 5.0, "sigma_bearing": 0.01, "clutter_density": 1e-9})
    state = it.start(seed=1)
    assert len(it.step(state, detected([[1e6, 0.0], [0.0, 1e-12]])).ids) == 1
    with pytest.raises(vedette.ScanRefused, match="correlations"):
        it.step(state, detected([[1.0, 1.0], [1.0, 1.0]]))
    with pytest.raises(vedette.ScanRefused, match=r"at most 1e\+30"):
        it.step(state, detected([[1e31, 0.0], [0.0, 1.0]]))


def test_a_priors_variances_are_judged_one_by_one():
    it = tracker("kalman", {"kind": "cartesian_position", "sigma": 5.0})
    mean = np.zeros((1, 4))
    assert len(it.start(vedette.Gaussian(mean, np.diag([1e18, 1e18, 1e20, 0.0])[None])).ids) == 1
    with pytest.raises(ValueError, match="semi-definite"):  # -0.05 is no rounding of 0, whatever the other axes are
        it.start(vedette.Gaussian(mean, np.diag([1e8, 1e8, -0.05, 1.0])[None]))
    with pytest.raises(ValueError, match=r"variances of at most 1e\+30"):
        it.start(vedette.Gaussian(mean, np.diag([1e31, 1.0, 1.0, 1.0])[None]))
