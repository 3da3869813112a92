"""The further sensors against geometry written out, integration, and each other. The kit holds their laws."""

import re

import attrs
import numpy as np
import pytest

from vedette import Pose
from vedette_standard.sensors.bearing_only import BearingOnly
from vedette_standard.sensors.biased import Biased
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
        with pytest.raises(NotImplementedError, match=r"one return of '.*' does not"):
            sensor.invert(np.zeros((2, 1)))


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
