"""The further sensors against geometry written out, integration, and each other. The kit holds their laws."""

import re

import attrs
import numpy as np
import pytest

from vedette import Detections, Gaussian, Pose, kernels
from vedette.filters.gaussian import linearised
from vedette_standard.sensors.bearing_only import BearingOnly
from vedette_standard.sensors.biased import Biased
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.position_velocity import PositionVelocity
from vedette_standard.sensors.range_bearing import RangeBearing
from vedette_standard.sensors.range_bearing_elevation import RangeBearingElevation
from vedette_standard.sensors.range_bearing_rate import RangeBearingRate
from vedette_standard.sensors.range_only import RangeOnly

DOPPLER = RangeBearingRate(10.0, 0.01, 0.5, crossing_speed=8.0)
SPACE = RangeBearingElevation(10.0, 0.02, 0.03, z=15.0)
POSE = Pose(np.array([300.0, -200.0]), np.array([4.0, -3.0]), 0.7)


def test_parts_of_range_and_bearing_are_those_of_the_radar():
    x = np.random.default_rng(0).normal(size=(4, 3, 2)) * 1e3
    radar = RangeBearing(10.0, 0.01).at(POSE)
    for sensor, row in ((RangeOnly(10.0), 0), (BearingOnly(0.01), 1)):
        there = sensor.at(POSE)
        np.testing.assert_array_equal(there.measure(x)[..., 0], radar.measure(x)[..., row])
        np.testing.assert_array_equal(there.jacobian(x)[..., 0, :], radar.jacobian(x)[..., row, :])
        assert there.noise(x)[0, 0] == radar.noise(x)[row, row]
        with pytest.raises(NotImplementedError, match=r"one return of '.*' does not give a position"):
            sensor.invert(np.zeros((2, 1)))


def rate_is_that_of_the_range(sensor, pose, x):
    """Differences in time of the distance between target and platform, both moving on."""
    h = 1e-3
    ends = [np.hypot(*(x[..., :2] + s * x[..., 2:] - pose.position - s * np.asarray(pose.velocity)).T) for s in (h, -h)]
    np.testing.assert_allclose(sensor.at(pose).measure(x)[..., 2], (ends[0] - ends[1]) / (2 * h), rtol=1e-6, atol=1e-6)


def test_range_rate_is_the_derivative_of_the_range():
    x = np.random.default_rng(1).normal(size=(6, 4)) * [1e3, 1e3, 20, 20]
    rate_is_that_of_the_range(DOPPLER, POSE, x)

    class Ashore:
        """A mutant that forgets that its platform moves."""

        def at(self, pose):
            return DOPPLER.at(attrs.evolve(pose, velocity=None))

    with pytest.raises(AssertionError):
        rate_is_that_of_the_range(Ashore(), POSE, x)


def test_doppler_over_the_radar_is_finite():
    x = np.array([[0.0, 0, 5, 3], [1e-9, 0, 5, 3], [0.5e-3, 0, 5, 3], [1.0, 0, 5, 3]])
    assert DOPPLER.measure(x)[0].tolist() == [0.0, 0.0, 0.0]
    assert np.all(np.isfinite(DOPPLER.jacobian(x)))
    slope = kernels.numerical_jacobian(DOPPLER.measure, x[3], DOPPLER.measurement.difference)
    np.testing.assert_allclose(DOPPLER.jacobian(x[3]), slope, atol=1e-5)


def test_a_doppler_return_starts_with_the_speed_along_the_line_of_sight():
    x = np.array([[800.0, 500.0, -10.0, 7.0], [-300.0, 1e3, 3.0, 4.0]])
    there = DOPPLER.at(POSE)
    found = there.invert(there.measure(x))
    los = x[:, :2] - POSE.position
    los /= np.hypot(*los.T)[:, None]
    across = np.stack([-los[:, 1], los[:, 0]], axis=-1)
    np.testing.assert_allclose(np.sum(found.mean[:, 2:] * los, axis=-1), np.sum(x[:, 2:] * los, axis=-1), rtol=1e-12)
    np.testing.assert_allclose(np.sum(found.mean[:, 2:] * across, axis=-1), 0, atol=1e-12)
    speed = found.cov[:, 2:, 2:]
    np.testing.assert_allclose(np.einsum("bi,bij,bj->b", los, speed, los), 0.5**2, rtol=1e-9)
    np.testing.assert_allclose(np.einsum("bi,bij,bj->b", across, speed, across), 64.0, rtol=0.01)
    np.testing.assert_array_equal(
        found.cov[:, :2, :2], RangeBearing(10.0, 0.01).at(POSE).invert(there.measure(x)[:, :2]).cov
    )


# In space.


def test_range_bearing_and_elevation_are_spherical_coordinates():
    r, b, e = 900.0, 0.4, -0.3
    there = SPACE.at(POSE)
    place = np.array([300.0, -200.0, 15.0])
    ahead = np.array([np.cos(b + 0.7) * np.cos(e), np.sin(b + 0.7) * np.cos(e), np.sin(e)])
    np.testing.assert_allclose(there.measure(place + r * ahead), [r, b, e], rtol=1e-13)
    np.testing.assert_allclose(there.invert(np.array([[r, b, e]])).mean[0], place + r * ahead, rtol=1e-13)
    aloft = SPACE.at(Pose(np.array([300.0, -200.0, 500.0]), heading=0.7))
    np.testing.assert_allclose(aloft.measure(place + r * ahead + [0, 0, 485]), [r, b, e], rtol=1e-13)


def inversion_has_the_moments_it_states(sensor, z):
    """Against Gauss-Hermite quadrature over the errors of range, bearing and elevation."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(16)
    grid = np.stack(np.meshgrid(nodes, nodes, nodes, indexing="ij"), axis=-1).reshape(-1, 3)
    w = np.prod(np.stack(np.meshgrid(weights, weights, weights, indexing="ij"), axis=-1).reshape(-1, 3), axis=-1)
    w /= np.sum(w)
    found = sensor.invert(z[None])
    true = z + grid * np.sqrt(np.diag(sensor.noise(z)))
    r, b, e = true.T
    apart = np.stack([r * np.cos(b) * np.cos(e), r * np.sin(b) * np.cos(e), r * np.sin(e)], axis=-1)
    apart = apart + [sensor.x, sensor.y, sensor.z] - found.mean
    scale = np.sqrt(np.diagonal(found.cov[0]))
    square = (apart / scale).T @ (w[:, None] * apart / scale)
    np.testing.assert_allclose(found.cov[0] / np.outer(scale, scale), square, rtol=0, atol=1e-9)
    assert np.linalg.eigvalsh(found.cov[0] / np.outer(scale, scale))[0] > 0


@pytest.mark.parametrize("z", [[900.0, 0.4, -0.3], [5e4, -3.0, 1.2], [0.0, 0.0, 0.0], [500.0, 1.0, np.pi / 2]])
def test_a_return_in_space_states_the_mean_square_of_its_error(z):
    inversion_has_the_moments_it_states(SPACE, np.array(z))


def test_the_law_of_inversion_bites():
    class Naive:
        """To first order in the errors, as J R J'."""

        x = y = 0.0
        z = 15.0
        noise = staticmethod(SPACE.noise)

        def invert(self, z):
            found = SPACE.invert(z)
            J = np.linalg.inv(SPACE.jacobian(found.mean))
            return Gaussian(found.mean, J @ SPACE.noise(z) @ np.swapaxes(J, -1, -2))

    with pytest.raises(AssertionError):
        inversion_has_the_moments_it_states(Naive(), np.array([900.0, 0.4, -0.3]))


# Clutter: densities that integrate to the number of false returns.


def expected_count(sensor, axes):
    """The integral of a density over a box by Gauss-Legendre quadrature, ten nodes an axis."""
    nodes, weights = np.polynomial.legendre.leggauss(10)
    sides = [low + (high - low) * (nodes + 1) / 2 for low, high in axes]
    z = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, len(axes))
    w = np.prod(np.stack(np.meshgrid(*[weights] * len(axes), indexing="ij"), axis=-1).reshape(-1, len(axes)), axis=-1)
    return float(np.sum(w * sensor.clutter(z)) * np.prod([(high - low) / 2 for low, high in axes]))


AREA = {"min_range": 50.0, "max_range": 4e3, "clutter_per_scan": 7.0}
TURN = (-np.pi, np.pi)


@pytest.mark.parametrize(
    ("sensor", "axes"),
    [
        (BearingOnly(0.01, clutter_per_scan=7.0), [TURN]),
        (RangeOnly(10.0, **AREA), [(50.0, 4e3)]),
        (RangeBearingRate(10.0, 0.01, 0.5, max_rate=60.0, **AREA), [(50.0, 4e3), TURN, (-60.0, 60.0)]),
        (RangeBearingElevation(10.0, 0.02, 0.03, **AREA), [(50.0, 4e3), TURN, (-np.pi / 2, np.pi / 2)]),
    ],
    ids=lambda value: getattr(value, "kind", ""),
)
def test_clutter_integrates_to_its_number(sensor, axes):
    assert expected_count(sensor, axes) == pytest.approx(7.0, rel=1e-9)
    assert sensor.clutter(np.full(len(axes), 0.1)) >= 0
    if len(axes) > 1 or sensor.kind == "range_only":
        inner = [(50.0, 2e3), *axes[1:]]
        power = 3 if sensor.kind == "range_bearing_elevation" else 2
        share = (2e3**power - 50**power) / (4e3**power - 50**power)
        assert expected_count(sensor, inner) == pytest.approx(7.0 * share, rel=1e-9)


def test_nothing_is_seen_beyond_the_limits():
    x = np.array([[30.0, 0, 0, 0], [300.0, 0, 0, 0], [5e3, 0, 0, 0]])
    for sensor in (BearingOnly(0.01), RangeOnly(10.0), DOPPLER, SPACE):
        limited = attrs.evolve(sensor, detection_probability=0.8, min_range=50.0, max_range=4e3)
        assert limited.detects(x[:, : len(sensor.observes)]).tolist() == [0.0, 0.8, 0.0]
        assert float(attrs.evolve(sensor, detection_probability=0.8).detects(x[:, : len(sensor.observes)])) == 0.8
    overhead = attrs.evolve(SPACE, max_range=4e3)
    assert overhead.detects(np.array([[0.0, 0.0, 3.9e3], [0.0, 0.0, 4.1e3]])).tolist() == [1.0, 0.0]


# On platforms.


@pytest.mark.parametrize("sensor", [BearingOnly(0.01), RangeOnly(10.0), DOPPLER, SPACE], ids=lambda s: s.kind)
def test_runs_of_platforms_are_run_by_run(sensor):
    rng = np.random.default_rng(5)
    n = len(sensor.observes)
    pose = Pose(rng.normal(size=(3, 2)) * 100, rng.normal(size=(3, 2)), rng.normal(size=3))
    x = rng.normal(size=(3, 4, n)) * 300
    batch = sensor.at(pose)
    for i in range(3):
        one = sensor.at(Pose(pose.position[i], pose.velocity[i], pose.heading[i]))
        np.testing.assert_allclose(batch.measure(x)[i], one.measure(x[i]), rtol=1e-12)
        np.testing.assert_allclose(batch.jacobian(x)[i], one.jacobian(x[i]), rtol=1e-12)
        if sensor.kind not in ("bearing_only", "range_only"):
            z = one.measure(x[i])
            np.testing.assert_allclose(batch.invert(batch.measure(x)).mean[i], one.invert(z).mean, rtol=1e-12)
            np.testing.assert_allclose(batch.invert(batch.measure(x)).cov[i], one.invert(z).cov, rtol=1e-9)


def test_only_the_place_relative_to_the_platform_counts():
    """Platform and target moved, turned and sped up together: the same return."""
    rng = np.random.default_rng(6)
    x = rng.normal(size=(5, 4)) * [1e3, 1e3, 20, 20]
    c, s = np.cos(0.7), np.sin(0.7)
    T = np.array([[c, -s], [s, c]])
    moved = np.concatenate([x[:, :2] @ T.T + POSE.position, x[:, 2:] @ T.T + POSE.velocity], axis=-1)
    for sensor in (BearingOnly(0.01), RangeOnly(10.0), DOPPLER):
        n = len(sensor.observes)
        apart = sensor.measurement.difference(sensor.at(POSE).measure(moved[:, :n]), sensor.measure(x[:, :n]))
        np.testing.assert_allclose(apart, 0, atol=1e-9)


def test_position_and_velocity_are_taken_as_they_are():
    sensor = PositionVelocity(5.0, 0.5, clutter_density=1e-9)
    z = np.array([[1.0, 2, 3, 4]])
    assert sensor.at(POSE) is sensor
    np.testing.assert_array_equal(sensor.measure(z), z)
    np.testing.assert_array_equal(sensor.invert(z).cov[0], np.diag([25.0, 25.0, 0.25, 0.25]))
    np.testing.assert_array_equal(sensor.invert(z, np.eye(4)[None]).cov[0], np.eye(4))


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
    with pytest.raises(
        NotImplementedError, match=re.escape("`spread` does not state the standard deviation of turned, long")
    ):
        TURNED.invert(np.zeros((1, 2)))


def test_a_linear_bias_is_linear():
    shifted = Biased(CartesianPosition(3.0), offset={"x": "north"})
    assert shifted.linear
    assert not SHIFTED.linear
    assert not Biased(CartesianPosition(3.0), lag="late").linear


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Biased(RADAR, add={"x": "a"}), "add.x: must be one of range, bearing"),
        (lambda: Biased(RADAR, offset={"vx": "a"}), "offset.vx: must be one of x, y"),
        (lambda: Biased(RADAR, add={"range": "a", "bearing": "a"}), "biases: each needs a state axis of its own"),
        (lambda: Biased(RADAR, offset={"x": "y"}), "biases: each needs a state axis of its own"),
        (lambda: BearingOnly(2.0), "sigma_bearing: must be > 0 and <= 1, got 2 rad"),
        (lambda: RangeOnly(1.0, clutter_per_scan=3.0), "clutter_per_scan: needs max_range"),
        (lambda: RangeBearingRate(1.0, 0.1, 1.0, clutter_per_scan=3.0, max_range=9.0), "clutter_per_scan: needs max_rate"),
        (lambda: RangeOnly(1.0, min_range=9.0, max_range=3.0), "max_range: must be > min_range, 9 m, got 3 m"),
    ],
)
def test_a_wrong_parameter_is_named_with_what_would_be_right(make, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        make()


def test_an_update_learns_a_bias_with_the_place_known():
    """A place known to the metre and a bearing without error: the bias takes the whole residual."""
    sensor = Biased(RangeBearing(10.0, 1e-6), add={"bearing": "turned"})
    mean = np.array([[800.0, 500.0, 0.0]])
    belief = Gaussian(mean, np.diag([1e-6, 1e-6, 0.05**2])[None])
    z = RangeBearing(10.0, 1e-6).measure(mean[:, :2]) + [0.0, -0.033]
    told = linearised(belief, sensor.observes, sensor, Detections.of(z), 1.0)
    np.testing.assert_allclose(told.detail.shift[0, 0, 2], -0.033, rtol=1e-5)
