"""A cache of what a filter need not compute twice: the matrices of linear models, which do not depend on the state."""

from __future__ import annotations

from typing import Any, final

import numpy as np
from attrs import frozen

from vedette.kernels import Twin
from vedette.roles import MotionModel, Sensor
from vedette.space import Array, Periods, Space

_MOST = 256
"""Entries of each kind; beyond, all are dropped: recordings have few time steps, but platforms a new sensor every scan."""


@frozen(eq=False)
class SensorConstants:
    """How one sensor observes a state; None where that depends on the state.

    where: index of the sensor's axes into states (*b, n); H (m, n) over the whole state, R (1, 1, m, m), detection
    probability; periods: index and period of measured axes that wrap. plain: H, R, detection probability, R (m, m), if
    none depends on the state and the sensor measures its first axes as they are. twin: the sensor's, and the axes observed.
    """

    sensor: Sensor
    where: tuple[Any, ...]
    H: Array | None
    R: Array | None
    p_detect: float | None
    periods: Periods
    plain: tuple[Array, Array, float, Array] | None
    twin: tuple[Twin, tuple[int, ...]] | None

    @classmethod
    def of(cls, state: Space, sensor: Sensor, mean: Array) -> SensorConstants:
        """Take the constants for states like `mean` (*b, t, n)."""
        places = state.locate(sensor.observes)
        axes, periods, twin = as_slice(places), sensor.measurement.periods, own_twin(sensor)
        where = (..., axes)
        if twin is not None:
            return cls(sensor, where, None, None, None, periods, None, (twin, tuple(places)))
        x = mean[where]
        slope, R, p = sensor.jacobian(x) if sensor.linear else None, sensor.noise(x), np.asarray(sensor.detects(x))
        H = embedded(slope, axes, len(state)) if slope is not None and slope.ndim == 2 else None
        # A result without the batch's axes does not depend on the state: the contract says so.
        constant, m = R[None, None] if R.ndim == 2 else None, x.shape[-1]
        p_detect = float(p) if p.ndim == 0 else None
        plain = None
        if slope is not None and H is not None and constant is not None and p_detect is not None:
            as_they_are = axes == slice(0, m) and np.array_equal(slope, np.eye(m)) and sensor.measure(x) is x
            plain = (H, constant, p_detect, R) if as_they_are else None
        return cls(sensor, where, H, constant, p_detect, periods, plain, None)


@final
class Memo:
    """A filter's cache of the matrices of its motion and its sensors. It saves time and changes no result.

    steps: time step in s to F, Q and the periods of the state, if known; last: the most recent request; frame: the state's
    periods, and its zero-variance axes; moving: the motion's twin and the periods, once asked for.
    """

    __slots__ = ("_constants", "frame", "last", "moving", "steps")

    def __init__(self) -> None:
        self.steps: dict[float, tuple[Array, Array, Periods]] = {}
        self.last: SensorConstants | None = None
        self.frame: tuple[Periods, list[int]] | None = None
        self.moving: tuple[Twin | None, Periods] | None = None
        self._constants: dict[int, SensorConstants] = {}

    def clear(self) -> None:
        """Forget everything: it is asked for anew."""
        self.__init__()

    def step(self, motion: MotionModel, x: Array, dt: float) -> tuple[Array, Array, Periods]:
        """Return F and Q of a linear motion over `dt` s, and the periods of its state."""
        matrices = self.steps.get(dt)
        if matrices is None:
            matrices = motion.jacobian(x, dt), motion.noise(x, dt), motion.state.periods
            if matrices[0].ndim == matrices[1].ndim == 2:
                keep(self.steps, dt, matrices)
        return matrices

    def __reduce__(self) -> tuple[type[Memo], tuple[()]]:
        return Memo, ()  # a copy asks anew, as what is compiled cannot be copied

    def twin(self, motion: MotionModel) -> tuple[Twin | None, Periods]:
        """Return `moving` of the filter's motion."""
        self.moving = own_twin(motion), motion.state.periods
        return self.moving

    def framed(self, motion: MotionModel) -> tuple[Periods, list[int]]:
        """Return `frame` of the filter's motion."""
        self.frame = motion.state.periods, motion.state.locate(motion.zero_variance)
        return self.frame

    def constants(self, state: Space, sensor: Sensor, mean: Array) -> SensorConstants:
        """Return how `sensor` observes states like `mean` (*b, t, n)."""
        constants = self._constants.get(id(sensor))
        if constants is None:  # an entry holds its sensor, so that the id is given to no other
            constants = SensorConstants.of(state, sensor, mean)
            keep(self._constants, id(sensor), constants)
        self.last = constants
        return constants


def own_twin(component: MotionModel | Sensor) -> Twin | None:
    """Return the twin that the component's own class states: what a subclass changes, the twin of its base does not know."""
    return component.twin if "twin" in vars(type(component)) else None


def embedded(slope: Array, where: slice | list[int], n: int) -> Array:
    """Embed a derivative with respect to the axes `where` among `n` axes: (*b, m, p) -> (*b, m, n), zeros elsewhere."""
    if slope.shape[-1] == n and where == slice(0, n):
        return slope
    H = np.zeros((*slope.shape[:-1], n))
    H[..., where] = slope
    return H


def as_slice(where: list[int]) -> slice | list[int]:
    """Return adjacent axes as a slice, which needs no copy."""
    if where and where == list(range(where[0], where[0] + len(where))):
        return slice(where[0], where[0] + len(where))
    return where


def keep(table: dict[Any, Any], key: float, value: Any) -> None:
    """Enter a value into a table of bounded size."""
    if len(table) >= _MOST:
        table.clear()
    table[key] = value
