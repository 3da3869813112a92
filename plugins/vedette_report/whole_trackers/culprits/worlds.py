"""Worlds with more or less noise than a stated one: each of its noises is a knob that may be turned."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Any, ClassVar, final

import numpy as np
from attrs import evolve, frozen

from vedette import Array, Estimator, Gaussian, MotionModel, Sensor, WrappedMotion, WrappedSensor, fields
from vedette.testing.truth import modes_of, motion_of
from vedette_report.whole_trackers.world import World


@final
@frozen
class Restless(WrappedMotion):
    """A motion with `factor` times the noise of another."""

    kind: ClassVar[str] = "kit_restless"

    of: MotionModel = fields.part("the motion")
    factor: float = fields.quantity("1", "factor of its noise", above=0)

    def noise(self, x: Array, dt: float) -> Array:
        return self.factor * self.of.noise(x, dt)


@final
@frozen(eq=False)
class Noisy(WrappedSensor):
    """A sensor without clutter, with `factors` (m,) times the variance of another along each axis that it measures.

    `twist` (m, m), symmetric and 0 on its diagonal, is added to the correlations.
    """

    kind: ClassVar[str] = "kit_noisy"

    of: Sensor = fields.part("the sensor")
    factors: Array = fields.array("1", "factors of the variances", ndim=1)
    twist: Array = fields.array("1", "what is added to the correlations", ndim=2)

    def noise(self, x: Array) -> Array:
        root = np.sqrt(self.factors)
        R = self.of.noise(x)
        spread = np.sqrt(np.diagonal(R, axis1=-2, axis2=-1))
        return (R + self.twist * spread[..., :, None] * spread[..., None, :]) * (root[:, None] * root)

    def clutter(self, z: Array) -> Array:
        return np.zeros(())


@frozen(eq=False)
class Knob:
    """A noise of the world that may be turned: Q, the start, or what a sensor's R has along an axis, or between two."""

    name: str
    sensor: str = ""
    axes: tuple[int, ...] = ()

    @property
    def step(self) -> float:
        """How far it is turned to see what changes: a variance is doubled, a correlation changes by a quarter."""
        return 0.25 if len(self.axes) == 2 else 1.0


def knobs_of(world: World) -> list[Knob]:
    """Return all noises of a world."""
    knobs = [Knob("Q")]
    for name, sensor in world.sensors.items():
        axes = sensor.measurement.names
        knobs += [Knob(f"R of {name} along {axis}", name, (i,)) for i, axis in enumerate(axes)]
        pairs = combinations(range(len(axes)), 2)
        knobs += [Knob(f"R of {name} between {axes[i]} and {axes[j]}", name, (i, j)) for i, j in pairs]
    return [*knobs, Knob("the covariance of the start", "start")]


def turned(world: World, knobs: Sequence[Knob], turns: Array) -> World:
    """Return the world without clutter, each knob turned: variances are 1 + turn times what they were."""
    sensors = {}
    for name, sensor in world.sensors.items():
        m = len(sensor.measurement)
        factors, twist = np.ones(m), np.zeros((m, m))
        for knob, turn in zip(knobs, turns, strict=True):
            if knob.sensor == name and len(knob.axes) == 1:
                factors[knob.axes] = 1.0 + turn
            elif knob.sensor == name and knob.axes:
                twist[knob.axes] = twist[knob.axes[::-1]] = turn
        sensors[name] = Noisy(sensor, factors, twist)
    by_name = {knob.name: 1.0 + turn for knob, turn in zip(knobs, turns, strict=True)}
    estimator = world.estimator if by_name.get("Q", 1.0) == 1.0 else _restless(world.estimator, by_name["Q"])
    assert world.start is not None
    start = Gaussian(world.start.mean, world.start.cov * by_name.get("the covariance of the start", 1.0))
    return World(estimator, sensors, start, world.errors)


def _restless(estimator: Estimator[Any], factor: float) -> Estimator[Any]:
    motion = motion_of(estimator)
    if motion is not None:
        return evolve(estimator, motion=Restless(motion, factor))  # type: ignore[misc]
    return evolve(estimator, modes=tuple(_restless(mode, factor) for mode in modes_of(estimator)))  # type: ignore[misc]
