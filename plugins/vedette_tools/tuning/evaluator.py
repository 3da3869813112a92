"""Evaluations asked for by position in the ranges: each run once, here or in other processes, and kept."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from threading import Lock
from typing import Literal, final

import numpy as np

from vedette import Array, Experiment
from vedette_study.executors import processes, worked_elsewhere
from vedette_tools.tuning.checkpoint import Kept
from vedette_tools.tuning.evaluation import Data, evaluate, moments, open_data
from vedette_tools.tuning.parameters import Free
from vedette_tools.tuning.unstated import Unstated

Criterion = Literal["likelihood", "consistency"]

_HERE: dict[str, Data] = {}
"""In another process: the data that it opened."""


def run_one(data: Data, free: Sequence[Free], values: tuple[float, ...], by: Criterion) -> Array | None:
    """Return what a criterion is made of: (2, s) the log-likelihood of each scan, and how many returns of no track were
    expected in it; or the moments over all of them (q,).
    """
    if by == "consistency":
        gathered = moments(data, free, values)
        return None if gathered is None else gathered.normalised(slice(0, data.tuned))
    evaluated = evaluate(data, free, values)
    return None if evaluated is None else np.stack([evaluated.loglik, evaluated.expected])


def _open(experiment: Experiment, part: float) -> None:
    _HERE["data"] = open_data(experiment, part)


def _run_there(unstated: Unstated, free: Sequence[Free], values: tuple[float, ...], by: Criterion) -> Array | None:
    if _HERE["data"].unstated.number != unstated.number:
        _HERE["data"] = _HERE["data"].within(unstated)
    return run_one(_HERE["data"], free, values, by)


@final
class Asker:
    """Answers how high the criterion is at positions in the ranges (p,); `evaluations` counts those that it ran.

    `best` is the highest position (p,) asked for, None as long as the tracker could run at none.
    """

    def __init__(self, data: Data, free: Sequence[Free], by: Criterion, kept: Kept, pool: Executor | None) -> None:
        self.data, self.free, self.by, self.evaluations = data, tuple(free), by, 0
        self.best: Array | None = None
        self._kept, self._pool, self._lock = kept, pool, Lock()
        self._order: tuple[float, ...] = (-np.inf,)

    def go_on(self, data: Data) -> None:
        """Go on with the same data, of which something is known better that the config does not state."""
        self.data, self.best, self._order = data, None, (-np.inf,)

    def values(self, position: Array) -> tuple[float, ...]:
        """Return the parameters at a position."""
        inside = np.clip(position, 0.0, 1.0)
        return tuple(float(f"{float(each.value(u)):.12g}") for each, u in zip(self.free, inside, strict=True))

    def found(self, position: Array) -> Array | None:
        """Return what the criterion is made of at a position; None if the tracker cannot run there."""
        values, data = self.values(position), self.data
        key = (float(data.unstated.number), *values)
        with self._lock:
            if key in self._kept:
                return self._kept[key]
        if self._pool is None:
            evaluated = run_one(data, self.free, values, self.by)
        else:
            with worked_elsewhere(self._kept.then):
                evaluated = self._pool.submit(_run_there, data.unstated, self.free, values, self.by).result()
        with self._lock:
            self._kept.add(key, evaluated)
            self.evaluations += 1
        return evaluated

    def height(self, position: Array) -> float:
        """Return the criterion, to be made as large as possible: -inf where the tracker cannot run."""
        evaluated = self.found(position)
        if evaluated is None:
            return -np.inf
        height = float(np.sum(evaluated[0])) if self.by == "likelihood" else -0.5 * float(np.sum(evaluated**2))
        order = (height, *position.tolist())  # of two as high always the same one, whichever thread came first
        with self._lock:
            if np.isfinite(height) and order > self._order:
                self.best, self._order = np.array(position), order
        return height

    def heights(self, positions: Sequence[Array]) -> list[float]:
        """Return the criterion at several positions, which are run at once if there are workers."""
        if self._pool is None:
            return [self.height(each) for each in positions]
        with ThreadPoolExecutor(max(len(positions), 1)) as threads:
            return list(threads.map(self.height, positions))


@contextmanager
def asker(data: Data, free: Sequence[Free], by: Criterion, kept: Kept, workers: int, part: float) -> Iterator[Asker]:
    """Give an asker with so many processes, which open the recording themselves; one needs none."""
    if workers == 1:
        yield Asker(data, free, by, kept, None)
        return
    pool = processes(workers, _open, (data.experiment, part))
    try:
        yield Asker(data, free, by, kept, pool)
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
