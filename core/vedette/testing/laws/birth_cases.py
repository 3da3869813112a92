"""What the laws of births are tried on."""

from __future__ import annotations

from typing import Any

import numpy as np
from attrs import frozen
from hypothesis import strategies as st

from vedette.roles import Estimator, Sensor
from vedette.space import Array
from vedette.supporting import Birth
from vedette.testing.comparisons import closed_by, closed_if, frozen_copy
from vedette.testing.law import Profile
from vedette.testing.states import SEEDS, STEPS
from vedette.testing.strategies import SENSOR, usual
from vedette.types import Detections, Newborn

P_GATE = 0.99


@frozen(eq=False)
class Returns:
    """Returns (k, 2) of a sensor of positions, the probabilities (k,) that tracks claim them, time steps in s."""

    estimator: Estimator[Any]
    sensor: Sensor
    detections: Detections
    claimed: Array
    dt: float
    later: float
    seed: int

    def rng(self) -> np.random.Generator:
        """A generator that always starts the same."""
        return np.random.default_rng(self.seed)


_GIVEN = st.tuples(st.sampled_from([2, 3, 4, 1, 0]), STEPS, STEPS, SEEDS)
"""How many returns, two time steps, a seed."""


def drawn(draw: st.DrawFn, birth: Birth, profile: Profile) -> Returns:
    """What every law of a birth is given: up to 4 returns, some of which tracks claim."""
    k, dt, later, seed = draw(_GIVEN)
    rng, motion, kalman = np.random.default_rng(seed), usual("motion", "constant_velocity"), usual("estimator", "kalman")
    position = usual("sensor", "cartesian_position")
    z = frozen_copy(200.0 * rng.standard_normal((k, 2)))
    return Returns(
        kalman(motion(0.5)), position(5.0, 0.9, 1e-5), Detections.of(z, 2), frozen_copy(rng.random(k)), dt, later, seed
    )


def unseen(birth: Birth, given: Returns) -> Any:
    """The memory of targets without a track before the first scan."""
    return birth.initial_memory(given.estimator, given.rng())


def unseen_after_nothing(birth: Birth, memory: Any, given: Returns) -> Any:
    """The memory after a scan without returns."""
    return birth.update(memory, given.estimator, given.sensor, Detections.of([], 2), np.zeros(0), P_GATE)


def rate_of(birth: Birth, memory: Any, given: Returns, z: Array | None = None) -> Array:
    """The density (k,) of targets without a track at returns, or at places z (k, 2); Closed if none is stated."""
    scan = given.detections if z is None else Detections.of(z, 2)
    rate, _ = birth.reveal(memory, given.estimator, given.sensor, scan, P_GATE)
    closed_if(rate is None, "it states no rate")
    return np.asarray(rate)


def begun(birth: Birth, given: Returns, claimed: Array | None = None) -> Newborn:
    """The tracks that start at the returns of the first scan."""
    closed_if(not birth.starts_from(SENSOR), "no return starts a track")
    found, chosen = None, given.claimed if claimed is None else claimed
    if birth.models_unseen:
        found = birth.reveal(unseen(birth, given), given.estimator, given.sensor, given.detections, P_GATE)[1]
    with closed_by(ValueError, "it starts no tracks there: {}"):
        return birth.begin(found, given.estimator, given.sensor, SENSOR, given.detections, chosen)
