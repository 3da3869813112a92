"""Laws of sensors on platforms: what is seen from a pose is what is seen at home of a target that is moved back."""

from __future__ import annotations

import numpy as np

from vedette.roles import Sensor
from vedette.space import Array, Space
from vedette.testing.comparisons import Closed, closed_by, closed_if, same, same_moments
from vedette.testing.law import Law
from vedette.testing.laws.inversion import a_sharp_return_inverts_exactly, inverted
from vedette.testing.laws.sensor_cases import Looks, full, noise_of, regular
from vedette.types import Gaussian, Pose

PLACE, SPEED, HEADING = np.array([120.0, -45.0]), np.array([3.0, 4.0]), 0.7
STILL = np.zeros(2)
FAR = np.array([2.0**20, -(2.0**19)])
"""A place so far that no sensor sees from there what it sees from the origin; powers of 2 add and go without rounding."""
PAIRS = (("x", "y"), ("vx", "vy"), ("ax", "ay"))
FIXED = ("z", "vz", "az")
"""Axes that a platform in the plane does not turn."""


def turned(space: Space, values: Array, angle: float) -> Array:
    """Return the vectors in the plane of states (*b, n) turned by an angle."""
    out = np.array(values)
    c, s = np.cos(angle), np.sin(angle)
    for pair in PAIRS:
        if all(name in space for name in pair):
            i, j = (space.names.index(name) for name in pair)
            out[..., i], out[..., j] = c * values[..., i] - s * values[..., j], s * values[..., i] + c * values[..., j]
    return out


def shifted(space: Space, values: Array, sign: float, speed: Array) -> Array:
    """Return states (*b, n) with `PLACE` and a speed added, or taken off."""
    out = np.array(values)
    for pair, shift in ((PAIRS[0], PLACE), (PAIRS[1], speed)):
        for name, by in zip(pair, shift, strict=True):
            if name in space:
                out[..., space.names.index(name)] += sign * by
    return out


def placed(sensor: Sensor, pose: Pose) -> Sensor:
    """The sensor at a pose; Closed if it cannot be placed."""
    with closed_by(NotImplementedError, "it cannot be placed"):
        return sensor.at(pose)


def at_home(sensor: Sensor) -> Sensor:
    """The sensor at the origin, without a heading; Closed where that cannot be."""
    home = placed(sensor, Pose(STILL, STILL, 0.0))
    closed_if(not all(name in sensor.observes for name in ("x", "y")), "it observes no position in the plane")
    if any(name in sensor.observes for name in sensor.measurement.names):
        raise Closed("it measures axes of the state itself, wherever it stands")
    return home


def sees_from_where_it_stands(sensor: Sensor, drawn: Looks) -> None:
    """Placed, it measures of a target what it measures at the origin of one that is moved back: position, speed, heading."""
    home, space = at_home(sensor), sensor.observes
    plain = all(name in {*sum(PAIRS, ()), *FIXED} for name in space.names)
    x = drawn.x
    for speed, heading in ((STILL, 0.0), (SPEED, HEADING)) if plain else ((STILL, 0.0),):
        there = sensor.at(Pose(PLACE, speed, heading))
        seen = turned(space, shifted(space, x, -1.0, speed), -heading)
        far = np.hypot(*seen[:, space.locate(Space.of(x="m", y="m"))].T) > 1.0
        z, wanted = there.measure(x)[far], home.measure(seen)[far]
        apart = sensor.measurement.difference(z, wanted)
        same("measure, placed", apart, np.zeros(apart.shape), 1e-6, np.maximum(np.abs(wanted), 1.0))
        same("detects, placed", full(there.detects(x), x, ())[far], full(home.detects(seen), seen, ())[far], 1e-9)
        same("noise, placed", noise_of(there, x)[far], noise_of(home, seen)[far], 1e-6)
        same("clutter, placed", np.broadcast_to(there.clutter(drawn.z), (3,)), np.broadcast_to(home.clutter(drawn.z), (3,)))
    # Far away nothing is in view both from there and from the origin.
    away, places = x.copy(), space.locate(Space.of(x="m", y="m"))
    away[:, places] += FAR
    seen = away.copy()
    seen[:, places] -= FAR
    p, wanted = (full(one.detects(at), x, ()) for one, at in ((sensor.at(Pose(FAR, STILL, 0.0)), away), (home, seen)))
    same(f"detects, placed at x, y = {FAR.tolist()} m", p, wanted, 1e-9)


def inverts_where_it_stands(sensor: Sensor, drawn: Looks) -> None:
    """Placed, a return stands for what it stands for at the origin, moved there."""
    home, space = at_home(sensor), sensor.observes
    if not all(name in {*sum(PAIRS, ()), *FIXED} for name in space.names):
        raise Closed("it observes more than a position and its motion")
    # What is assumed of a velocity that one return leaves open does not move along with the platform: it stands still here.
    there, z = sensor.at(Pose(PLACE, STILL, HEADING)), home.measure(regular(home, drawn.x))
    usual, found = inverted(home, z), inverted(there, z)
    wanted = shifted(space, turned(space, usual.mean, HEADING), 1.0, STILL)
    turn = turned(space, np.eye(len(space)), HEADING).T
    same_moments("invert, placed: ", space, found, Gaussian(wanted, turn @ usual.cov @ turn.T), 1e-6)
    a_sharp_return_inverts_exactly(sensor.at(Pose(PLACE, SPEED, HEADING)), drawn)


def platforms_in_a_batch_stand_apart(sensor: Sensor, drawn: Looks) -> None:
    """Placed at a pose a run, each run sees from its own."""
    at_home(sensor)
    places = PLACE * np.array([[1.0], [-2.0], [0.5]])
    speeds, headings = SPEED * np.array([[1.0], [0.0], [-2.0]]), np.array([0.0, HEADING, -2.0])
    together = sensor.at(Pose(places, speeds, headings))
    for i, x in enumerate(drawn.x):
        alone = sensor.at(Pose(places[i], speeds[i], float(headings[i])))
        same("measure of a batch of poses", together.measure(drawn.x[:, None])[i], alone.measure(x[None]), 1e-9)


LAWS = (Law(sees_from_where_it_stands), Law(inverts_where_it_stands), Law(platforms_in_a_batch_stand_apart))
