"""What the laws of sensors are tried on, and what several of them do with it."""

from __future__ import annotations

import numpy as np
from attrs import frozen
from hypothesis import strategies as st

from vedette.roles import Sensor
from vedette.space import Array
from vedette.testing.judging import frozen_copy
from vedette.testing.law import Profile
from vedette.testing.states import SEEDS, points


@frozen(eq=False)
class Looks:
    """States x (3, n), returns z (3, m), steps over the measured axes (3, m), and what statistical laws need."""

    x: Array
    z: Array
    step: Array
    seed: int
    runs: int
    alpha: float


def drawn(sensor: Sensor, profile: Profile) -> st.SearchStrategy[Looks]:
    """What every law of a sensor is given."""
    x = points(sensor.observes, 3).map(frozen_copy)
    z, step = points(sensor.measurement, 3).map(frozen_copy), points(sensor.measurement, 3).map(frozen_copy)
    return st.builds(Looks, x, z, step, SEEDS, st.just(profile.runs), st.just(profile.alpha))


def full(result: Array, x: Array, shape: tuple[int, ...]) -> Array:
    """Return a result of states x (*b, n) with all their batch axes, also where it left them out."""
    return np.broadcast_to(result, (*x.shape[:-1], *shape))


def noise_of(sensor: Sensor, x: Array) -> Array:
    """Return R (*b, m, m), one a state."""
    m = len(sensor.measurement)
    return full(sensor.noise(x), x, (m, m))
