"""Where chunks are run: here, in threads, in processes, or on the workers of a Dask cluster."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Iterator, Mapping
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from typing import Any, cast

from vedette.config import Registry
from vedette.errors import ConfigError, Problem, VedetteError
from vedette_study.execution import KEPT
from vedette_study.plan import Plan
from vedette_study.store import made_by


@contextmanager
def local(plan: Plan, width: int) -> Iterator[tuple[Executor | None, int]]:
    """Give threads if the runs go in lock-step, as the kernels release the lock; else processes; None for a width of one."""
    if width == 1 or (width > 1 and len(plan.points) * plan.count == 1):
        yield None, 1
        return
    pool = ThreadPoolExecutor(width) if plan.together else ProcessPoolExecutor(width, get_context("spawn"))
    try:
        yield pool, width
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


@contextmanager
def cluster(plan: Plan, address: str, seconds: float = 10.0) -> Iterator[tuple[Executor, int]]:
    """Connect to a Dask scheduler's workers, each asked first whether it can build every point of the plan.

    ConfigError if the scheduler does not answer or a worker lacks something.
    """
    try:
        import distributed
    except ImportError:
        raise VedetteError("--scheduler needs Dask: pip install 'vedette[cluster]'") from None
    dask: Any = distributed
    try:
        with ThreadPoolExecutor(1) as aside:  # this thread may run an event loop; a failed client would linger
            aside.submit(asyncio.run, _knock(address, seconds)).result()
        client = dask.Client(address, timeout=seconds, set_as_default=False)
    except Exception as error:  # whatever answers there, if it is no scheduler
        text = f"no Dask scheduler answers at {address!r}: {str(error).splitlines()[0] if str(error) else 'no answer'}"
        raise ConfigError([Problem("--scheduler", text)]) from None
    with _told_here():
        try:
            known = client.scheduler_info(n_workers=-1)["workers"]
            if not known:
                raise ConfigError([Problem("--scheduler", f"the scheduler at {address!r} has no workers")])
            _check(client, plan)
            yield client.get_executor(pure=False), sum(each["nthreads"] for each in known.values())
        except OSError as error:  # the connection broke while something was sent
            raise VedetteError(f"the scheduler at {address!r} went away: {error or type(error).__name__}; {KEPT}") from None
        finally:
            client.close()


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


async def _knock(address: str, seconds: float) -> None:
    """Raise an error if no Dask process answers in time."""
    import distributed
    from distributed import comm

    dask: Any = comm
    options = cast(Any, distributed).Security().get_connection_args("client")  # TLS, where Dask's configuration asks for it
    line = await asyncio.wait_for(dask.connect(address, timeout=seconds, **options), seconds)
    line.abort()


def _check(client: Any, plan: Plan) -> None:
    """Raise ConfigError that says which workers lack what."""
    here, problems = made_by(), []
    kinds = sorted({kind for point in plan.points for kind in kinds_in(point.config)})
    for worker, answer in client.run(answer_of_worker, kinds, on_error="return").items():
        if isinstance(answer, BaseException):
            problems.append(Problem(f"worker {worker}", f"cannot run Vedette: {type(answer).__name__}: {answer}"))
            continue
        missing, versions = answer
        if missing:
            text = f"lacks {', '.join(map(repr, missing))}: install the same plugins there as here"
            problems.append(Problem(f"worker {worker}", text))
        if versions["vedette"] != here["vedette"]:
            problems.append(Problem(f"worker {worker}", f"has Vedette {versions['vedette']}, here is {here['vedette']}"))
    if problems:
        raise ConfigError(problems)


def answer_of_worker(kinds: list[str]) -> tuple[list[str], dict[str, str]]:
    """Return, on a worker, which of these kinds are not installed, and the versions."""
    known = {entry.kind for entry in Registry.installed()}
    return [kind for kind in kinds if kind not in known], made_by()


def kinds_in(config: Any) -> Iterator[str]:
    """Yield all kinds that a config names."""
    if isinstance(config, Mapping):
        if isinstance(config.get("kind"), str):
            yield config["kind"]
        for each in config.values():
            yield from kinds_in(each)
    elif isinstance(config, list | tuple):
        for each in config:
            yield from kinds_in(each)
