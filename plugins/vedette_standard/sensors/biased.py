"""A sensor with registration errors that are part of the state."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import Factory, field, frozen

from vedette import Array, Axis, Gaussian, Sensor, Space, Twin, WrappedSensor, fields, filters
from vedette_standard import compiled
from vedette_standard.sensors.station import stands


def _observed(self: Biased) -> Space:
    """Return the sensor's own axes, the velocities that a lag needs, then the biases."""
    own, measured = self.of.observes, self.of.measurement
    for name, table, known in (("add", self.add, measured), ("offset", self.offset, own)):
        for axis in table:
            if axis not in known:
                raise ValueError(f"{name}.{axis}: must be one of {', '.join(known.names)}")
    units = {axis.name: axis.unit for axis in (*own.axes, *measured.axes)}
    named = [*((name, units[axis]) for table in (self.add, self.offset) for axis, name in table.items())]
    named += [(self.lag, "s")] if self.lag else []
    if len({name for name, _ in named}) < len(named) or any(name in own for name, _ in named):
        raise ValueError(f"biases: each needs a state axis of its own, got {', '.join(name for name, _ in named)}")
    moving = Space(tuple(Axis(f"v{axis.name}", "m/s") for axis in own.axes if axis.unit == "m")) if self.lag else Space()
    observes = own.union(moving).union(Space(tuple(Axis(name, unit) for name, unit in named)))
    begun = observes.names[len(own) :]
    for axis in self.spread:
        if axis not in begun:
            raise ValueError(f"spread.{axis}: must be one of {', '.join(begun) or 'none, as there is no bias'}")
    return observes


@final
@frozen
class Biased(WrappedSensor):
    """z = h(x + o - l v) + a + noise, with biases as state axes: a on the measurement, o on the position, a lag l.

    It describes a bearing with a constant error, a range that is too long, a wrong position, a time stamp that is late; v is
    the velocity relative to the platform, where a scan's pose states that of the platform.
    The estimator's motion must have the biases' axes, as 'gauss_markov' or 'random_walk' in a 'product' does. Only biases
    that move the returns differently can be told apart: a bearing error and an offset east need a target that moves.
    Every track has its own estimate of the biases.
    Lin, Bar-Shalom, Kirubarajan, Exact Multisensor Dynamic Bias Estimation with Local Tracks, IEEE T-AES 40, 2004.

    >>> from vedette_standard import CartesianPosition, RangeBearing
    >>> sensor = Biased(RangeBearing(6.0, 0.02), add={"bearing": "turned"}, offset={"x": "east"}, lag="late")
    >>> sensor.observes.names
    ('x', 'y', 'vx', 'vy', 'turned', 'east', 'late')
    >>> x = np.array([26.0, 48.0, 3.0, 4.0, -0.1, 10.0, 2.0])  # seen where it was 2 s ago, 10 m to the east
    >>> np.allclose(sensor.measure(x), [50.0, np.arctan2(40.0, 30.0) - 0.1])
    True
    >>> np.allclose(sensor.noise(x), np.diag([36.0, 0.0004]))
    True
    >>> by_differences = [(sensor.measure(x + d) - sensor.measure(x - d)) / 2e-4 for d in 1e-4 * np.eye(7)]
    >>> np.allclose(sensor.jacobian(x), np.transpose(by_differences))
    True
    >>> plain = Biased(CartesianPosition(6.0), add={"y": "up"}, offset={"x": "east"}, spread={"up": 3.0, "east": 2.0})
    >>> found = plain.invert(np.array([11.0, 9.0]))  # of a bias and its opposite in the place
    >>> found.mean.tolist(), plain.observes.names
    ([11.0, 9.0, 0.0, 0.0], ('x', 'y', 'up', 'east'))
    >>> found.cov.round(9).tolist()
    [[40.0, 0.0, 0.0, -4.0], [0.0, 45.0, -9.0, 0.0], [0.0, -9.0, 9.0, 0.0], [-4.0, 0.0, 0.0, 4.0]]
    """

    kind: ClassVar[str] = "biased"

    of: Sensor = fields.part("the sensor as it would be with perfect registration")
    add: dict[str, str] = fields.names("measured axis to the state axis that is added to it")
    offset: dict[str, str] = fields.names("state axis that is seen, such as x, to the state axis by which it is displaced")
    lag: str = fields.text("state axis of the time by which the returns are late", default="")
    spread: dict[str, float] = fields.table(
        "bias to its standard deviation around 0 in a track that starts at a return", at_least=0
    )
    observes: Space = field(init=False, repr=False, eq=False, default=Factory(_observed, takes_self=True))

    @property
    def linear(self) -> bool:
        """Whether the sensor is linear; a lag is multiplied by the velocity."""
        return self.of.linear and not self.lag

    @property
    def twin(self) -> Twin | None:
        """Its compiled twin, if the sensor has one."""
        observed, measured = self.of.observes.names, self.measurement
        index = {name: i for i, name in enumerate(self.observes.names)}
        moved = dict(zip(*self._moving(), strict=True))
        return compiled.biased(
            filters.own_twin(self.of),
            self._carried(),
            len(self.observes),
            index[self.lag] if self.lag else -1,
            tuple(index[self.add[name]] if name in self.add else -1 for name in measured.names),
            tuple(index[self.offset[name]] if name in self.offset else -1 for name in observed),
            tuple(moved.get(i, -1) for i in range(len(observed))),
            tuple(axis.period or 0.0 for axis in measured.axes),
        )

    def _biases(self) -> Space:
        return Space(self.observes.axes[len(self.observes) - len(self.add) - len(self.offset) - bool(self.lag) :])

    def _moving(self) -> tuple[list[int], list[int]]:
        """Return the indices of positions and their velocities, if there is a lag."""
        places = [axis.name for axis in self.of.observes.axes if axis.unit == "m"] if self.lag else []
        index = {name: i for i, name in enumerate(self.observes.names)}
        return [index[name] for name in places], [index[f"v{name}"] for name in places]

    def _apparent(self, x: Array) -> Array:
        """Return the sensor's own axes displaced by offset and lag: (*b, n) -> (*b, n of the sensor)."""
        index = {name: i for i, name in enumerate(self.observes.names)}
        seen = x[..., : len(self.of.observes)].copy()
        for axis, name in self.offset.items():
            seen[..., index[axis]] += x[..., index[name]]
        if self.lag:
            places, speeds = self._moving()
            seen[..., places] -= x[..., index[self.lag], None] * self._relative(x[..., speeds], places)
        return seen

    @property
    def relative(self) -> bool:
        """Whether returns are relative to the platform, and not places in the tracker's own frame."""
        return not {"x", "y"} <= set(self.measurement.names)

    def _carried(self) -> Array:
        """Return the velocity of the platform along the sensor's own axes (*b, n), 0 if none is stated.

        It was elsewhere, too, when a return was late.
        """
        pose, places = stands(self.of), self._moving()[0]
        if not places or pose is None or pose.velocity is None or not self.relative:
            return np.zeros(len(self.of.observes))
        carried = np.zeros((*np.shape(pose.velocity)[:-1], len(self.of.observes)))
        carried[..., places] = np.asarray(pose.velocity)[..., : len(places)]
        return carried

    def _relative(self, v: Array, places: list[int]) -> Array:
        """Return velocities (*b, .., p) relative to the platform."""
        carried = self._carried()[..., places]
        return v - (
            carried if carried.ndim == 1 else carried.reshape(*carried.shape[:-1], *(1,) * (v.ndim - carried.ndim), -1)
        )

    def measure(self, x: Array) -> Array:
        """Return the expected measurement: (*b, n) -> (*b, m)."""
        z = self.of.measure(self._apparent(x))
        step = np.zeros(z.shape)
        for axis, name in self.add.items():
            step[..., self.measurement.names.index(axis)] = x[..., self.observes.names.index(name)]
        return self.measurement.displace(z, step)

    def jacobian(self, x: Array) -> Array:
        """Return H: (*b, n) -> (*b, m, n)."""
        inner = self.of.jacobian(self._apparent(x))
        H = np.zeros((*x.shape[:-1], len(self.measurement), len(self.observes)))
        H[..., : len(self.of.observes)] = inner
        index = {name: i for i, name in enumerate(self.observes.names)}
        for axis, name in self.add.items():
            H[..., self.measurement.names.index(axis), index[name]] = 1.0
        for axis, name in self.offset.items():
            H[..., index[name]] = inner[..., index[axis]]
        if self.lag:
            places, speeds = self._moving()
            late = x[..., index[self.lag], None, None]
            H[..., speeds] -= late * inner[..., places]
            H[..., index[self.lag]] = -np.sum(
                inner[..., places] * self._relative(x[..., speeds], places)[..., None, :], axis=-1
            )
        return H

    def noise(self, x: Array) -> Array:
        """Return R: (*b, n) -> (*b, m, m) or (m, m)."""
        return self.of.noise(self._apparent(x))

    def unresolved(self, x: Array) -> Array | None:
        """Return C: (*b, n) -> (*b, m, m), or None."""
        return self.of.unresolved(self._apparent(x))

    def detects(self, x: Array) -> Array:
        """Return the detection probability: (*b, n) -> (*b) or ()."""
        return self.of.detects(self._apparent(x))

    def invert(self, z: Array, noise: Array | None = None) -> Gaussian:
        """Invert a return with biases 0 +- `spread`: (*b, m) -> (*b, n), (*b, n, n); position and biases are correlated."""
        biases, seen = self._biases(), self.of.invert(z, noise)
        lacking = [name for name in self.observes.names[len(self.of.observes) :] if name not in self.spread]
        if lacking:
            raise NotImplementedError(f"spread: must state the standard deviation of {', '.join(lacking)} in new tracks")
        count, n = len(self.of.observes), len(self.observes)
        mean, cov = np.zeros((*z.shape[:-1], n)), np.zeros((*z.shape[:-1], n, n))
        mean[..., :count], cov[..., :count, :count] = seen.mean, seen.cov
        prior = np.array([self.spread[name] ** 2 for name in self.observes.names[count:]])
        H = self.jacobian(mean)
        moves = np.zeros((*z.shape[:-1], count, n - count))
        first = n - count - len(biases)
        moves[..., first:] = -np.linalg.pinv(H[..., :count]) @ H[..., count + first :]
        cov[..., :count, count:] = moves * prior
        cov[..., count:, :count] = np.swapaxes(cov[..., :count, count:], -1, -2)
        cov[..., :count, :count] += (moves * prior) @ np.swapaxes(moves, -1, -2)
        cov[..., range(count, n), range(count, n)] = prior
        return Gaussian(mean, cov)
