"""What the laws of sensors are tried on, and what several of them do with it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from attrs import frozen
from hypothesis import strategies as st

from vedette.roles import Sensor
from vedette.space import Array, Space
from vedette.testing.comparisons import derivative, frozen_copy
from vedette.testing.law import Profile
from vedette.testing.states import SEEDS, points, size, steps_of

SMOOTH = 0.05
"""Uncertainty of a derivative by differences, as a part of it, beyond which there is none."""


@frozen(eq=False)
class Looks:
    """States x (3, n), returns z (3, m), steps over the measured axes (3, m), and what statistical laws need."""

    x: Array
    z: Array
    step: Array
    seed: int
    runs: int
    alpha: float


def drawn(draw: st.DrawFn, sensor: Sensor, profile: Profile) -> Looks:
    """What every law of a sensor is given."""
    spread = getattr(sensor, "spread", None)  # of a bias: what an inverse assumes of it, around 0
    known = spread if isinstance(spread, Mapping) else {}
    within = np.minimum([known.get(axis.name, np.inf) / size(axis) for axis in sensor.observes.axes], 1.0)
    x = frozen_copy(draw(points(sensor.observes, 3)) * within)
    z, step = frozen_copy(draw(points(sensor.measurement, 3))), frozen_copy(draw(points(sensor.measurement, 3)))
    return Looks(x, z, step, draw(SEEDS), profile.runs, profile.alpha)


def regular(sensor: Sensor, x: Array) -> Array:
    """Return the states (*b, n), those at which `measure` has no derivative moved by a small step along each axis.

    A target over the sensor itself has no bearing: what a return stands for is asked some 20 m beside it. The derivative is
    that of `measure`, whatever the sensor states, so a wrong jacobian changes nothing.
    """
    step = steps_of(sensor.observes)

    def smooth(state: Array) -> bool:
        with np.errstate(all="ignore"):
            slope, doubt = derivative(sensor.measure, state, sensor.measurement.difference, 1e-2 * step)
        largest = np.max(np.abs(slope) * step, axis=-1, keepdims=True)
        return bool(np.all(np.isfinite(slope)) and np.all(doubt * step <= SMOOTH * largest + 1e-12))

    moved = Space(sensor.observes.axes).displace(x, step)
    return frozen_copy(np.where(np.array([smooth(state) for state in x])[:, None], x, moved))


def slopes(sensor: Sensor, x: Array) -> Array:
    """Return the derivatives (*b, m, n) of `measure` at states (*b, n), by differences."""
    step = 1e-2 * steps_of(sensor.observes)
    return np.stack([derivative(sensor.measure, state, sensor.measurement.difference, step)[0] for state in x])


def full(result: Array, x: Array, shape: tuple[int, ...]) -> Array:
    """Return a result of states x (*b, n) with all their batch axes, also where it left them out."""
    return np.broadcast_to(result, (*x.shape[:-1], *shape))


def noise_of(sensor: Sensor, x: Array) -> Array:
    """Return R (*b, m, m), one a state."""
    m = len(sensor.measurement)
    return full(sensor.noise(x), x, (m, m))
