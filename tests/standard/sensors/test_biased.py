"""Sensors whose biases are axes of the state."""

import attrs
import numpy as np
import pytest

from vedette import Detections, Gaussian, Pose
from vedette.filters import evaluate_linearised
from vedette_standard.sensors.biased import Biased
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.partial import Partial
from vedette_standard.sensors.range_bearing import RangeBearing

POSE = Pose(np.array([300.0, -200.0]), np.array([4.0, -3.0]), 0.7)


# Biases.
RADAR = RangeBearing(10.0, 0.01, heading=0.2)
TURNED = Biased(RADAR, add={"bearing": "turned", "range": "long"})
SHIFTED = Biased(RADAR, offset={"x": "north", "y": "east"})
LATE = Biased(RADAR, lag="late")
ALL = Biased(RADAR, add={"bearing": "turned"}, offset={"x": "north", "y": "east"}, lag="late")


def test_biases_are_axes_after_the_sensors_own():
    assert str(TURNED.observes) == "(x [m], y [m], turned [rad], long [m])"
    assert SHIFTED.observes.names == ("x", "y", "north", "east")
    assert LATE.observes.names == ("x", "y", "vx", "vy", "late")
    assert ALL.observes.names == ("x", "y", "vx", "vy", "turned", "north", "east", "late")


def test_what_a_biased_sensor_reports():
    place = np.array([800.0, 500.0])
    plain = RADAR.measure(place)
    np.testing.assert_allclose(TURNED.measure(np.array([*place, -0.03, 12.0])), plain + [12.0, -0.03], rtol=1e-13)
    np.testing.assert_allclose(SHIFTED.measure(np.array([*place, 30.0, -7.0])), RADAR.measure(place + [30.0, -7.0]))
    np.testing.assert_allclose(LATE.measure(np.array([*place, 10.0, 4.0, 2.0])), RADAR.measure(place - [20.0, 8.0]))
    both = ALL.measure(np.array([*place, 10.0, 4.0, 0.05, 3.0, -1.0, 2.0]))
    np.testing.assert_allclose(both, RADAR.measure(place + [3.0, -1.0] - [20.0, 8.0]) + [0.0, 0.05], rtol=1e-13)


def test_without_bias_it_is_the_sensor_itself():
    x = np.random.default_rng(7).normal(size=(3, 8)) * [1e3, 1e3, 9, 9, 0, 0, 0, 0]
    np.testing.assert_array_equal(ALL.measure(x), RADAR.measure(x[:, :2]))
    np.testing.assert_array_equal(
        Biased(RADAR).invert(RADAR.measure(x[:, :2])).cov, RADAR.invert(RADAR.measure(x[:, :2])).cov
    )
    there, apart = ALL.at(POSE), RADAR.at(POSE)
    np.testing.assert_array_equal(there.measure(x), apart.measure(x[:, :2]))


def start_is_joint(sensor, bias, size):
    """By Bayes over draws: biases from their prior, what they make of one return."""
    z = np.array([[700.0, 0.5]])
    found = sensor.invert(z)
    rng = np.random.default_rng(8)
    draws = rng.normal(size=40_000) * size
    i, n = sensor.observes.names.index(bias), len(sensor.observes)
    x = np.zeros((40_000, n))
    x[:, i] = draws
    # The place that the return names, had the bias been so: a step of Newton's from the one without bias.
    x[:, :2] = found.mean[0, :2]
    apart = sensor.measurement.difference(z, sensor.measure(x))
    x[:, :2] += (np.linalg.inv(sensor.jacobian(x)[:, :, :2]) @ apart[..., None])[..., 0]
    spread = np.cov(x[:, [0, 1, i]].T)
    plain = np.zeros((3, 3))
    plain[:2, :2] = sensor.of.invert(z).cov[0]
    scale = np.sqrt(np.diag(spread + plain))
    wanted = (spread + plain) / np.outer(scale, scale)
    np.testing.assert_allclose(found.cov[0][np.ix_([0, 1, i], [0, 1, i])] / np.outer(scale, scale), wanted, atol=0.04)


@pytest.mark.parametrize(
    ("sensor", "bias", "size"),
    [
        (attrs.evolve(TURNED, spread={"turned": 0.03, "long": 1e-6}), "turned", 0.03),
        (attrs.evolve(TURNED, spread={"turned": 1e-9, "long": 15.0}), "long", 15.0),
        (attrs.evolve(SHIFTED, spread={"north": 15.0, "east": 1e-6}), "north", 15.0),
    ],
    ids=["turned", "long", "north"],
)
def test_a_track_starts_with_place_and_bias_correlated(sensor, bias, size):
    """Correlations of 4e4 draws are right to 0.025 at five standard errors."""
    start_is_joint(sensor, bias, size)
    with pytest.raises(AssertionError):
        start_is_joint(attrs.evolve(sensor, spread={**sensor.spread, bias: 0.3 * size}), bias, size)


def test_a_bias_of_unknown_size_starts_no_track():
    with pytest.raises(NotImplementedError, match=r"^spread: .* turned, long"):
        TURNED.invert(np.zeros((1, 2)))


@pytest.mark.parametrize("biases", [{}, {"add": {"bearing": "turned"}}, {"lag": "late"}])
def test_only_what_a_return_leaves_open_has_a_spread(biases):
    with pytest.raises(ValueError, match=r"^spread\.x: must be one of "):
        Biased(RADAR, **biases, spread={"x": 1.0})
    Biased(RADAR, lag="late", spread={"vx": 1.0, "vy": 1.0, "late": 1.0})


def test_a_linear_bias_is_linear():
    shifted = Biased(CartesianPosition(3.0), offset={"x": "north"})
    assert shifted.linear
    assert not SHIFTED.linear
    assert not Biased(CartesianPosition(3.0), lag="late").linear


def test_an_update_learns_a_bias_with_the_place_known():
    """A place known to the metre and a bearing without error: the bias takes the whole residual."""
    sensor = Biased(RangeBearing(10.0, 1e-6), add={"bearing": "turned"})
    mean = np.array([[800.0, 500.0, 0.0]])
    belief = Gaussian(mean, np.diag([1e-6, 1e-6, 0.05**2])[None])
    z = RangeBearing(10.0, 1e-6).measure(mean[:, :2]) + [0.0, -0.033]
    told = evaluate_linearised(belief, sensor.observes, sensor, Detections.of(z), 1.0)
    np.testing.assert_allclose(told.detail.shift[0, 0, 2], -0.033, rtol=1e-5)


def test_what_a_return_may_lack_it_may_lack_of_a_biased_sensor():
    partial = Partial(RADAR, {"bearing": 6.0})
    assert Biased(partial, add={"range": "long"}).optional == {"bearing": 6.0}
