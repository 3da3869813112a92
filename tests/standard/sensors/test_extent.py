"""An extended target's noise: the same for a radar of ranges and bearings as for one of positions, and the laws hold."""

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.laws_of_sensors import (
    LAWS,
    PROFILE,
    SENSORS,
    only_the_place_relative_to_the_radar_counts,
    poses_lead_the_states,
    states,
)
from vedette_standard.sensors.polar_position import PolarPosition
from vedette_standard.sensors.range_bearing import RangeBearing

EXTENDED = st.builds(
    lambda sensor, extent: attrs.evolve(sensor, sigma_extent=extent), SENSORS[RangeBearing], st.floats(0.1, 30.0)
)


@pytest.mark.parametrize("law", [*LAWS, poses_lead_the_states])
@PROFILE
@given(data=st.data())
@pytest.mark.by_turns
def test_law(law, data):
    sensor = data.draw(EXTENDED)
    law(sensor, data.draw(states(sensor).filter(lambda x: x.size > 0)))


def test_a_processor_may_round_otherwise_in_a_batch():
    """A noise of 290 m^2 is correlated by .003 m^2, the difference of two large numbers, of which AVX-512 misses 1e-12."""
    sensor = RangeBearing(1.0, 0.0006493816315762113, y=-496.0, sigma_extent=17.0)
    poses_lead_the_states(sensor, np.array([10.0, -496.0]))


@PROFILE
@given(data=st.data())
def test_only_the_place_relative_to_the_radar_counts(data):
    sensor = attrs.evolve(data.draw(EXTENDED), min_range=0.0, max_range=1e6)
    only_the_place_relative_to_the_radar_counts(sensor, data.draw(states(sensor)))


def test_it_is_that_of_positions_to_first_order():
    """R in range and bearing, carried over to positions by J, is the noise of `polar_position`."""
    x = np.array([[300.0, 400.0], [-2000.0, 100.0], [50.0, -60.0]])
    split, flat = RangeBearing(10.0, 1e-3, sigma_extent=2.0), PolarPosition(10.0, 1e-3, sigma_extent=2.0)
    J = np.linalg.inv(split.jacobian(x))
    carried = J @ split.noise(x) @ np.swapaxes(J, -1, -2)
    np.testing.assert_allclose(carried, flat.noise(x), rtol=0, atol=2e-3 * 104)
    np.testing.assert_allclose(split.invert(split.measure(x)).cov, flat.noise(x), rtol=0, atol=2e-3 * 104)
    without = attrs.evolve(split, sigma_extent=0.0)
    assert np.max(np.abs(J @ without.noise(x) @ np.swapaxes(J, -1, -2) - flat.noise(x))) > 3.0


def test_a_point_has_one_noise_for_all_places():
    assert RangeBearing(10.0, 0.02).noise(np.zeros((5, 2))).shape == (2, 2)
    over = RangeBearing(10.0, 0.02, sigma_extent=3.0).noise(np.zeros(2))
    np.testing.assert_allclose(over, np.diag([109.0, 0.02**2 + 1.0]))
