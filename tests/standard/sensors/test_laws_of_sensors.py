"""The laws of sensors, on every one of the standard plugin; and mutants that each law must catch."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from vedette import Pose, Sensor, kernels
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.polar_position import PolarPosition
from vedette_standard.sensors.range_bearing import RangeBearing

PROFILE = settings(max_examples=40, deadline=None, derandomize=True)


def powers_of_ten(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high).map(lambda exponent: 10.0**exponent)


PLACES = st.floats(-1e3, 1e3)
CHANCES = st.floats(0, 1)
RADAR = {
    "sigma_range": powers_of_ten(-1, 2),
    "sigma_bearing": powers_of_ten(-4, -0.5),
    "detection_probability": CHANCES,
    "max_range": powers_of_ten(2.5, 5),
    "x": PLACES,
    "y": PLACES,
}
SENSORS = {
    CartesianPosition: st.builds(CartesianPosition, powers_of_ten(-1, 2), CHANCES, powers_of_ten(-9, -3)),
    RangeBearing: st.builds(
        RangeBearing,
        **RADAR,
        min_range=st.floats(0, 100),
        clutter_per_scan=st.floats(0, 100),
        heading=st.floats(-10, 10),
    ),
    PolarPosition: st.builds(PolarPosition, **RADAR, sigma_extent=st.floats(0, 10), clutter_density=powers_of_ten(-9, -3)),
}


@st.composite
def states(draw, sensor: Sensor) -> np.ndarray:
    """(*b, 2) from 10 m to 100 km from where the sensor stands, for a few kinds of batch axes."""
    b = draw(st.sampled_from([(), (1,), (3,), (2, 3), (0,)]))
    r = 10.0 ** draw(hnp.arrays(float, b, elements=st.floats(1, 5)))
    angle = draw(hnp.arrays(float, b, elements=st.floats(-np.pi, np.pi)))
    origin = np.array([getattr(sensor, "x", 0.0), getattr(sensor, "y", 0.0)])
    return origin + r[..., None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)


# The laws: each takes a sensor and positions (*b, 2).


def noise_is_positive_definite(sensor, x):
    R = sensor.noise(x)
    np.testing.assert_array_equal(R, np.swapaxes(R, -1, -2))
    assert np.all(np.linalg.eigvalsh(R) > 0)


def jacobian_is_the_derivative(sensor, x):
    slope = kernels.numerical_jacobian(sensor.measure, x, sensor.measurement.difference)
    size = np.max(np.abs(slope), axis=-1, keepdims=True)
    np.testing.assert_allclose((sensor.jacobian(x) - slope) / size, np.zeros_like(slope), atol=1e-4)


def a_batch_is_a_loop(sensor, x):
    z = sensor.measure(x)
    assert z.shape == (*x.shape[:-1], len(sensor.measurement))
    for together, alone in zip(everything(sensor, x, z), each(sensor, x, z), strict=True):
        np.testing.assert_allclose(np.broadcast_to(together, alone.shape), alone, rtol=1e-12, atol=0)


def nothing_is_written_or_kept(sensor, x):
    before, z = x.copy(), sensor.measure(x).copy()
    first = [result.copy() for result in everything(sensor, x, z)]
    for result, again in zip(first, everything(sensor, x, z), strict=True):
        np.testing.assert_array_equal(result, again)
    np.testing.assert_array_equal(x, before)
    np.testing.assert_array_equal(z, sensor.measure(x))


def detection_is_a_probability(sensor, x):
    detects = np.broadcast_to(sensor.detects(x), x.shape[:-1])
    assert np.all((detects >= 0) & (detects <= 1))


def measurements_are_canonical(sensor, x):
    z = sensor.measure(x)
    np.testing.assert_array_equal(z, sensor.measurement.canonical(z))


def inverting_undoes_measuring(sensor, x):
    """Up to the correction of a bias, which is less than its deviation."""
    seen = sensor.invert(sensor.measure(x))
    error = seen.mean - x
    assert np.all(np.linalg.eigvalsh(seen.cov) > 0)
    assert np.all(np.sum(error * np.linalg.solve(seen.cov, error[..., None])[..., 0], axis=-1) < 1)


def everything(sensor, x, z):
    """What a sensor says about positions (*b, 2) and about returns (*b, m)."""
    seen = sensor.invert(z)
    methods = sensor.measure, sensor.jacobian, sensor.noise, sensor.detects
    return [*(method(x) for method in methods), sensor.clutter(z), seen.mean, seen.cov]


def each(sensor, x, z):
    """The same, one by one."""
    b = x.shape[:-1]
    singles = [everything(sensor, x[i], z[i]) for i in np.ndindex(b)]
    if not singles:
        return [np.empty((0, *np.shape(one))) for one in everything(sensor, np.ones(2), np.ones(2))]
    return [np.reshape(column, (*b, *np.shape(column[0]))) for column in zip(*singles, strict=True)]


LAWS = [
    noise_is_positive_definite,
    jacobian_is_the_derivative,
    a_batch_is_a_loop,
    nothing_is_written_or_kept,
    detection_is_a_probability,
    measurements_are_canonical,
    inverting_undoes_measuring,
]


@pytest.mark.parametrize("sensor", SENSORS)
@pytest.mark.parametrize("law", LAWS)
@PROFILE
@given(data=st.data())
def test_law(law, sensor, data):
    one = data.draw(SENSORS[sensor])
    law(one, data.draw(states(one)))


def test_the_last_bearing_below_half_a_turn_is_canonical():
    x = np.array([-10.0, 5.6655389e-15])
    measurements_are_canonical(RangeBearing(10.0, 0.01), x)
    assert RangeBearing(10.0, 0.01).measure(x)[1] == np.nextafter(np.pi, 0)


# Laws of sensors that stand somewhere.


def only_the_place_relative_to_the_radar_counts(sensor, x):
    """Radar, platform and target moved and turned together: the same return, on its axes in the sensor's own frame."""
    there = sensor.at(Pose(np.array([300.0, -200.0]), heading=0.7))
    here = sensor.at(Pose(np.zeros(2)))
    turned = turn(-0.7, x - np.array([300.0, -200.0]))
    np.testing.assert_allclose(sensor.measurement.difference(there.measure(x), here.measure(turned)), 0 * x, atol=1e-9)
    np.testing.assert_array_equal(there.detects(x), here.detects(turned))


def poses_lead_the_states(sensor, x):
    """Runs (2,) of platforms, each with tracks, or with tracks and points: as run by run."""
    position, heading = np.array([[300.0, -200.0], [-50.0, 1e3]]), np.array([0.7, -2.0])
    for inner in ((), (2,), (4,), (2, 3)):
        runs = np.broadcast_to(x.reshape(-1, 2)[0], (2, *inner, 2)) + np.arange(2.0 * np.prod(inner)).reshape(2, *inner, 1)
        batch = sensor.at(Pose(position, heading=heading))
        z = batch.measure(runs)
        for run in range(2):
            one = sensor.at(Pose(position[run], heading=heading[run]))
            for together, alone in zip(everything(batch, runs, z), everything(one, runs[run], z[run]), strict=True):
                part = together[run] if np.ndim(together) >= np.ndim(alone) + 1 else together
                np.testing.assert_allclose(np.broadcast_to(part, np.shape(alone)), alone, rtol=1e-12)


def nothing_is_seen_out_of_range(sensor, x):
    r = np.linalg.norm(x - np.array([sensor.x, sensor.y]), axis=-1)
    detects, inside = sensor.detects(x), (r > getattr(sensor, "min_range", 0.0)) & (r < sensor.max_range)
    at_an_edge = np.isclose(r, sensor.max_range, rtol=1e-9) | np.isclose(r, getattr(sensor, "min_range", -1.0), rtol=1e-9)
    np.testing.assert_array_equal(detects[~at_an_edge], np.where(inside, sensor.detection_probability, 0.0)[~at_an_edge])


def turn(angle, x):
    """Vectors (*b, 2) turned counter-clockwise."""
    c, s = np.cos(angle), np.sin(angle)
    return x @ np.array([[c, s], [-s, c]])


STANDING = [poses_lead_the_states, nothing_is_seen_out_of_range]


@pytest.mark.parametrize("sensor", [RangeBearing, PolarPosition])
@pytest.mark.parametrize("law", STANDING)
@PROFILE
@given(data=st.data())
def test_standing_law(law, sensor, data):
    one = data.draw(SENSORS[sensor])
    law(one, data.draw(states(one).filter(lambda x: x.size > 0)))


@PROFILE
@given(data=st.data())
def test_only_the_place_relative_to_the_radar_counts(data):
    one = data.draw(SENSORS[RangeBearing].map(lambda sensor: attrs.evolve(sensor, min_range=0.0, max_range=1e6)))
    only_the_place_relative_to_the_radar_counts(one, data.draw(states(one)))


@pytest.mark.parametrize("sensor", [RangeBearing, PolarPosition])
@PROFILE
@given(data=st.data())
def test_a_pose_replaces_where_the_radar_stands(sensor, data):
    one = data.draw(SENSORS[sensor])
    x = data.draw(states(one))
    bare = attrs.evolve(one, x=0.0, y=0.0)
    placed = bare.at(Pose(np.array([one.x, one.y]), heading=getattr(one, "heading", 0.0)))
    z = one.measure(x)
    for fixed, moved in zip(everything(one, x, z), everything(placed, x, z), strict=True):
        np.testing.assert_array_equal(fixed, moved)
    assert placed == bare
    np.testing.assert_array_equal(bare.detects(x), attrs.evolve(bare).detects(x))


# Clutter and conversion of range and bearing.


def clutter_is_uniform_over_the_area(sensor, n, low, high):
    """Expected false returns within any radius, by Gauss-Legendre quadrature over range and bearing."""
    for radius in (low + 0.3 * (high - low), high):
        nodes, weights = np.polynomial.legendre.leggauss(5)
        r = low + (radius - low) * (nodes + 1) / 2
        z = np.stack([r, np.linspace(-3, 3, 5)], axis=-1)
        count = 2 * np.pi * np.sum(weights * sensor.clutter(z)) * (radius - low) / 2
        np.testing.assert_allclose(count, n * (radius**2 - low**2) / (high**2 - low**2), rtol=1e-12)


@PROFILE
@given(st.floats(0.1, 100), st.floats(0, 100), powers_of_ten(2.5, 5))
def test_clutter_is_uniform_over_the_area(n, low, high):
    sensor = RangeBearing(10.0, 0.01, min_range=low, max_range=high, clutter_per_scan=n)
    clutter_is_uniform_over_the_area(sensor, n, low, high)
    edges = sensor.clutter(np.array([[low - 1, 0.0], [low, 0.0], [high, 0.0], [high + 1, 0.0]]))
    np.testing.assert_array_equal(edges, edges[[1, 1, 2, 2]])


def conversion_has_the_moments_it_states(sensor, x):
    """Against Gauss-Hermite quadrature over the errors of range and bearing."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(24)
    deviations = np.sqrt(np.diagonal(sensor.noise(x)))
    errors = np.stack(np.meshgrid(nodes, nodes, indexing="ij"), axis=-1).reshape(-1, 2) * deviations
    w = np.outer(weights, weights).ravel() / (2 * np.pi)
    apart = sensor.invert(sensor.measure(x) + errors).mean - x
    cov = sensor.invert(sensor.measure(x)).cov
    spread = np.sqrt(np.diagonal(cov))
    np.testing.assert_allclose(w @ apart / spread, 0, atol=1e-9)
    np.testing.assert_allclose((apart / spread).T @ (w[:, None] * apart / spread), cov / np.outer(spread, spread), atol=1e-9)


@PROFILE
@given(SENSORS[RangeBearing], st.floats(-np.pi, np.pi), st.floats(0, 4))
def test_conversion_has_the_moments_it_states(sensor, angle, log_range):
    offset = 10.0**log_range * np.array([np.cos(angle), np.sin(angle)])
    conversion_has_the_moments_it_states(sensor, np.array([sensor.x, sensor.y]) + offset)


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


# The noise of polar positions.


def noise_is_that_of_range_and_bearing(sensor, x):
    """Against the rotation written out."""
    dx, dy = x - np.array([sensor.x, sensor.y])
    theta, r = np.arctan2(dy, dx), np.hypot(dx, dy)
    T = np.array([[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]])
    across = (r**2 + sensor.sigma_range**2) * sensor.sigma_bearing**2
    expected = T @ np.diag([sensor.sigma_range**2, across]) @ T.T + sensor.sigma_extent**2 * np.eye(2)
    np.testing.assert_allclose(sensor.noise(x), expected, rtol=0, atol=1e-12 * np.max(expected))


@PROFILE
@given(data=st.data())
def test_polar_noise_is_that_of_range_and_bearing(data):
    sensor = data.draw(SENSORS[PolarPosition])
    noise_is_that_of_range_and_bearing(sensor, data.draw(states(sensor).filter(lambda x: x.size > 0)).reshape(-1, 2)[0])


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


# Mutants.


def mutant(original: Sensor, **changed: Callable[..., Any]) -> Sensor:
    """A sensor with some methods replaced by functions of the original and their arguments."""

    def method(name):
        change = changed.get(name)
        return lambda self, *args: change(original, *args) if change else getattr(original, name)(*args)

    names = ("measure", "jacobian", "noise", "detects", "clutter", "invert", "at")
    spaces = {"kind": "mutant", "observes": original.observes, "measurement": original.measurement}
    sensor = type("Mutant", (Sensor,), {name: method(name) for name in names} | spaces)()
    vars(sensor).update({name: getattr(original, name) for name in attrs.fields_dict(type(original))})
    return sensor


def sign_of_bearing_row(sensor, x):
    return sensor.jacobian(x) * np.array([[1.0, 1.0], [-1.0, -1.0]])


def bearing_of_wrong_sign(sensor, x):
    return sensor.measure(x) * np.array([1.0, -1.0])


def not_wrapped(sensor, x):
    return sensor.measure(x) + np.array([0.0, 2 * np.pi])


def write_in_place(sensor, x):
    x -= 1.0
    return sensor.measure(x)


def remembering():
    calls = []

    def change(sensor, x):
        calls.append(x)
        return sensor.noise(x) * len(calls)

    return change


def biased_conversion(sensor, z, noise=None):
    seen = sensor.invert(z)
    return attrs.evolve(seen, mean=sensor.invert(z, np.diag([sensor.sigma_range**2, 0.0])).mean)


def conversion_to_first_order(sensor, z, noise=None):
    J = np.linalg.inv(sensor.jacobian(sensor.invert(z).mean))
    return attrs.evolve(sensor.invert(z), cov=J @ sensor.noise(z) @ np.swapaxes(J, -1, -2))


def uniform_in_range(sensor, z):
    return np.full(z.shape[:-1], sensor.clutter_per_scan / (2 * np.pi * (sensor.max_range - sensor.min_range)))


def runs_mixed_up(sensor, pose):
    mixed = pose.position[::-1] if pose.position.ndim > 1 else pose.position
    return sensor.at(attrs.evolve(pose, position=mixed))


RANGE_BEARING = RangeBearing(
    10.0, 0.3, detection_probability=0.9, min_range=20.0, max_range=5e3, clutter_per_scan=4.0, x=10.0, y=20.0, heading=0.4
)
POLAR = PolarPosition(10.0, 0.02, 2.0, 0.9, max_range=5e3, x=10.0, y=20.0)
MUTANTS = [
    (noise_is_positive_definite, RANGE_BEARING, {"noise": lambda s, x: np.diag([s.sigma_range**2, -(s.sigma_bearing**2)])}),
    (noise_is_positive_definite, POLAR, {"noise": lambda s, x: s.noise(x) + np.array([[0, 1e-9], [0, 0]])}),
    (jacobian_is_the_derivative, RANGE_BEARING, {"jacobian": sign_of_bearing_row}),
    (jacobian_is_the_derivative, RANGE_BEARING, {"measure": bearing_of_wrong_sign}),
    (jacobian_is_the_derivative, POLAR, {"jacobian": lambda s, x: np.eye(2)[::-1]}),
    (a_batch_is_a_loop, POLAR, {"noise": lambda s, x: s.noise(x.reshape(-1, 2)[0])}),
    (a_batch_is_a_loop, RANGE_BEARING, {"detects": lambda s, x: s.detects(x - 4e3 * (x.ndim - 1))}),
    (nothing_is_written_or_kept, RANGE_BEARING, {"measure": write_in_place}),
    (nothing_is_written_or_kept, POLAR, {"noise": remembering()}),
    (detection_is_a_probability, POLAR, {"detects": lambda s, x: 1.2 * s.detects(x)}),
    (measurements_are_canonical, RANGE_BEARING, {"measure": not_wrapped}),
    (inverting_undoes_measuring, RANGE_BEARING, {"measure": bearing_of_wrong_sign}),
    (inverting_undoes_measuring, RANGE_BEARING, {"invert": lambda s, z: s.at(Pose(np.zeros(2))).invert(z)}),
    (only_the_place_relative_to_the_radar_counts, RANGE_BEARING, {"at": lambda s, pose: s.at(Pose(pose.position))}),
    (only_the_place_relative_to_the_radar_counts, RANGE_BEARING, {"at": lambda s, pose: s}),
    (poses_lead_the_states, RANGE_BEARING, {"at": runs_mixed_up}),
    (poses_lead_the_states, POLAR, {"at": runs_mixed_up}),
    (nothing_is_seen_out_of_range, POLAR, {"detects": lambda s, x: np.full(x.shape[:-1], s.detection_probability)}),
    (conversion_has_the_moments_it_states, RANGE_BEARING, {"invert": biased_conversion}),
    (conversion_has_the_moments_it_states, RANGE_BEARING, {"invert": conversion_to_first_order}),
    (noise_is_that_of_range_and_bearing, POLAR, {"noise": lambda s, x: s.noise(x) * np.array([[1, -1], [-1, 1]])}),
    (noise_is_that_of_range_and_bearing, POLAR, {"noise": lambda s, x: attrs.evolve(s, sigma_extent=0.0).noise(x)}),
]


@pytest.mark.parametrize(("law", "original", "changed"), MUTANTS, ids=lambda value: getattr(value, "__name__", None))
def test_law_bites(law, original, changed):
    one_place = law in (conversion_has_the_moments_it_states, noise_is_that_of_range_and_bearing)
    x = np.array([[400.0, 300.0], [-900.0, 8e3], [70.0, -3e3]])[0 if one_place else slice(None)]
    law(original, x.copy())
    with pytest.raises(AssertionError):
        law(mutant(original, **changed), x)


def test_the_law_of_clutter_bites():
    clutter_is_uniform_over_the_area(RANGE_BEARING, 4.0, 20.0, 5e3)
    with pytest.raises(AssertionError):
        clutter_is_uniform_over_the_area(mutant(RANGE_BEARING, clutter=uniform_in_range), 4.0, 20.0, 5e3)


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
