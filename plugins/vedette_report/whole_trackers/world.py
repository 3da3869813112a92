"""What truth and returns are drawn from: another world than the tracker's, and errors that are not white."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import numpy as np
from attrs import field, frozen

from vedette import Array, Estimator, Gaussian, Recording, Sensor, Tracker
from vedette.testing import Misuse

WILD = 5.0
"""Size of a wild error, in those of the others."""


@frozen(eq=False)
class Errors:
    """How a sensor's errors differ from white ones of its own covariance, which they have on average over the runs.

    Successive errors have the `correlation`; a share `wild` of them is `WILD` times as large as the others; and they grow
    with the distance of the target as its power `growth`, from the distance at the start.
    """

    correlation: float = 0.0
    wild: float = 0.0
    growth: float = 0.0

    def shaped(self, white: Array, before: Array | None, distance: Array, rng: np.random.Generator) -> tuple[Array, Array]:
        """Return errors (r, m) made of white ones, whose size is 1, and what of them the next ones depend on."""
        kept = white if before is None else self.correlation * before + np.sqrt(1 - self.correlation**2) * white
        errors = kept
        if self.wild:
            sizes = np.where(rng.random(len(white)) < self.wild, WILD, 1.0) / np.sqrt(1 + (WILD**2 - 1) * self.wild)
            errors = sizes[:, None] * errors
        return errors * distance[:, None] ** self.growth, kept


@frozen(eq=False)
class World:
    """What truth and returns are drawn from: models, a start over the estimator's axes, and the errors of each sensor.

    A sensor that `errors` does not name has white errors.
    """

    estimator: Estimator[Any]
    sensors: Mapping[str, Sensor]
    start: Gaussian | None = None
    errors: Mapping[str, Errors] = field(factory=dict)


def world_of(tracker: Tracker, world: Tracker | World | None, prior: Gaussian) -> World:
    """Return the world with its own start, or one over its axes made of the tracker's; Misuse if it is another scene."""
    if world is None or world is tracker:
        return World(tracker.estimator, tracker.sensors, prior)
    state, start = world.estimator.state, world.start if isinstance(world, World) else None
    if missing := [name for name in tracker.state.names if name not in state]:
        raise Misuse(f"world: must have the tracker's axes, lacks {', '.join(missing)}; it has {', '.join(state.names)}")
    for name, sensor in tracker.sensors.items():
        if name not in world.sensors:
            raise Misuse(f"world.sensors: must have the tracker's, lacks {name!r}; it has {', '.join(world.sensors)}")
        real = world.sensors[name]
        if real.measurement != sensor.measurement:
            told = f"must measure {sensor.measurement}, as the tracker's does, got {real.measurement}"
            raise Misuse(f"world.sensors.{name}: {told}")
        if unknown := [axis for axis in real.observes.names if axis not in state]:
            raise Misuse(f"world.sensors.{name}: observes {', '.join(unknown)}, which the world's estimator does not have")
    if isinstance(world, Tracker):
        with suppress(ValueError):
            own = world.given(Recording(()))
            start = None if own is None else Gaussian(own.mean[0], own.cov[0])
    if start is None:
        if extra := [name for name in state.names if name not in tracker.state]:
            raise Misuse(f"world: must say where its target starts, as it has axes of its own: {', '.join(extra)}")
        where = tracker.state.locate(state)
        start = Gaussian(prior.mean[where], prior.cov[where][:, where])
    return World(world.estimator, world.sensors, start, world.errors if isinstance(world, World) else {})
