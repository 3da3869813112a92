"""The laws of sensors: each takes a sensor and states (*b, 2)."""

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from vedette import Pose, Sensor, kernels
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.polar_position import PolarPosition
from vedette_standard.sensors.range_bearing import RangeBearing

PROFILE = settings(max_examples=40)


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
    PolarPosition: st.builds(
        PolarPosition,
        **RADAR,
        sigma_extent=st.floats(0, 10),
        min_range=st.floats(0.5, 100),
        clutter_per_scan=st.floats(0, 100),
        clutter_uniform_over=st.sampled_from(["area", "range"]),
    )
    | st.builds(PolarPosition, **RADAR, sigma_extent=st.floats(0, 10), clutter_density=powers_of_ten(-9, -3)),
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


def within_rounding(one, other):
    """What is nearly 0 may be the difference of two large numbers, which some processors round otherwise in a batch."""
    np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-14 * np.max(np.abs(other), initial=0.0))


def a_batch_is_a_loop(sensor, x):
    z = sensor.measure(x)
    assert z.shape == (*x.shape[:-1], len(sensor.measurement))
    for together, alone in zip(everything(sensor, x, z), each(sensor, x, z), strict=True):
        within_rounding(np.broadcast_to(together, alone.shape), alone)


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
                within_rounding(np.broadcast_to(part, np.shape(alone)), alone)


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


# Clutter and conversion of range and bearing.
def clutter_is_uniform_over_the_area(sensor, n, low, high):
    """Expected false returns within any radius, by Gauss-Legendre quadrature over range and bearing."""
    for radius in (low + 0.3 * (high - low), high):
        nodes, weights = np.polynomial.legendre.leggauss(5)
        r = low + (radius - low) * (nodes + 1) / 2
        z = np.stack([r, np.linspace(-3, 3, 5)], axis=-1)
        count = 2 * np.pi * np.sum(weights * sensor.clutter(z)) * (radius - low) / 2
        np.testing.assert_allclose(count, n * (radius**2 - low**2) / (high**2 - low**2), rtol=1e-12)


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


# The noise of polar positions.
def noise_is_that_of_range_and_bearing(sensor, x):
    """Against the rotation written out."""
    dx, dy = x - np.array([sensor.x, sensor.y])
    theta, r = np.arctan2(dy, dx), np.hypot(dx, dy)
    T = np.array([[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]])
    across = (r**2 + sensor.sigma_range**2) * sensor.sigma_bearing**2
    expected = T @ np.diag([sensor.sigma_range**2, across]) @ T.T + sensor.sigma_extent**2 * np.eye(2)
    np.testing.assert_allclose(sensor.noise(x), expected, rtol=0, atol=1e-12 * np.max(expected))
