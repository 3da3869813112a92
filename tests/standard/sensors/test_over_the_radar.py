"""Noise of each return, places over the radar, and parameters of sensors of range and bearing."""

import re

import numpy as np
import pytest

from support.laws_of_sensors import everything, noise_is_positive_definite
from vedette import Detections, Gaussian
from vedette.sampling import NO_DRAWS
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.partial import Partial
from vedette_standard.sensors.polar_position import PolarPosition
from vedette_standard.sensors.range_bearing import RangeBearing
from vedette_standard.sensors.range_bearing_elevation import RangeBearingElevation
from vedette_standard.sensors.range_only import RangeOnly


def test_conversion_takes_the_noise_of_each_return():
    """Correlated errors: to first order J R J', per return."""
    sensor = RangeBearing(10.0, 0.01, heading=0.3)
    z = np.array([[1e3, 0.5], [2e3, -2.0]])
    noise = np.array([[[4.0, 1e-4], [1e-4, 1e-8]], [[9.0, -2e-4], [-2e-4, 4e-8]]])
    for i, (r, bearing) in enumerate(z):
        c, s = np.cos(bearing + 0.3), np.sin(bearing + 0.3)
        J = np.array([[c, -r * s], [s, r * c]])
        np.testing.assert_allclose(sensor.invert(z, noise).cov[i], J @ noise[i] @ J.T, rtol=1e-5)


def test_a_position_taken_with_its_own_noise():
    z, noise = np.zeros((2, 2)), np.array([np.eye(2), 2 * np.eye(2)])
    for sensor in (CartesianPosition(3.0), PolarPosition(3.0, 0.1)):
        np.testing.assert_array_equal(sensor.invert(z, noise).cov, noise)


def test_polar_noise_agrees_with_the_conversion_of_range_and_bearing():
    x = np.array([[3e3, 4e3], [-1e3, 200.0], [5.0, -5.0]])
    converted = RangeBearing(20.0, 1e-3).invert(RangeBearing(20.0, 1e-3).measure(x)).cov
    np.testing.assert_allclose(PolarPosition(20.0, 1e-3).noise(x), converted, rtol=1e-5)


# Over the radar.
@pytest.mark.parametrize(
    "sensor", [RangeBearing(10.0, 0.02, x=5.0, y=-7.0, heading=1.0), PolarPosition(10.0, 0.02, x=5.0, y=-7.0)]
)
def test_over_the_radar_all_is_finite_and_definite(sensor):
    over = np.array([5.0, -7.0])
    for apart in ([0, 0], [1e-300, 0], [1e-12, 0], [0, 1e-4]):
        x = over + np.array(apart)
        z = sensor.measure(x)
        assert all(np.all(np.isfinite(result)) for result in everything(sensor, x, z))
        noise_is_positive_definite(sensor, x)
        assert np.all(np.linalg.eigvalsh(sensor.invert(z).cov) > 0)


@pytest.mark.parametrize("sensor", [RangeBearingElevation(5.0, 0.01, 0.01), RangeBearing(5.0, 0.01), RangeOnly(5.0)])
@pytest.mark.parametrize("apart", [0.0, 1e-300, 1e-12])
def test_of_a_target_at_the_sensor_an_update_knows_no_more_than_a_range(sensor, apart):
    """With its compiled twin, too: its height was known to 10 um by an elevation, whose derivative did not vanish."""
    axes = sensor.observes.names
    estimator = ExtendedKalman(ConstantVelocity(0.5, axes=axes))
    prior = Gaussian(np.zeros((1, 2 * len(axes))), 100.0 * np.eye(2 * len(axes))[None])
    prior.mean[0, estimator.state.names.index("x")] = apart
    seen = sensor.measure(np.full((1, len(axes)), 3.0))
    beliefs = []
    for each in (sensor, Partial(sensor, {})):  # what wraps it asks its methods where a return is marked
        belief = estimator.start(prior, estimator.state, NO_DRAWS)
        whole = None if each is sensor else np.zeros((1, len(sensor.measurement)), dtype=bool)
        innovation = estimator.evaluate(belief, each, Detections(seen, [True], missing=whole), 1.0)
        beliefs.append(estimator.moments(estimator.update(belief, innovation, np.array([[0.0, 1.0]]))))
    for one, other in zip(*((each.mean, each.cov) for each in beliefs), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-12)
    assert np.linalg.eigvalsh(beliefs[0].cov[0])[0] > 19.9  # a range that errs by 5 m leaves 20 m^2 of 100


def test_a_range_and_bearing_of_nothing_moves_nothing():
    sensor = RangeBearing(10.0, 0.02)
    np.testing.assert_array_equal(sensor.measure(np.zeros(2)), np.zeros(2))
    np.testing.assert_array_equal(sensor.jacobian(np.zeros(2)), np.zeros((2, 2)))
    near, far = sensor.jacobian(np.array([[0.6e-3, 0.8e-3 * (1 - 1e-12)], [0.6e-3, 0.8e-3 * (1 + 1e-12)]]))
    np.testing.assert_allclose(near, far, rtol=1e-11)


def test_over_the_radar_polar_noise_is_the_mean_over_directions():
    sensor = PolarPosition(10.0, 0.02, sigma_extent=1.0)
    angle = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    around = sensor.noise(1e-3 * np.stack([np.cos(angle), np.sin(angle)], axis=-1))
    np.testing.assert_allclose(sensor.noise(np.zeros(2)), np.mean(around, axis=0), rtol=1e-5, atol=1e-12)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: CartesianPosition(-3), "sigma: must be > 0, got -3 m"),
        (lambda: RangeBearing(10, 1.5), "sigma_bearing: must be > 0 and <= 1, got 1.5 rad"),
        (lambda: RangeBearing(10, 0.01, detection_probability=1.1), "detection_probability: must be >= 0 and <= 1, got 1.1"),
        (lambda: RangeBearing(10, 0.01, clutter_per_scan=5), "clutter_per_scan: needs max_range"),
        (lambda: RangeBearing(10, 0.01, min_range=50, max_range=40), "max_range: must be > min_range, 50 m, got 40 m"),
        (lambda: PolarPosition(10, 0.01, -1), "sigma_extent: must be >= 0, got -1 m"),
        (lambda: PolarPosition(10, 0.01, max_range="2 kn"), "max_range: must be in m or km or NM or ft, got '2 kn'"),
    ],
)
def test_a_wrong_parameter_is_named_with_what_would_be_right(make, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        make()
