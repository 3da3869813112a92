"""Where chunks are run: here, in threads, in processes, or on the workers of a Dask cluster."""

from __future__ import annotations

import asyncio
import logging
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from threading import Thread
from typing import Any, cast

from vedette import ConfigError, Problem, Registry, VedetteError
from vedette_report.identity import Code, differences, tell
from vedette_report.provenance import identity, kinds_in
from vedette_study.plan import Plan

PATIENCE = 10.0
"""Seconds within which a scheduler must answer."""

WAIT = 600.0
"""Seconds for which a study waits for workers, by default: what a queue or an adaptive cluster may take to start some."""

KEPT = "; the chunks in --out are kept, and --resume continues from them"

Width = Callable[[], int]
"""Says how many chunks can run at once, now."""


@contextmanager
def local(plan: Plan, width: int) -> Iterator[tuple[Executor | None, Width]]:
    """Give threads if the runs go in lock-step, as the kernels release the lock; else processes; None for a width of one."""
    if width == 1 or (width > 1 and len(plan.points) * plan.count == 1):
        yield None, lambda: 1
        return
    pool = ThreadPoolExecutor(width) if plan.together else processes(width)
    try:
        yield pool, lambda: width
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def processes(width: int, begin: Callable[..., None] | None = None, given: Sequence[Any] = ()) -> ProcessPoolExecutor:
    """Return processes, each of which calls `begin` first; they end with this one, even where it is killed."""
    return ProcessPoolExecutor(width, get_context("spawn"), initializer=_begin, initargs=(begin, given))


@contextmanager
def worked_elsewhere(then: str = "") -> Iterator[None]:
    """Report in a line, with what is to be done `then`, a worker that was killed or could not say itself what is wrong."""
    try:
        yield
    except VedetteError:
        raise
    except CancelledError:
        raise VedetteError(f"the scheduler went away, and with it the work that it had{then}") from None
    except BrokenExecutor as error:
        text = "a worker was killed or could not start: where memory is short, fewer workers at once need less"
        raise VedetteError(f"{text}{then}") from error
    except Exception as error:
        text = f"a worker failed: {type(error).__name__}: {str(error).splitlines()[0] if str(error) else 'no reason given'}"
        raise VedetteError(f"{text}{then}") from error


def _begin(begin: Callable[..., None] | None, given: Sequence[Any]) -> None:
    Thread(target=_end_with_parent, daemon=True).start()
    if begin is not None:
        begin(*given)


def _end_with_parent() -> None:
    if (parent := parent_process()) is not None:
        parent.join()
        os._exit(1)


@contextmanager
def cluster(plan: Plan, code: Code, scheduler: Any, then: str = KEPT) -> Iterator[tuple[Executor, Width]]:
    """Connect to the workers of a Dask cluster, by its scheduler's address or a `distributed.Client`.

    Workers that are there are asked first whether they can build every point of the plan, with the same code; those that
    join later are asked with each chunk. ConfigError if the scheduler does not answer or a worker lacks something;
    VedetteError, with what is to be done `then`, if it goes away.
    """
    given = not isinstance(scheduler, str)
    client = scheduler if given else _client(scheduler)
    address = client.scheduler.address if given else scheduler
    with _told_here():
        try:
            _check(client, plan, code)
            yield client.get_executor(pure=False), lambda: _threads(client)
        except OSError as error:  # the connection broke while something was sent
            raise VedetteError(f"the scheduler at {address!r} went away: {error or type(error).__name__}{then}") from None
        finally:
            if not given:
                client.close()


@contextmanager
def dask_client(address: str) -> Iterator[Executor]:
    """Give the workers of a Dask cluster by its scheduler's address; ConfigError if none answers there."""
    client = _client(address)
    try:
        yield client.get_executor(pure=False)
    finally:
        client.close()


def _client(address: str) -> Any:
    """Return a client of the scheduler at an address; ConfigError if none answers."""
    try:
        import distributed
    except ImportError:
        raise VedetteError("--scheduler needs Dask: pip install 'vedette[cluster]'") from None
    dask: Any = distributed
    try:
        with ThreadPoolExecutor(1) as aside:  # this thread may run an event loop; a failed client would linger
            aside.submit(asyncio.run, _knock(address)).result()
        return dask.Client(address, timeout=PATIENCE, set_as_default=False)
    except Exception as error:  # whatever answers there, if it is no scheduler
        text = f"no Dask scheduler answers at {address!r}: {str(error).splitlines()[0] if str(error) else 'no answer'}"
        raise ConfigError.at("--scheduler", text) from None


def _threads(client: Any) -> int:
    """Return the threads of the workers that are there now; 1 where the scheduler is gone, as the work itself will tell."""
    try:
        told = client.scheduler_info(n_workers=-1)
    except TypeError:  # older Dask has no such argument
        told = client.scheduler_info()
    return sum(worker["nthreads"] for worker in told["workers"].values()) if "workers" in told else 1


@contextmanager
def _told_here() -> Iterator[None]:
    """Dask logs no tracebacks of a connection that breaks meanwhile: what went wrong is told once, by an error."""
    loggers = [logging.getLogger(f"distributed.{name}") for name in ("client", "batched", "core", "comm", "utils")]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)


async def _knock(address: str) -> None:
    """Raise an error if no Dask process answers in time."""
    import distributed
    from distributed import comm

    dask: Any = comm
    options = cast(Any, distributed).Security().get_connection_args("client")  # TLS, where Dask's configuration asks for it
    line = await asyncio.wait_for(dask.connect(address, timeout=PATIENCE, **options), PATIENCE)
    line.abort()


def _check(client: Any, plan: Plan, code: Code) -> None:
    """Raise ConfigError that says which workers lack what, or have other code; tell what of them may differ and does."""
    problems, told = list[Problem](), list[str]()
    kinds = sorted({kind for point in plan.points for kind in kinds_in(point.config)})
    for worker, answer in client.run(answer_of_worker, kinds, code.packages, on_error="return").items():
        if isinstance(answer, BaseException):
            problems.append(Problem(f"worker {worker}", f"cannot run Vedette: {type(answer).__name__}: {answer}"))
            continue
        missing, made = answer
        if missing:
            text = f"lacks {', '.join(map(repr, missing))}: install the same plugins there as here"
            problems.append(Problem(f"worker {worker}", text))
            continue
        refused, texts = differences(made, code.made, f"worker {worker}")
        told += texts + (list(map(str, refused)) if code.accept else [])
        problems += [] if code.accept else refused
    tell(told)
    if problems:
        raise ConfigError(problems)


def answer_of_worker(kinds: list[str], packages: tuple[str, ...]) -> tuple[list[str], dict[str, str]]:
    """Return, on a worker, which of these kinds are not installed, and its code."""
    known = {entry.kind for entry in Registry.installed()}
    return [kind for kind in kinds if kind not in known], identity(packages)
