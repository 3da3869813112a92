"""Carry out a plan: chunk after chunk, on any executor, until all are done, precise enough, or interrupted."""

from __future__ import annotations

import math
import platform
import time
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from contextlib import contextmanager
from itertools import islice

from attrs import evolve, frozen

from vedette import Experiment, Progress, VedetteError
from vedette_report.identity import Code, check, tell
from vedette_report.provenance import digest, identity
from vedette_study.chunk import Chunk, run_chunk
from vedette_study.executors import KEPT, worked_elsewhere
from vedette_study.plan import Plan
from vedette_study.redraw import Redraw
from vedette_study.statistics import precise
from vedette_study.store import Store

POLL = 1.0
"""Seconds after which a study looks anew who works, where no chunk is done meanwhile."""

Chunks = list[list[Chunk]]
"""Order: first by the position in the runs, then by the point of the grid, so all points hold the same runs."""


@frozen
class Failed:
    """A worker's message on a chunk that cannot be run; exceptions themselves do not travel well between processes."""

    text: str


def attempt(
    experiment: Experiment, seed: int, runs: range, together: bool, redraw: Redraw | None, code: Code
) -> Chunk | Failed:
    """Run one chunk, wherever this is called; a worker with other code than the study's does not."""
    try:
        made = identity(code.packages)
        check(made, code.made, f"a worker on {platform.node()}", accept=code.accept)
        return evolve(run_chunk(experiment, seed, runs, together, redraw), made=digest(made))
    except VedetteError as error:
        return Failed(str(error))


@contextmanager
def threads_alone() -> Iterator[None]:
    """Restrict BLAS to one thread meanwhile, if threadpoolctl is installed: the chunks take the cores."""
    try:
        from threadpoolctl import threadpool_limits
    except ImportError:
        yield
        return
    with threadpool_limits(1):
        yield


def carry_out(
    plan: Plan,
    code: Code,
    store: Store | None,
    executor: Executor | None,
    width: Callable[[], int],
    progress: Progress,
    patience: float = math.inf,
) -> tuple[Chunks, bool]:
    """Run all chunks in order; return them and whether it was interrupted; those in `store` are not run again.

    Chunks past the one at which the wanted precision is reached do not count, so the result does not depend on the width.
    `width` is asked again and again, as workers come and go; VedetteError if there is none for `patience` s.
    """
    work = _Work(plan, code, store, progress)
    try:
        with threads_alone():
            if executor is None:
                work.here()
            else:
                work.on(executor, width, patience)
    except KeyboardInterrupt:
        if not work.whole:
            raise
        return work.whole, True
    return work.whole, False


def _waiting(wide: int, since: float | None, patience: float, then: str) -> float | None:
    """Return since when there has been no worker, told once; None if there is one. VedetteError after `patience` s."""
    if wide > 0:
        return None
    now = time.monotonic()
    if since is None:
        tell([f"there is no worker: waiting for up to {patience:g} s"])
        return now
    if now - since > patience:
        raise VedetteError(f"no worker came in {patience:g} s{then}")
    return since


class _Work:
    """What is done so far; `whole` holds the chunks up to the first that some point lacks."""

    def __init__(self, plan: Plan, code: Code, store: Store | None, progress: Progress) -> None:
        self.plan, self.code, self.store = plan, code, store
        self.whole: Chunks = []
        self.enough = False
        self._done: dict[tuple[int, int], Chunk] = {}
        self._runs = iter(progress(range(plan.runs * len(plan.points)), "runs"))

    def here(self) -> None:
        """Run one chunk after the other."""
        for k, point in self._missing():
            self._take(k, point, attempt(*self._order(k, point)))

    def on(self, executor: Executor, width: Callable[[], int], patience: float) -> None:
        """Run up to twice as many chunks at a time as can run, so that no worker waits and an interrupt loses little.

        Some are handed in while there is no worker, too: an adaptive cluster starts workers for what waits.
        """
        missing, running = self._missing(), dict[Future[Chunk | Failed], tuple[int, int]]()
        alone, then = None, "" if self.store is None else KEPT
        try:
            while True:
                wide = width()
                alone = _waiting(wide, alone, patience, then)
                while len(running) < 2 * max(wide, 1) and (following := next(missing, None)) is not None:
                    k, point = following
                    running[executor.submit(attempt, *self._order(k, point))] = following
                if not running:
                    return
                for future in wait(running, timeout=POLL, return_when=FIRST_COMPLETED).done:
                    with worked_elsewhere(then):
                        came = future.result()
                    self._take(*running.pop(future), came)
        finally:
            for future in running:
                future.cancel()

    def _order(self, k: int, point: int) -> tuple[Experiment, int, range, bool, Redraw | None, Code]:
        """Return what to run; some kilobytes if it goes to another process."""
        plan = self.plan
        return plan.points[point].experiment, plan.seed, plan.runs_of(k), plan.together, plan.redraw, self.code

    def _missing(self) -> Iterator[tuple[int, int]]:
        """Yield the chunks to run, until enough are done; those in the store are taken from there."""
        for k in range(self.plan.count):
            for point in range(len(self.plan.points)):
                if self.enough:
                    return
                kept = None if self.store is None else self.store.read(point, k, len(self.plan.runs_of(k)))
                if kept is None:
                    yield k, point
                else:
                    self._note(k, point, kept)

    def _take(self, k: int, point: int, came: Chunk | Failed) -> None:
        if isinstance(came, Failed):
            raise VedetteError(f"{self.plan.points[point].name}: {came.text}")
        if self.store is not None:
            self.store.write(point, k, came)
        self._note(k, point, came)

    def _note(self, k: int, point: int, chunk: Chunk) -> None:
        self._done[k, point] = chunk
        deque(islice(self._runs, len(self.plan.runs_of(k))), maxlen=0)  # these are already done
        points = range(len(self.plan.points))
        while not self.enough and all((len(self.whole), i) in self._done for i in points):
            self.whole.append([self._done.pop((len(self.whole), i)) for i in points])
            self.enough = precise(self.whole, self.plan.precision)
