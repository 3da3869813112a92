"""Undetected targets that may be anywhere."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Birth, Detections, Estimator, Mask, Newborn, Sensor, fields
from vedette.sampling import Bounds
from vedette_standard.births.anywhere import over_places
from vedette_standard.births.cells import counted, looked, middles, moved
from vedette_standard.births.one_point import one_point
from vedette_standard.births.places import present
from vedette_standard.regions import PLANE, Polygon, held

PLACES = 16
"""Points per axis by which it is counted how much of the box `appears_in` leaves."""


@final
@frozen
class Uniform(Birth):
    """Undetected targets are a Poisson process that appears evenly over a box: a track may start at any return.

    Of n targets, a return z comes from one with the density e(z) = n P_D |dx/dz| / volume, against clutter lambda(z): a
    track that starts there exists with probability e / (e + lambda), times that of coming from no track. |dx/dz| is the
    ratio of the return's standard deviations in the state, by `Sensor.invert`, and in the measurement. The prior is that of
    the return, and `spread` for the axes that no return gives. A sensor may observe axes beside those of the box, as a
    Doppler radar does: by `spread` they are N(0, spread^2) before the return, and e(z) is linearised around its place.
    A look lowers n by P_D, where it sees, in cells as small as its view needs: n is then that of the box if all of it were
    like the return's place. What moves, by the `spread` of its velocity, comes into a view across its edge: at 10 m/s and
    1.3 km, .75 of what comes straight from afar, after a minute.
    Houssineau, Laneuville, PHD Filter with Diffuse Spatial Prior on the Birth Process, FUSION 2010.

    >>> from vedette import Detections
    >>> from vedette.sampling import Bounds
    >>> from vedette_standard import ConstantVelocity, Kalman, LinearSensor
    >>> box = {"x": Bounds(-500.0, 500.0), "y": Bounds(-400.0, 400.0)}  # 8e5 m^2
    >>> birth = Uniform(box, {"vx": 5.0, "vy": 6.0}, initial=0.4, rate=0.02, lifetime=50.0, sensors=("radar",), least=0.02)
    >>> sensor = LinearSensor(("x", "y"), np.diag([4.0, 9.0]), np.diag([2.0, 1.0]), (), 0.8, 1e-6)  # |dx/dz| = 1/2
    >>> estimator, seen = Kalman(ConstantVelocity(0.5)), Detections.of([[20.0, 30.0], [1010.0, 0.0], [20.0, 30.0]])
    >>> number = birth.predict(birth.initial_memory(estimator, None), estimator, 10.0, None)
    >>> np.allclose(number, 0.4 * np.exp(-0.2) + 0.02 * 50.0 * (1.0 - np.exp(-0.2)))
    True
    >>> density, found = birth.reveal(number, estimator, sensor, seen, 0.9)
    >>> np.allclose(density, np.array([1.0, 0.0, 1.0]) * number.item() * 0.8 * 0.5 / 8e5)
    True
    >>> new = birth.begin(found, estimator, sensor, "radar", seen, np.array([0.25, 0.0, 0.98]))
    >>> new.returns.tolist(), new.prior.mean.tolist(), np.diag(new.prior.cov[0]).tolist()
    ([0], [[10.0, 30.0, 0.0, 0.0]], [1.0, 9.0, 25.0, 36.0])
    >>> np.allclose(new.existence, 0.75 * density[0] / (density[0] + 1e-6))
    True
    >>> np.allclose(birth.update(number, estimator, sensor, seen, np.zeros(3), 0.9), number * (1.0 - 0.9 * 0.8))
    True
    """

    kind: ClassVar[str] = "uniform"
    models_unseen: ClassVar[bool] = True

    view: Mapping[str, Bounds] = fields.part(
        "axis that the sensors observe to its low and high, as { x = { low = -500, high = 500 } }: the box",
        tried=({"x": Bounds(-500.0, 500.0), "y": Bounds(-400.0, 400.0)},),
    )
    spread: dict[str, float] = fields.table(
        "state axis outside the box to its standard deviation", tried=({"vx": 5.0, "vy": 5.0},)
    )
    initial: float = fields.quantity(
        "1", "expected number of targets before the first scan", default=0.0, at_least=0, tried=(0.1, 5.0)
    )
    rate: float = fields.quantity(
        "1/s", "expected number that appear per second", default=0.0, at_least=0, tried=(0.01, 0.1)
    )
    lifetime: float = fields.quantity(
        "s", "mean time for which an undetected target stays in view", default=600.0, above=0, tried=(60.0, 600.0)
    )
    sensors: tuple[str, ...] = fields.words("sensors whose returns may start tracks; default: all", default=())
    least: float = fields.probability("existence below which no track is started", default=1e-5)
    appears_in: tuple[Polygon, ...] = fields.part(
        "areas of the box in which targets appear; default: all of it", default=(), tried=((),)
    )

    def __attrs_post_init__(self) -> None:
        if self.initial == 0 and self.rate == 0:
            raise ValueError("rate: must be > 0 unless `initial` is, as no target would ever appear")
        if not self.view:
            raise ValueError("view: must hold the box in which targets appear, got none")

    def initial_memory(self, estimator: Estimator[Any], rng: np.random.Generator) -> Array:
        """Return the expected number of undetected targets, of one cell."""
        return np.full((1,) * (1 + len(self.view)), self.initial)

    def predict(self, memory: Array, estimator: Estimator[Any], dt: float, rng: np.random.Generator) -> Array:
        """Return their numbers `dt` later: some have left, others have come, and some are in other cells."""
        left = memory * math.exp(-dt / self.lifetime) + self.rate * present(dt, self.lifetime)
        for axis, (name, side) in enumerate(self.view.items()):
            distance = self.spread.get(f"v{name}", 0.0) * dt / (side.high - side.low)
            left = moved(left, axis, np.array([distance]), np.ones_like)
        return left

    def reveal(
        self, memory: Array, estimator: Estimator[Any], sensor: Sensor, detections: Detections, p_gate: float
    ) -> tuple[Array | None, Array | None]:
        """Return the density (k,) of each return from an undetected target, 0 where it may start no track.

        None of a sensor whose returns give no place in the box.
        """
        if not self._places(sensor):
            return None, None
        rate, whole = np.zeros(detections.z.shape[0]), detections.complete
        low, high = self._box()
        z, noise = detections.z[whole], detections.noise_of(whole)
        spot = sensor.invert(z, noise)
        place = spot.mean[:, self._axes(sensor)]
        inside = np.all((place >= low) & (place <= high), axis=-1) & self._appearing(sensor, spot.mean)
        own = [axis in self.view for axis in sensor.observes.names]
        stretch = over_places(sensor, spot, z, noise, own, self.spread)
        number = counted(memory, (place - low)[None] / (high - low), lambda at: sensor.detects(self._at(sensor, at)))[0]
        volume = np.prod(high - low) * self._share(sensor)
        rate[whole] = np.where(inside, number * sensor.detects(spot.mean) * stretch / volume, 0.0)
        return rate, rate

    def update(
        self,
        memory: Array,
        estimator: Estimator[Any],
        sensor: Sensor,
        detections: Detections,
        claimed: Array,
        p_gate: float,
    ) -> Array:
        """Return the numbers of those without a track: not detected, or by a return that may start none."""
        if not self._places(sensor):
            return memory
        count = np.count_nonzero(detections.valid)
        whole = np.count_nonzero(detections.complete) / count if count else 1.0
        return looked(memory, lambda at: sensor.detects(self._at(sensor, at[None])), whole * p_gate)

    def begin(
        self, found: Any, estimator: Estimator[Any], sensor: Sensor, name: str, detections: Detections, claimed: Array
    ) -> Newborn:
        """Return a track at each return that may be an undetected target's."""
        if not self._places(sensor):
            names = ", ".join(sensor.observes.names)
            if not set(self.view) <= set(sensor.observes.names):
                told = f"must be over axes that {sensor.kind!r} observes, {names}"
                raise ValueError(f"view: {told}; got {', '.join(self.view)}")
            if lacking := [repr(name) for name in sensor.observes.names if name not in {**self.view, **self.spread}]:
                told = f"must state the standard deviation of {', '.join(lacking)}, which {sensor.kind!r} observes"
                raise ValueError(f"spread: {told} beside the box")
            own = ", ".join(self.view)
            raise NotImplementedError(f"one return of {sensor.kind!r} does not give {own}, so it cannot start a track")
        self._share(sensor)
        rate = np.zeros(len(claimed)) if found is None else found
        total = rate + np.broadcast_to(sensor.clutter(detections.z), len(claimed))
        existence = np.divide(rate, total, out=np.zeros_like(rate), where=total > 0) * (1.0 - claimed)
        returns = np.flatnonzero((existence > 0) & (existence >= self.least))
        prior = one_point(sensor, detections, returns, self.spread, estimator.state)
        return Newborn(returns, prior, existence[returns])

    def _appearing(self, sensor: Sensor, x: Array) -> Mask:
        """Return whether targets appear in places (*b, n) over the axes that the sensor observes, (*b)."""
        return held(self.appears_in, x[..., sensor.observes.locate(PLANE)]) if self.appears_in else np.ones((), dtype=bool)

    def _places(self, sensor: Sensor) -> bool:
        """Return whether a return of the sensor is a place in the box."""
        names = set(sensor.observes.names)
        return set(self.view) <= names <= {*self.view, *self.spread} and len(sensor.measurement) >= len(self.view)

    def _axes(self, sensor: Sensor) -> list[int]:
        """Return which observed axes are those of the box, in its order."""
        return [sensor.observes.names.index(name) for name in self.view]

    def _box(self) -> tuple[Array, Array]:
        """Return the corners of the box."""
        low, high = np.array([(side.low, side.high) for side in self.view.values()]).T
        return low, high

    def _at(self, sensor: Sensor, place: Array) -> Array:
        """Return states (*b, n) of a sensor at places (*b, d) counted from 0 to 1 along the box, 0 in other axes."""
        low, high = self._box()
        x = np.zeros((*place.shape[:-1], len(sensor.observes)))
        x[..., self._axes(sensor)] = low + (high - low) * place
        return x

    def _share(self, sensor: Sensor) -> float:
        """Return in what share of the box targets appear."""
        if not self.appears_in:
            return 1.0
        appearing = self._appearing(sensor, self._at(sensor, middles(PLACES, len(self.view))))
        if not appearing.any():
            raise ValueError("appears_in: must hold a part of the box, got none")
        return float(np.mean(appearing))
