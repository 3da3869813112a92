"""Process noise that follows the residuals: 1 on matched truth, and larger where the target moves more than stated."""

import numpy as np
import pytest
from attrs import evolve

import vedette
from vedette import Detections, Gaussian, Scan
from vedette.metrics.consistency import nees
from vedette.sampling import draw_states
from vedette_flir.estimators.monitored import ResidualMonitored
from vedette_flir.motion.jittered_acceleration import JitteredAcceleration
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_study.lockstep import run_together


def figures(true_accel, gain, runs=200, scans=150):
    """NEES / 4 over the second half, its standard error over runs, and the mean NIS / 2."""
    estimator = {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.3}}
    tracker = vedette.load(
        {
            "estimator": {"kind": "residual_monitored", "of": estimator, "gain": gain},
            "sensors": {"radar": {"kind": "cartesian_position", "sigma": 2.0}},
            "gate": {"probability": 0.999999999},
            "associator": {"kind": "pda"},
            "birth": {"kind": "given"},
            "lifecycle": {"kind": "single_target"},
        }
    ).tracker
    rng, times = np.random.default_rng(4), np.arange(scans, dtype=float)
    truth = draw_states(ConstantVelocity(true_accel), np.zeros((runs, 4)), times, rng)
    cov = np.broadcast_to(np.diag([4.0, 4.0, 1.0, 1.0]), (runs, 1, 4, 4))
    prior = Gaussian(rng.standard_normal((runs, 1, 4)) * np.array([2.0, 2.0, 1.0, 1.0]), cov)
    z = truth[..., :2] + 2.0 * rng.standard_normal((runs, scans, 2))
    seen = (
        Scan(t, "radar", Detections(z[:, k, None], np.ones((runs, 1), dtype=bool))) for k, t in enumerate(times.tolist())
    )
    found = run_together(tracker, prior, 0.0, seen)
    half = slice(scans // 2, None)
    each = np.mean(nees((found.mean - truth)[:, half], found.cov[:, half]), axis=1) / 4
    return each.mean(), each.std(ddof=1) / np.sqrt(runs), found.nis[:, half].mean() / 2


@pytest.mark.statistical(alpha=1e-6)
def test_noise_that_is_too_small_is_found_out():
    """Truth that moves three times as much as stated: without monitoring the filter is far too sure, with it about right."""
    sure, _, far = figures(0.9, 0.0)
    found, error, near = figures(0.9, 0.1)
    assert sure > 4.0
    assert far > 1.9
    assert found < 1.09 + 5 * error
    assert 0.95 < near < 1.1


@pytest.mark.statistical(alpha=1e-6)
def test_matched_noise_is_left_about_as_it_is():
    plain, error, _ = figures(0.3, 0.0)
    monitored, _, near = figures(0.3, 0.05)
    assert abs(plain - 1.0) < 5 * error
    assert monitored < 1.15
    assert 0.95 < near < 1.05


def test_only_the_blocks_axes_get_noise():
    """D Q D, D = sqrt(a) on the blocks: the jitter keeps its noise, and the whole stays a covariance."""
    of = Kalman(JitteredAcceleration())
    dynamics = ["x", "y", "vx", "vy", "ax", "ay"]
    made = ResidualMonitored(of, blocks=tuple(dynamics))
    rng, n = np.random.default_rng(0), 8
    started = made.start(Gaussian(np.zeros((1, n)), np.zeros((1, n, n))), made.state, rng)
    Q = made.of.motion.noise(np.zeros(n), 0.1)
    ahead = made.predict(evolve(started, scale=np.array([16.0])), 0.1, rng)
    own = [name in dynamics for name in made.state.names]
    root = np.where(own, 4.0, 1.0)
    np.testing.assert_allclose(made.moments(ahead).cov[0], root[:, None] * root * Q, rtol=1e-9, atol=1e-15)


def test_a_block_that_is_no_axis_is_refused():
    with pytest.raises(ValueError, match=r"blocks: .*'z'"):
        ResidualMonitored(Kalman(ConstantVelocity(0.3)), blocks=("z",))
