"""Ships against integration."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

import vedette_sim as sim
from vedette import Array


def integrated(ship: sim.Ship, times: Array) -> Array:
    """x, y, vx, vy of a ship by numerical integration, leg after leg."""
    state = np.array([*ship.start, ship.course, ship.speed])
    begin, rows = ship.appears, np.full((len(times), 4), np.nan)
    for leg in (*ship.legs, None):
        speed = state[3]
        rate, accel, seconds = 0.0, 0.0, 1e4
        if leg is not None:
            rate = (
                leg.rate if leg.rate is not None else (leg.lateral_accel / speed if leg.lateral_accel is not None else 0.0)
            )
            accel = leg.accel or 0.0
            seconds = leg.seconds
            if leg.do == "stop":
                accel, seconds = -leg.decel, speed / leg.decel
        here = (times >= begin) & (times <= begin + seconds)

        def motion(_: float, s: Array, rate: float = rate, accel: float = accel) -> list[float]:
            return [s[3] * np.cos(s[2]), s[3] * np.sin(s[2]), rate, accel]

        if seconds > 0:
            at = np.append(times[here], begin + seconds)
            path = solve_ivp(motion, (begin, begin + seconds), state, t_eval=at, rtol=1e-11, atol=1e-9).y.T
            s = path[:-1]
            rows[here] = np.column_stack([s[:, 0], s[:, 1], s[:, 3] * np.cos(s[:, 2]), s[:, 3] * np.sin(s[:, 2])])
            state, begin = path[-1], begin + seconds
            state[3] = 0.0 if leg is not None and leg.do == "stop" else state[3]
    return rows


seconds = st.floats(1.0, 60.0)
legs = st.one_of(
    st.builds(sim.Leg, do=st.just("straight"), seconds=seconds),
    st.builds(sim.Leg, do=st.just("turn"), seconds=seconds, rate=st.floats(-0.2, 0.2)),
    st.builds(sim.Leg, do=st.just("turn"), seconds=seconds, rate=st.sampled_from([0.0, 1e-9, -1e-6])),
    st.builds(sim.Leg, do=st.just("turn"), seconds=seconds, lateral_accel=st.floats(-1.0, 1.0)),
    st.builds(sim.Leg, do=st.just("accelerate"), seconds=seconds, accel=st.floats(0.0, 0.3)),
    st.builds(sim.Leg, do=st.just("accelerate"), seconds=st.floats(1, 10), accel=st.floats(-0.1, 0.0)),
)


@settings(max_examples=60)
@given(course=st.floats(-4, 4), speed=st.floats(8, 20), before=st.lists(legs, max_size=4), after=st.lists(legs, max_size=1))
@pytest.mark.costly
def test_a_ship_goes_where_integration_takes_it(course, speed, before, after):
    stop = sim.Leg("stop", decel=0.4)
    after = [leg for leg in after if leg.lateral_accel is None and (leg.accel or 0.0) >= 0]
    ship = sim.Ship(start=[100, -50], course=course, speed=speed, legs=(*before, stop, *after), appears=7.0)
    times = np.linspace(7.0, 400.0, 57)
    np.testing.assert_allclose(ship.states(times), integrated(ship, times), atol=1e-5)


def test_a_turn_by_lateral_acceleration_is_a_circle_of_radius_speed_squared_over_it():
    legs = (sim.Leg("accelerate", 10, accel=0.5), sim.Leg("turn", 100, lateral_accel=0.5))
    states = sim.Ship(start=[-75, 0], course=0.0, speed=5.0, legs=legs).states(np.linspace(10, 110, 33))
    np.testing.assert_allclose(np.hypot(states[:, 0], states[:, 1] - 200.0), 200.0, rtol=1e-12)
    np.testing.assert_allclose(np.hypot(states[:, 2], states[:, 3]), 10.0, rtol=1e-12)


def test_a_ship_that_stopped_rests_and_keeps_its_heading():
    legs = (sim.Leg("stop", decel=0.3), sim.Leg("straight", 20), sim.Leg("accelerate", 5, accel=1))
    ship = sim.Ship(start=[0, 0], course="30 deg", speed="10.1 kn", legs=legs)
    speed = 10.1 * 1852 / 3600
    rest = ship.states(np.array([speed / 0.3, speed / 0.3 + 10, speed / 0.3 + 19]))
    assert np.all(rest[:, 2:] == 0)
    np.testing.assert_allclose(np.hypot(*rest[0, :2]), speed**2 / 0.6)
    assert np.all(rest == rest[0])
    np.testing.assert_allclose(ship.heading(np.array([0.0, speed / 0.3 + 10, 90.0])), np.pi / 6)
    np.testing.assert_allclose(ship.states(np.array([90.0]))[0, 2:], 5 * np.array([np.cos(np.pi / 6), 0.5]))
