"""Kalman, extended and unscented filters: batches, misses, detection, noises of returns, and axes known exactly."""

import numpy as np
import pytest
from attrs import evolve, frozen

from support.boats import start
from support.models import Looking
from vedette import Detections, Gaussian, MotionModel, Space, kernels
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.estimators.unscented import UnscentedKalman
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.coordinated_turn import CoordinatedTurn
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.range_bearing import RangeBearing

RNG = np.random.default_rng(0)
"""Asked for by the signature; these filters draw nothing."""
POLAR = RangeBearing(10.0, 0.01, detection_probability=0.9, max_range=5000.0, clutter_per_scan=5.0)
BOATS = [
    (Kalman(ConstantVelocity(0.5)), CartesianPosition(5.0, 0.9)),
    (ExtendedKalman(CoordinatedTurn(0.5, 0.01)), POLAR),
    (UnscentedKalman(CoordinatedTurn(0.5, 0.01)), POLAR),
]
named = pytest.mark.parametrize(("estimator", "sensor"), BOATS, ids=["kalman", "ekf", "ukf"])


def returns(sensor, estimator, belief, k, seed=1, own=False):
    """Returns about the first track of each batch entry, (*b, k, m)"""
    rng = np.random.default_rng(seed)
    m = len(sensor.measurement)
    x = belief.mean[..., :1, estimator.state.locate(sensor.observes)]
    x = x + 10 * rng.normal(size=(*x.shape[:-2], k, x.shape[-1]))
    z = sensor.measure(x)
    a = np.sqrt(sensor.noise(x)) @ (np.eye(m) + rng.normal(size=(*z.shape, m)) / 4) if own else None
    noise = None if a is None else a @ np.swapaxes(a, -1, -2)
    return Detections(z, np.ones(z.shape[:-1], dtype=bool), None, noise)


def scan(estimator, belief, sensor, seen, dt=1.5):
    predicted = estimator.predict(belief, dt, RNG)
    innovation = estimator.evaluate(predicted, sensor, seen, 0.99)
    weights = np.exp(innovation.loglik - kernels.log_sum(innovation.loglik)[..., None])
    return predicted, innovation, estimator.update(predicted, innovation, weights)


@named
@pytest.mark.parametrize("own", [False, True], ids=["sensor's noise", "own noise"])
def test_a_batch_is_the_loop_over_its_runs(estimator, sensor, own):
    belief = start(estimator, 3, 2)
    seen = returns(sensor, estimator, belief, 4, own=own)
    predicted, innovation, posterior = scan(estimator, belief, sensor, seen)
    for i in range(3):
        alone = Detections(seen.z[i], seen.valid[i], None, seen.noise[i] if own else None)
        one, told, after = scan(estimator, Gaussian(belief.mean[i], belief.cov[i]), sensor, alone)
        for batched, single in ((predicted, one), (posterior, after)):
            np.testing.assert_allclose(batched.mean[i], single.mean, rtol=1e-12, atol=1e-12)
            np.testing.assert_allclose(batched.cov[i], single.cov, rtol=1e-12, atol=1e-10)
        for name in ("loglik", "distance", "log_volume", "nis"):
            np.testing.assert_allclose(getattr(innovation, name)[i], getattr(told, name), rtol=1e-12, atol=1e-12)


@named
@pytest.mark.parametrize("batch", [(0,), (1,), (2, 0), (2, 3)])
@pytest.mark.parametrize("k", [0, 2])
@pytest.mark.parametrize("own", [False, True])
def test_no_tracks_and_no_returns_are_no_special_case(estimator, sensor, batch, k, own):
    belief = start(estimator, *batch)
    m = len(sensor.measurement)
    z = np.full((*batch[:-1], k, m), 0.5)
    noise = np.broadcast_to(np.eye(m), (*z.shape, m)) if own else None
    detections = Detections(z, np.ones(z.shape[:-1], dtype=bool), None, noise)
    predicted, innovation, posterior = scan(estimator, belief, sensor, detections)
    assert innovation.loglik.shape == (*batch, 1 + k)
    assert innovation.distance.shape == innovation.nis.shape == (*batch, k)
    assert innovation.log_volume.shape == batch
    assert posterior.mean.shape == belief.mean.shape
    if k == 0:
        np.testing.assert_array_equal(posterior.mean, predicted.mean)
        np.testing.assert_array_equal(posterior.cov, predicted.cov)


@named
def test_a_miss_leaves_the_prediction_and_no_time_leaves_the_belief(estimator, sensor):
    belief = start(estimator, 2)
    assert estimator.predict(belief, 0.0, RNG) is belief
    predicted, innovation, _ = scan(estimator, belief, sensor, returns(sensor, estimator, belief, 2))
    missed = estimator.update(predicted, innovation, np.array([[1.0, 0.0, 0.0]] * 2))
    np.testing.assert_array_equal(missed.mean, predicted.mean)
    np.testing.assert_array_equal(missed.cov, predicted.cov)


@named
def test_detection_probability_enters_every_column(estimator, sensor):
    belief = start(estimator, 2)
    seen = returns(sensor, estimator, belief, 3)
    likely = estimator.evaluate(belief, sensor, seen, 0.99).loglik
    rarely = estimator.evaluate(belief, evolve(sensor, detection_probability=0.3), seen, 0.99).loglik
    np.testing.assert_allclose(likely[:, 0], np.log(1 - 0.9 * 0.99), rtol=1e-12)
    np.testing.assert_allclose(rarely[:, 0], np.log(1 - 0.3 * 0.99), rtol=1e-12)
    np.testing.assert_allclose(likely[:, 1:] - rarely[:, 1:], np.log(3.0), rtol=1e-12)
    certain = estimator.evaluate(belief, evolve(sensor, detection_probability=1.0), seen, 1.0).loglik
    assert np.all(np.isfinite(certain))


@named
def test_a_returns_own_noise_is_used(estimator, sensor):
    """Twice the sensor's noise on each return is the same as a sensor with twice the noise."""
    belief = start(estimator, 2)
    seen = returns(sensor, estimator, belief, 3)
    name = "sigma" if isinstance(sensor, CartesianPosition) else "sigma_range"
    worse = evolve(sensor, **{name: 2.0 * getattr(sensor, name)})
    noise = np.broadcast_to(worse.noise(belief.mean), (3, 2, 2))
    one = scan(estimator, belief, sensor, Detections(seen.z, seen.valid, None, noise))
    other = scan(estimator, belief, worse, seen)
    np.testing.assert_allclose(one[1].loglik, other[1].loglik, rtol=1e-12)
    np.testing.assert_allclose(one[2].cov, other[2].cov, rtol=1e-12, atol=1e-10)


@frozen(eq=False)
class Drifting(MotionModel):
    """One axis with noise, and a zero_variance one that counts the time."""

    kind = "test_drifting"

    @property
    def state(self):
        return Space.of(clock="s", x="m", v="m/s")

    @property
    def zero_variance(self):
        return Space.of(clock="s")

    def move(self, x, dt):
        return x + dt * np.stack([np.ones(x.shape[:-1]), x[..., 2], np.zeros(x.shape[:-1])], axis=-1)

    def noise(self, x, dt):
        return np.diag([0.0, 0.0, 1.0]) * dt


class AlongX(Looking):
    @property
    def observes(self):
        return Space.of(x="m")


@pytest.mark.parametrize("kind", [ExtendedKalman, UnscentedKalman])
def test_carried_axes_have_no_variance_and_are_moved_by_the_model(kind):
    estimator, sensor = kind(Drifting()), AlongX(np.eye(1), np.eye(1))
    belief = estimator.start(Gaussian(np.array([[5.0, 0.0, 1.0]]), np.ones((1, 3, 3)) + np.eye(3)), estimator.state, RNG)
    for _ in range(3):
        belief = estimator.predict(belief, 0.5, RNG)
        innovation = estimator.evaluate(belief, sensor, Detections.of([[1.0]]), 1.0)
        belief = estimator.update(belief, innovation, np.array([[0.0, 1.0]]))
    np.testing.assert_allclose(belief.mean[0, 0], 6.5, rtol=1e-12)
    assert np.all(belief.cov[0, 0] == 0.0)
    assert np.all(belief.cov[0, :, 0] == 0.0)
    assert np.linalg.eigvalsh(belief.cov[0, 1:, 1:])[0] > 0


def test_ukf_takes_an_axis_that_is_known_exactly():
    """A prior may say that a target does not turn yet; the rate then gets its variance from the motion's noise."""
    estimator = UnscentedKalman(CoordinatedTurn(0.5, 0.01))
    known = estimator.start(
        Gaussian(np.array([[800.0, 500.0, -10.0, 5.0, 0.0]]), np.diag([400.0, 400.0, 9.0, 9.0, 0.0])[None]),
        estimator.state,
        RNG,
    )
    nearly = Gaussian(known.mean, known.cov + np.diag([0, 0, 0, 0, 1e-12]))
    seen = returns(POLAR, estimator, known, 1)
    for one, other in zip(scan(estimator, known, POLAR, seen), scan(estimator, nearly, POLAR, seen), strict=True):
        if isinstance(one, Gaussian):
            np.testing.assert_allclose(one.mean, other.mean, rtol=1e-6, atol=1e-9)
            np.testing.assert_allclose(one.cov, other.cov, rtol=1e-5, atol=1e-5)


def test_kalman_refuses_what_is_not_linear():
    with pytest.raises(ValueError, match=r"'coordinated_turn' is not linear: use.*'ukf'"):
        Kalman(CoordinatedTurn(0.5, 0.01))
    assert "'range_bearing'" in Kalman(ConstantVelocity(1.0)).refuses(POLAR)
    assert Kalman(ConstantVelocity(1.0)).refuses(CartesianPosition(1.0)) is None
    assert ExtendedKalman(ConstantVelocity(1.0)).refuses(POLAR) is None
