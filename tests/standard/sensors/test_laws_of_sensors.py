"""The laws of sensors, on every one of the standard plugin; and mutants that each law must catch."""

from collections.abc import Callable
from typing import Any

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.laws_of_sensors import (
    LAWS,
    PROFILE,
    SENSORS,
    STANDING,
    a_batch_is_a_loop,
    clutter_is_uniform_over_the_area,
    conversion_has_the_moments_it_states,
    detection_is_a_probability,
    everything,
    inverting_undoes_measuring,
    jacobian_is_the_derivative,
    measurements_are_canonical,
    noise_is_positive_definite,
    noise_is_that_of_range_and_bearing,
    nothing_is_seen_out_of_range,
    nothing_is_written_or_kept,
    only_the_place_relative_to_the_radar_counts,
    poses_lead_the_states,
    powers_of_ten,
    states,
)
from vedette import Pose, Sensor
from vedette_standard.sensors.polar_position import PolarPosition
from vedette_standard.sensors.range_bearing import RangeBearing


@pytest.mark.parametrize("sensor", SENSORS)
@pytest.mark.parametrize("law", LAWS)
@PROFILE
@given(data=st.data())
@pytest.mark.by_turns
def test_law(law, sensor, data):
    one = data.draw(SENSORS[sensor])
    law(one, data.draw(states(one)))


def test_the_last_bearing_below_half_a_turn_is_canonical():
    x = np.array([-10.0, 5.6655389e-15])
    measurements_are_canonical(RangeBearing(10.0, 0.01), x)
    assert RangeBearing(10.0, 0.01).measure(x)[1] == np.nextafter(np.pi, 0)


@pytest.mark.parametrize("sensor", [RangeBearing, PolarPosition])
@pytest.mark.parametrize("law", STANDING)
@PROFILE
@given(data=st.data())
@pytest.mark.by_turns
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
@pytest.mark.by_turns
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


@PROFILE
@given(st.floats(0.1, 100), st.floats(0, 100), powers_of_ten(2.5, 5))
def test_clutter_is_uniform_over_the_area(n, low, high):
    sensor = RangeBearing(10.0, 0.01, min_range=low, max_range=high, clutter_per_scan=n)
    clutter_is_uniform_over_the_area(sensor, n, low, high)
    edges = sensor.clutter(np.array([[low - 1, 0.0], [low, 0.0], [high, 0.0], [high + 1, 0.0]]))
    np.testing.assert_array_equal(edges, edges[[1, 1, 2, 2]])


@PROFILE
@given(SENSORS[RangeBearing], st.floats(-np.pi, np.pi), st.floats(0, 4))
def test_conversion_has_the_moments_it_states(sensor, angle, log_range):
    offset = 10.0**log_range * np.array([np.cos(angle), np.sin(angle)])
    conversion_has_the_moments_it_states(sensor, np.array([sensor.x, sensor.y]) + offset)


@PROFILE
@given(data=st.data())
def test_polar_noise_is_that_of_range_and_bearing(data):
    sensor = data.draw(SENSORS[PolarPosition])
    noise_is_that_of_range_and_bearing(sensor, data.draw(states(sensor).filter(lambda x: x.size > 0)).reshape(-1, 2)[0])


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
