"""Many objects that appear and disappear by rates."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, final

import numpy as np
from attrs import Factory, frozen

from vedette import Array, MotionModel, Trajectory, fields
from vedette.sampling import Bounds, common_state, draw_jump_markov, union_state
from vedette_sim.random_motion import STARTS, check_models, switching

Modes = np.ndarray[Any, np.dtype[np.intp]]

_MOST = 100_000
"""More objects than this are taken for a wrong unit."""


@final
@frozen
class Population:
    """`count` objects at the beginning and a Poisson process of further ones, each gone after an exponential lifetime.

    With a rate l and a mean lifetime T, a scene of `duration` d holds a Poisson(l d) number of births, and at time t there
    are on average count e^(-t/T) + l T (1 - e^(-t/T)) objects: `count` = l T keeps it level. Each is drawn like a `Drawn`,
    independent of the others; `area` replaces `start` for axes that are uniform. Their names are NAME.1, NAME.2, ...

    >>> from vedette_standard import ConstantVelocity
    >>> start, area = {"y": (50.0, 4.0), "vx": (3.0, 0.0), "vy": (0.5, 0.0)}, {"x": Bounds(100.0, 180.0)}
    >>> some = Population((ConstantVelocity(1e-9),), start, area, count=400, rate=8.0, lifetime=25.0)
    >>> paths = some.members("p", np.arange(51.0), 50.0, np.random.default_rng(1))
    >>> born = np.array([path.times[0] for path in paths])
    >>> int(np.sum(born == 0)), abs(len(paths) - 800) < 4 * 20, paths[-1].name == f"p.{len(paths)}"
    (400, True, True)
    >>> there = [sum(path.times[0] <= t < path.times[-1] for path in paths) for t in (10.0, 40.0)]
    >>> left = np.exp(-np.array([10.0, 40.0]) / 25)
    >>> np.allclose(there, 400 * left + 8.0 * 25 * (1 - left), rtol=0.15), np.allclose(born[400:].mean(), 25.0, rtol=0.1)
    (True, True)
    >>> x = np.array([path.states[0] for path in paths])
    >>> np.allclose([x[:, 0].mean(), x[:, 0].std(), x[:, 1].std()], [140.0, 80 / 12**0.5, 4.0], rtol=0.1)
    True
    >>> ends = np.array([[path.times[-1] - path.times[0], *(path.states[-1] - path.states[0])[:2]] for path in paths])
    >>> np.allclose(ends[:, 1:], ends[:, :1] * [3.0, 0.5], atol=1e-3)
    True
    """

    models: tuple[MotionModel, ...] = fields.part("how each moves; several models take turns at each scan time")
    start: dict[str, tuple[float, float]] = fields.table(
        "axis to [mean, standard deviation] at the start", pairs=True, tried=STARTS
    )
    area: Mapping[str, Bounds] = fields.part(
        "axis to low and high, in the axis' own unit, where the start is uniform instead", default=Factory(dict)
    )
    transition: Array = switching()
    count: int = fields.integer("objects that are there from the beginning", default=0, at_most=_MOST)
    rate: float = fields.quantity("1/s", "births per second", default=0.0, at_least=0)
    lifetime: float | None = fields.quantity("s", "mean time until one is gone; default: all stay", default=None, above=0)

    def __attrs_post_init__(self) -> None:
        check_models(self.models, self.transition, self.start, self.area)
        common = common_state(self.models)
        if unknown := [name for name in self.area if name not in common]:
            raise ValueError(f"area: {unknown[0]} is not an axis that all models have: {common}")
        if self.count == 0 and self.rate == 0:
            raise ValueError("count: must be > 0 where there is no rate of births, got 0")

    def check(self, duration: float) -> None:
        """Raise ValueError if a scene of `duration` s cannot hold it."""
        if self.rate * duration > _MOST:
            raise ValueError(f"rate: makes more than {_MOST:,} births in {duration:.6g} s, got {self.rate:.6g} 1/s")

    def members(self, name: str, scan_times: Array, duration: float, rng: np.random.Generator) -> list[Trajectory]:
        """Draw all of them: each from its birth, at every scan while it is there."""
        born = np.sort(rng.uniform(0.0, duration, rng.poisson(self.rate * duration)))
        appears = np.concatenate([np.zeros(self.count), born])
        ages = np.full(len(appears), np.inf) if self.lifetime is None else rng.exponential(self.lifetime, len(appears))
        ends = np.minimum(appears + ages, duration)
        space, common = union_state(self.models), common_state(self.models)
        if not len(appears):
            return []
        x0, grid = self._starts(len(appears), rng), np.unique([*scan_times, duration])
        first, end = np.searchsorted(grid, appears, "right"), np.searchsorted(grid, ends, "right")
        states: list[Array] = [x[None] for x in x0]
        for group in np.split(np.arange(len(x0)), np.flatnonzero(np.diff(first)) + 1):
            begin, stop = int(first[group[0]]), int(np.max(end[group]))
            if begin < stop:
                modes, entered = self._enter(x0[group], appears[group], float(grid[begin]), rng)
                _, moved = draw_jump_markov(
                    self.models, self.transition, entered, modes, grid[begin:stop], rng, starts=self.start
                )
                for i, path in zip(group.tolist(), moved, strict=True):
                    states[i] = np.concatenate([states[i], path[: max(end[i] - begin, 0)]])
        axes = space.locate(common)
        return [
            Trajectory(f"{name}.{i + 1}", common, np.array([appears[i], *grid[first[i] : end[i]]]), path[:, axes])
            for i, path in enumerate(states)
        ]

    def _starts(self, count: int, rng: np.random.Generator) -> Array:
        """Draw first states over the axes that any model has: (count, u)."""
        names = union_state(self.models).names
        x0 = np.empty((count, len(names)))
        for i, name in enumerate(names):
            if name in self.area:
                x0[:, i] = rng.uniform(self.area[name].low, self.area[name].high, count)
            else:
                x0[:, i] = rng.normal(*self.start[name], count)
        return x0

    def _enter(self, x0: Array, appears: Array, time: float, rng: np.random.Generator) -> tuple[Modes, Array]:
        """Move first states (g, u), at the times `appears` (g,), to the next scan: modes (g,), states (g, u)."""
        alike = np.all(appears == appears[0])
        parts = [x0] if alike else [x[None] for x in x0]
        drawn = [
            draw_jump_markov(self.models, self.transition, part, 0, np.array([begin, time]), rng, starts=self.start)
            for part, begin in zip(parts, appears, strict=False)
        ]
        return np.concatenate([modes[:, 1] for modes, _ in drawn]), np.concatenate([x[:, 1] for _, x in drawn])
