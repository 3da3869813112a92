"""Declared units follow from the formulas: in other units of time and length, a motion model is the same motion."""

import numpy as np
import pytest
from attrs import evolve, fields

from vedette.config.registry import Registry
from vedette.space import Space

OWN = {"random_walk": "m/s^0.5", "random_walk_piecewise": "m/s", "gauss_markov": "m"}
"""Units of `sigma` where it is in that of the axes, which the config states."""
GIVEN = {
    "constant_velocity": {"sigma_accel": 0.7},
    "constant_velocity_piecewise": {"sigma_accel": 0.7},
    "constant_acceleration": {"sigma_jerk": 0.3},
    "constant_acceleration_piecewise": {"sigma_jerk": 0.3},
    "wiener_acceleration_piecewise": {"sigma_change": 0.4},
    "singer": {"tau": 7.0, "sigma_accel": 0.5},
    "ornstein_uhlenbeck": {"tau": 30.0, "sigma_speed": 4.0},
    "known_turn": {"turn_rate": 0.1, "sigma_accel": 0.7},
    "coordinated_turn": {"sigma_accel": 0.7, "sigma_turn_rate": 0.02},
    "coordinated_turn_3d": {"sigma_accel": 0.7, "sigma_turn_rate": 0.02},
    "coordinated_turn_piecewise": {"sigma_accel": 0.7, "sigma_turn_accel": 0.02},
    "curvilinear": {"sigma_tangential": 0.2, "sigma_normal": 0.3},
    "random_walk": {"sigma": 0.5},
    "random_walk_piecewise": {"sigma": 0.5},
    "gauss_markov": {"sigma": 0.5, "tau": 20.0, "axes": ["x", "y"]},
    "image_velocity": {"sigma_accel": 300.0, "shake": 150.0},
    "target_oriented": {"sigma_forward": 0.5, "sigma_side": 2.0, "side_accel": 1.5},
}
TIME, LENGTH = 3.7, 2.3
"""How many seconds and metres the other units have."""


def factor(unit):
    """By how much a number in a unit changes with the units of time and length: "m/s^1.5" has powers 1 and -1.5."""
    found = 1.0
    for i, part in enumerate(unit.removesuffix(" mod 2pi").split("/")):
        name, _, power = part.partition("^")
        assert name in ("1", "rad", "m", "px", "s"), unit
        if name in ("m", "px", "s"):
            found *= (TIME if name == "s" else LENGTH) ** ((1.0 if i else -1.0) * float(power or 1.0))
    return found


def in_other_units(motion, units):
    changed = {
        field.name: getattr(motion, field.name) * factor(units[field.name])
        for field in fields(type(motion))
        if field.name in units and field.init
    }
    return evolve(motion, **changed)


def off(motion, units, x, dt):
    """By how much noise, Jacobian and move differ at worst, of their largest element along each pair of axes."""
    other, scale = in_other_units(motion, units), np.array([factor(axis.unit) for axis in motion.state.axes])
    y, step = x * scale, dt * factor("s")
    pairs = [
        (motion.noise(x, dt) * scale[:, None] * scale, other.noise(y, step)),
        (motion.jacobian(x, dt) * scale[:, None] / scale, other.jacobian(y, step)),
        (motion.move(x, dt) * scale, other.move(y, step)),
    ]
    return max(float(np.max(np.abs(a - b)) / np.max(np.abs(a))) for a, b in pairs)


def made(kind):
    cls = Registry.installed().find("motion", kind).cls
    given = {name: tuple(value) if isinstance(value, list) else value for name, value in GIVEN[kind].items()}
    motion = cls(**given)
    units = {
        field.name: field.metadata["unit"] for field in fields(cls) if field.metadata.get("unit") not in (None, "", "1")
    }
    if kind in OWN:
        units["sigma"] = OWN[kind]
    rng = np.random.default_rng(0)
    sizes = {"m": 500.0, "px": 500.0, "m/s": 20.0, "px/s": 20.0, "m/s^2": 2.0, "rad/s": 0.2}
    x = np.array([sizes[axis.unit] for axis in motion.state.axes]) * rng.uniform(0.5, 1.5, len(motion.state.axes))
    return motion, units, x


@pytest.mark.parametrize("kind", GIVEN)
def test_it_is_the_same_motion_in_other_units(kind):
    motion, units, x = made(kind)
    for dt in (0.5, 4.0):
        assert off(motion, units, x, dt) < 1e-6


@pytest.mark.parametrize("kind", GIVEN)
def test_another_power_of_seconds_is_noticed(kind):
    """Each parameter alone, half a power off: as a noise's density is taken for its deviation."""
    motion, units, x = made(kind)
    for name in units:
        if name == "slowest":  # plays no part at speed
            continue
        assert off(motion, units | {name: f"{units[name]}/s^0.5"}, x, 4.0) > 1e-3, name


def test_all_kinds_whose_parameters_have_units_are_here():
    """Others hold parts, matrices or pictures, whose numbers are in the units of the axes that are given with them."""
    rest = {"linear", "product"}
    standard = {
        each.kind for each in Registry.installed().of_role("motion") if each.cls.__module__.startswith("vedette_standard")
    }
    assert standard - rest <= set(GIVEN)


def test_the_reader_of_units_reads_them():
    assert factor("m/s^1.5") == pytest.approx(TIME**1.5 / LENGTH)
    assert factor("rad/s^2") == pytest.approx(TIME**2)
    assert factor(Space.of(h="rad mod 2pi").axes[0].unit) == 1.0
