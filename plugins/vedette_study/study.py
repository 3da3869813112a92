"""Studies of many runs, from Python: `vedette.monte_carlo`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from attrs import evolve

from vedette.config import read_file
from vedette.errors import ConfigError
from vedette.progress import Progress, silent
from vedette_report.identity import Code
from vedette_study.execution import carry_out
from vedette_study.executors import KEPT, WAIT, cluster, local
from vedette_study.outcome import Outcome, outcome
from vedette_study.plan import Plan, plan, whole
from vedette_study.store import kept_chunk, open_store


def monte_carlo(
    config: Mapping[str, Any] | str | Path,
    runs: int,
    seed: int = 0,
    *,
    sweep: Mapping[str, Sequence[Any]] | None = None,
    trackers: Mapping[str, Mapping[str, Any]] | None = None,
    average: Sequence[str] = (),
    redraw: Mapping[str, Any] | None = None,
    precision: Mapping[str, Any] | None = None,
    chunk: int = 0,
    threads: int = 1,
    out: str | Path | None = None,
    resume: bool = False,
    scheduler: Any = None,
    accept_other_code: bool = False,
    wait: float = WAIT,
    progress: Progress = silent,
) -> Outcome:
    """Run a config `runs` times, at every point of the grid that `trackers` and `sweep` span, with common random numbers.

    Run i draws from SeedSequence(seed, spawn_key=(i,)), whatever `chunk`, `threads` or `scheduler`: to the last bit on one
    machine with one chunk, to 1e-12 otherwise. With `out`, finished chunks are kept there and `resume` continues from them.
    Of a recording each run draws what `redraw` says: by default it leaves out a tenth of the returns. Figures are averaged
    over the swept paths in `average`. `precision` maps figures to standard errors at which the study may stop early.
    `scheduler` is the address of a Dask scheduler, or a `distributed.Client`; the study waits `wait` s for workers. Workers
    and kept chunks of other code are refused unless `accept_other_code`. `progress` wraps the runs, to show how far the
    study is. ConfigError reports all that is wrong.
    """
    table = {
        "experiment": read_file(config) if isinstance(config, str | Path) else config,
        "runs": runs,
        "seed": seed,
        "chunk": chunk,
        "sweep": sweep or {},
        "trackers": trackers or {},
        "average": list(average),
        "redraw": redraw or {},
    }
    if precision is not None:
        table["precision"] = precision
    return perform(
        plan(table),
        threads=threads,
        out=out,
        resume=resume,
        scheduler=scheduler,
        accept_other_code=accept_other_code,
        wait=wait,
        progress=progress,
    )


def perform(
    planned: Plan,
    *,
    threads: int = 1,
    out: str | Path | None = None,
    resume: bool = False,
    scheduler: Any = None,
    accept_other_code: bool = False,
    wait: float = WAIT,
    progress: Progress = silent,
) -> Outcome:
    """Carry out a plan; see `monte_carlo`."""
    whole("threads", threads, 1, 4096)
    if resume and out is None:
        raise ConfigError.at("--resume", "needs the folder of the study that it is to go on with: --out")
    if resume and out is not None and not planned.given.get("chunk") and (kept := kept_chunk(Path(out))):
        planned = evolve(planned, chunk=kept)  # the default goes by the number of runs, and there may be more now
    code = Code.of((point.config for point in planned.points), "vedette_study", accept=accept_other_code)
    then = "" if out is None else KEPT
    with local(planned, threads) if scheduler is None else cluster(planned, code, scheduler, then) as (executor, width):
        store = None if out is None else open_store(Path(out), planned, code, resume=resume)
        chunks, interrupted = carry_out(planned, code, store, executor, width, progress, wait)
    return outcome(planned, chunks, interrupted=interrupted)
