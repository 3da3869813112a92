"""Targets that appear as a Poisson process, unseen until a sensor detects them."""

from __future__ import annotations

import math
from typing import Any, ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Birth, Detections, Estimator, Gaussian, Newborn, Sensor, fields
from vedette.sampling import NO_DRAWS
from vedette.tracking import join, take
from vedette_standard.births import in_gaussians
from vedette_standard.births.cells import looked
from vedette_standard.births.explained import Explained, explained
from vedette_standard.births.intensity import Intensity, fewer
from vedette_standard.births.places import Appearance, Edge, present

FADED = 0.01
"""A Gaussian is dropped only if it is also below this share of what appears anew in a place."""

_TRIED = (
    (Appearance({"x": (0.0, 200.0), "y": (50.0, 300.0), "vx": (0.0, 50.0), "vy": (0.0, 50.0)}, 1.0, 0.05),),
    (Appearance({"x": (99.0, 50.0), "y": (-99.0, 50.0), "vx": (9.0, 50.0), "vy": (-9.0, 99.0)}, 0.1, 0.1),),
)


@final
@frozen
class Poisson(Birth):
    """Undetected targets are a Poisson process; its intensity, a sum of Gaussians, moves, decays and falls with each look.

    A return z comes from one of them with the density e(z) = sum_c w_c P_D N(z; c), against clutter lambda(z): a track that
    starts there exists with probability e / (e + lambda), times that of coming from no track, and has the Gaussians'
    moments given z, for a nonlinear sensor linearised around z. So the tracker is a Poisson multi-Bernoulli filter.
    A look thins a Gaussian where it sees, in cells of the plane of equal probability, as small as its view needs, which mix
    by motion. Once a view ends within a Gaussian, those of other times that are like it are added to it.
    Williams, Marginal Multi-Bernoulli Filters: RFS Derivation of MHT, JIPDA and MeMBer, IEEE T-AES 51, 2015.

    >>> from vedette import Detections
    >>> from vedette.sampling import NO_DRAWS
    >>> from vedette_standard import CartesianPosition, ConstantVelocity, Kalman
    >>> from vedette_standard.births.places import Appearance, Edge
    >>> at = {"x": (100.0, 20.0), "y": (-50.0, 30.0), "vx": (4.0, 2.0), "vy": (0.0, 1.0)}
    >>> west = Edge([-900.0, 80.0], [-900.0, -80.0], 10.0, [7.0, 1.0], parts=2, rate=0.01)  # two parts, each 40 m wide
    >>> port = Appearance(at, initial=0.3, rate=0.02)
    >>> birth = Poisson((port,), (west,), lifetime=50.0, sensors=("radar",), least=0.1, recycles=True)
    >>> estimator, sensor = Kalman(ConstantVelocity(0.5)), CartesianPosition(10.0, 0.8, 1e-4)
    >>> memory = birth.predict(birth.initial_memory(estimator, NO_DRAWS), estimator, 10.0, NO_DRAWS)
    >>> came = 50.0 * (1.0 - np.exp(-0.2))  # of one a second, as many are there after 10 s
    >>> np.allclose(memory.weights, [0.3 * np.exp(-0.2), 0.02 * came, 0.005 * came, 0.005 * came])
    True
    >>> memory.belief.mean.round(9).tolist()[::2], memory.belief.cov[2].diagonal().round(9).tolist()
    ([[140.0, -50.0, 4.0, 0.0], [-900.0, 40.0, 7.0, 0.0]], [100.0, 1600.0, 1.0, 1.0])
    >>> seen = Detections.of([[130.0, -10.0], [130.0, -10.0], [5000.0, 0.0]])
    >>> density, found = birth.reveal(memory, estimator, sensor, seen, 0.9)
    >>> x = np.array([[140.0, 100.0], [400.0 + 10.0**2 * 4.0 + 0.25 * 10.0**3 / 3.0, 400.0]])  # moved, and anew
    >>> y = np.array([[-50.0, -50.0], [900.0 + 10.0**2 * 1.0 + 0.25 * 10.0**3 / 3.0, 900.0]])  # means, variances
    >>> apart = (130.0 - x[0]) ** 2 / (x[1] + 100.0) + (-10.0 - y[0]) ** 2 / (y[1] + 100.0)
    >>> share = memory.weights[:2] * np.exp(-0.5 * apart) / (2.0 * np.pi * np.sqrt((x[1] + 100.0) * (y[1] + 100.0)))
    >>> np.allclose(density, [0.8 * share.sum()] * 2 + [0.0])
    True
    >>> new = birth.begin(found, estimator, sensor, "radar", seen, np.array([0.25, 0.95, 0.0]))
    >>> new.returns.tolist(), np.allclose(new.existence, 0.75 * density[0] / (density[0] + 1e-4))
    ([0], True)
    >>> np.allclose(new.prior.mean[0, 0], share @ (x[0] + x[1] / (x[1] + 100.0) * (130.0 - x[0])) / share.sum())
    True
    >>> left = birth.update(memory, estimator, sensor, seen, np.zeros(3), 0.9)
    >>> left = birth.recycle(left, estimator, new.prior, np.array([0.4]))
    >>> np.allclose(left.weights, [*(memory.weights * (1.0 - 0.8 * 0.9)), 0.4])
    True
    """

    kind: ClassVar[str] = "poisson"
    models_unseen: ClassVar[bool] = True

    appear: tuple[Appearance, ...] = fields.part("where targets appear, and how many", default=(), tried=_TRIED)
    enter: tuple[Edge, ...] = fields.part("lines across which targets come in, and how many", default=(), tried=((),))
    lifetime: float = fields.quantity(
        "s", "mean time for which an undetected target stays in view", default=600.0, above=0, tried=(60.0, 600.0)
    )
    sensors: tuple[str, ...] = fields.words("sensors whose returns may start tracks; default: all", default=())
    least: float = fields.probability("existence below which no track is started", default=1e-5)
    negligible: float = fields.quantity(
        "1", "expected number below which a Gaussian is dropped", default=1e-5, at_least=0, tried=(1e-5, 0.0)
    )
    recycles: bool = fields.flag("count tracks that end as undetected targets, weighted by their existence", default=False)

    def __attrs_post_init__(self) -> None:
        if not self.appear and not self.enter:
            raise ValueError("appear: must hold at least one place where targets appear, unless `enter` does, got none")

    def _appearing(self, estimator: Estimator[Any], initial: bool, dt: float, rng: np.random.Generator) -> Intensity:
        """Return the intensity of targets there before the first scan, or of those that came within dt and have stayed."""
        weights, means, covs = [], [], []
        named: list[tuple[str, Appearance | Edge]] = [(f"appear[{i}]", place) for i, place in enumerate(self.appear)]
        named += [(f"enter[{i}]", edge) for i, edge in enumerate(self.enter)]
        for name, place in named:
            try:
                parts = place.gaussians(estimator.state)
            except ValueError as error:
                raise ValueError(f"{name}.{error}") from None
            count = place.initial if initial else place.rate * present(dt, self.lifetime)
            weights.append(np.full(len(parts.mean), count / len(parts.mean)))
            means.append(parts.mean)
            covs.append(parts.cov)
        prior = Gaussian(np.concatenate(means), np.concatenate(covs))
        cells = (-1, *[1] * len(in_gaussians.plane(estimator.state)))
        return Intensity(
            np.concatenate(weights).reshape(cells), estimator.start(prior, estimator.state, rng), np.arange(len(prior.mean))
        )

    def initial_memory(self, estimator: Estimator[Any], rng: np.random.Generator) -> Intensity:
        """Return the intensity before the first scan."""
        if self.recycles and estimator.traits.draws:
            raise ValueError(f"recycles: must be false, as {estimator.kind!r} would have to draw what comes back")
        return self._appearing(estimator, True, 0.0, rng)

    def predict(self, memory: Intensity, estimator: Estimator[Any], dt: float, rng: np.random.Generator) -> Intensity:
        """Return the intensity `dt` s later: what is left of it, moved, and what appeared."""
        if dt == 0:
            return memory
        new = self._appearing(estimator, False, dt, rng)
        # However short a step, what appears in it is not negligible at once: many such make up those of a long one.
        least = np.min(FADED * new.weights[new.weights > 0], initial=self.negligible)
        old = take(memory, memory.weights > least, 0)
        if old.number.shape[1] > 1 and len(old.number):
            old = fewer(old, estimator, dt)
        cells = (len(new.number), *old.number.shape[1:])
        number = np.concatenate([old.number * math.exp(-dt / self.lifetime), np.broadcast_to(new.number, cells)])
        belief = join(estimator.predict(old.belief, dt, rng), new.belief, 0)
        return Intensity(number, belief, np.concatenate([old.place, new.place]))

    def reveal(
        self, memory: Intensity, estimator: Estimator[Any], sensor: Sensor, detections: Detections, p_gate: float
    ) -> tuple[Array, Explained]:
        """Return the density (k,) of each return from an unseen target, and how each Gaussian explains it."""
        found = explained(memory, estimator, sensor, detections, p_gate)
        return found.rate, found

    def update(
        self,
        memory: Intensity,
        estimator: Estimator[Any],
        sensor: Sensor,
        detections: Detections,
        claimed: Array,
        p_gate: float,
    ) -> Intensity:
        """Return the intensity thinned by the probability of not being detected."""
        prior = estimator.moments(memory.belief)
        number = looked(memory.number, lambda at: in_gaussians.detection(prior, estimator.state, sensor, at[None]), p_gate)
        return Intensity(number, memory.belief, memory.place)

    def begin(
        self,
        found: Explained | None,
        estimator: Estimator[Any],
        sensor: Sensor,
        name: str,
        detections: Detections,
        claimed: Array,
    ) -> Newborn:
        """Return a track at each return that may be an unseen target's."""
        k = len(claimed)
        if found is None or not k:
            return Newborn.none(len(estimator.state))
        rate, clutter = found.rate, np.broadcast_to(sensor.clutter(detections.z), k)
        if detections.missing is not None:  # over the components that each return has
            lengths = [sensor.optional.get(name, 1.0) for name in sensor.measurement.names]
            clutter = clutter * np.exp(detections.missing @ np.log(lengths))
        some = (rate + clutter > 0) & detections.valid
        existence = np.where(some, rate / np.where(some, rate + clutter, 1.0), 0.0) * (1.0 - claimed)
        returns = np.flatnonzero((existence > 0) & (existence >= self.least))
        if not len(returns):
            return Newborn.none(len(estimator.state))
        return Newborn(returns, found.given(returns), existence[returns])

    def recycle(self, memory: Intensity, estimator: Estimator[Any], ended: Gaussian, existence: Array) -> Intensity:
        """Return the intensity; if it `recycles`, with a Gaussian for each track that ended, weighted by its existence."""
        if not self.recycles or not len(existence):
            return memory
        back = estimator.start(ended, estimator.state, NO_DRAWS)
        cells = (len(existence), *memory.number.shape[1:])
        number = np.broadcast_to(existence.reshape(-1, *[1] * (len(cells) - 1)), cells)
        place = np.concatenate([memory.place, np.full(len(existence), -1)])
        return Intensity(np.concatenate([memory.number, number]), join(memory.belief, back, 0), place)
