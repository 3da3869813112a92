"""What the toolbox makes of detections: an estimator that uses it need not know what each of them brought."""

import numpy as np
import pytest
from attrs import frozen
from numpy.testing import assert_allclose

from vedette import Detections, Gaussian, MotionModel, fields
from vedette.filters import (
    GaussianFilter,
    evaluate_each,
    evaluate_linearised,
    predict_linearised,
    prepare,
    present_noise,
)
from vedette_standard.estimators.cubature import CubatureKalman
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.iterated import IteratedExtendedKalman
from vedette_standard.estimators.square_root import SquareRootKalman
from vedette_standard.estimators.unscented import UnscentedKalman
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.particles import Particles, evaluate_particles
from vedette_standard.sensors.partial import Partial
from vedette_standard.sensors.position_velocity import PositionVelocity
from vedette_standard.sensors.range_bearing import RangeBearing

CV = ConstantVelocity(0.5)
RNG = np.random.default_rng(3)
WHOLE = PositionVelocity(2.0, 0.5, detection_probability=0.9)
SENSOR = Partial(WHOLE, {"vx": 20.0, "vy": 20.0})
MISSING = np.array([[False] * 4, [False, False, True, True], [False, False, False, True]])
Z = np.array([[1.0, 2.0, 3.0, 4.0], [4.0, 1.0, 0.0, 0.0], [0.0, 3.0, 2.0, 0.0]])


def beliefs(batch=(2,)):
    root = RNG.normal(size=(*batch, 3, 4, 4))
    return Gaussian(RNG.normal(size=(*batch, 3, 4)), root @ np.swapaxes(root, -1, -2) + np.eye(4))


def seen(noise=None):
    """The three detections in each of two runs, with noises (3, 4, 4) of their own or without."""
    own = None if noise is None else np.broadcast_to(noise, (2, 3, 4, 4))
    z, missing = (np.broadcast_to(values, (2, 3, 4)) for values in (Z, MISSING))
    return Detections(z, np.ones((2, 3), bool), None, own, missing)


def own_noise():
    root = RNG.normal(size=(3, 4, 4))
    return root @ np.swapaxes(root, -1, -2) + np.eye(4)


@frozen
class Stranger(GaussianFilter):
    """A third party's filter: the textbook's formula, and nothing said of noises or missing components."""

    kind = "test_stranger"
    motion: MotionModel = fields.part("how the target moves")

    def predict(self, belief, dt, rng):
        return belief if dt == 0 else predict_linearised(belief, self.motion, dt)

    def evaluate(self, belief, sensor, observed, p_gate):
        x = belief.mean[..., self.state.locate(sensor.observes)]
        ready = prepare(sensor, observed, sensor.measure(x), sensor.noise(x))
        return evaluate_each(belief, ready, sensor.jacobian(x)[..., None, :, :], x, p_gate)


def by_conditioning(belief, z, R, present):
    """Posterior, log density and log sqrt|S| of one detection over the components that it has, written out."""
    H = np.eye(4)[present]
    S = H @ belief.cov @ H.T + R[np.ix_(present, present)]
    nu = z[present] - H @ belief.mean
    gain = belief.cov @ H.T @ np.linalg.inv(S)
    density = -0.5 * (nu @ np.linalg.solve(S, nu) + np.linalg.slogdet(2 * np.pi * S)[1])
    return gain @ nu, belief.cov - gain @ S @ gain.T, density, 0.5 * np.linalg.slogdet(S)[1]


@pytest.mark.parametrize("noise", [None, own_noise()])
@pytest.mark.parametrize("kind", [Stranger, ExtendedKalman, IteratedExtendedKalman, UnscentedKalman, CubatureKalman])
def test_a_detection_counts_by_the_components_that_it_has(kind, noise):
    belief, estimator = beliefs(), kind(CV)
    detections = Detections(
        np.broadcast_to(Z, (2, 3, 4)), np.ones((2, 3), bool), missing=np.broadcast_to(MISSING, (2, 3, 4))
    )
    if noise is not None:
        detections = Detections(
            detections.z, detections.valid, None, np.broadcast_to(noise, (2, 3, 4, 4)), detections.missing
        )
    found = estimator.evaluate(belief, SENSOR, detections, 0.99)
    volumes = np.empty((2, 3, 3))
    for b, t, k in np.ndindex(2, 3, 3):
        R = WHOLE.noise(Z) if noise is None else noise[k]
        one = Gaussian(belief.mean[b, t], belief.cov[b, t])
        shift, post, density, volumes[b, t, k] = by_conditioning(one, Z[k], R, ~MISSING[k])
        assert_allclose(found.detail.shift[b, t, k], shift, rtol=1e-8, atol=1e-9)
        assert_allclose(found.detail.post[b, t, min(k, found.detail.post.shape[-3] - 1)], post, rtol=1e-8, atol=1e-8)
        assert_allclose(found.loglik[b, t, 1 + k], density + np.log(0.9), rtol=1e-10)
    assert_allclose(found.loglik[..., 0], np.log(1 - 0.9 * 0.99))
    assert_allclose(found.log_volume, volumes.max(axis=-1), rtol=1e-8, atol=1e-9)  # the widest gate's


def test_square_roots_and_particles_agree_with_the_kalman_filter():
    belief = beliefs()
    detections = Detections(
        np.broadcast_to(Z, (2, 3, 4)), np.ones((2, 3), bool), missing=np.broadcast_to(MISSING, (2, 3, 4))
    )
    wanted = ExtendedKalman(CV).evaluate(belief, SENSOR, detections, 0.99)
    srkf = SquareRootKalman(CV)
    found = srkf.evaluate(srkf.start(belief, CV.state, RNG), SENSOR, detections, 0.99)
    assert_allclose(found.loglik, wanted.loglik, rtol=1e-9)
    assert_allclose(found.log_volume, wanted.log_volume, rtol=1e-9)
    points = belief.mean[..., None, :] + RNG.normal(size=(2, 3, 5, 4))
    even = Particles(points, np.full((2, 3, 5), -np.log(5)))
    by_point = evaluate_particles(even, CV.state, SENSOR, detections, 0.99).detail
    for p in range(5):
        sharp = Gaussian(points[..., p, :], 1e-12 * np.broadcast_to(np.eye(4), (2, 3, 4, 4)))
        at_point = evaluate_linearised(sharp, CV.state, SENSOR, detections, 0.99)
        assert_allclose(by_point[..., p], at_point.loglik, rtol=1e-6)


@pytest.mark.parametrize("points", [False, True])
def test_residuals_go_the_short_way_round_and_noise_is_the_detections_own(points):
    radar = RangeBearing(1.0, 0.01)
    expected = np.array([[[100.0, 3.1]]]) if not points else np.array([[[[100.0, 3.1], [101.0, 3.0]]]])
    detections = Detections(np.array([[[102.0, -3.1]]]), np.ones((1, 1), bool), noise=np.full((1, 1, 2, 2), 7.0))
    ready = prepare(radar, detections, expected, radar.noise(expected), points)
    assert ready.residuals.shape == ((1, 1, 1, 2, 2) if points else (1, 1, 1, 2))
    assert_allclose(ready.residuals[..., 0, :].ravel(), [2.0, 2 * np.pi - 6.2])
    np.testing.assert_array_equal(ready.noise, np.full(ready.noise.shape, 7.0))
    assert ready.present is None
    assert ready.log_constant == 0.0


def test_what_a_missing_component_holds_is_nothing():
    present, R = np.array([True, False]), np.array([[4.0, np.nan], [np.nan, np.nan]])
    np.testing.assert_array_equal(present_noise(R, present), [[4.0, 0.0], [0.0, 1.0]])
