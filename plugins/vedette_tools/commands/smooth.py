"""`vedette smooth`: named positions, cleaned and smoothed."""

from __future__ import annotations

import json
import os
from argparse import Namespace
from contextlib import nullcontext
from pathlib import Path

from attrs import asdict

from vedette.commands import DONE, options
from vedette.errors import ConfigError
from vedette_files.files_read import Inputs
from vedette_files.tables.columnar import SUFFIX
from vedette_files.writing import terminable
from vedette_report.figures import count
from vedette_report.progress import on_terminal
from vedette_study.executors import dask_client, processes
from vedette_tools.drafting.wishes import Wishes
from vedette_tools.smoothing.batches import tables
from vedette_tools.smoothing.files import smooth_files
from vedette_tools.smoothing.table import seconds

MANY_GROSS = 0.1
"""Where a larger part of positions is gross, something else is wrong."""


def run(arguments: Namespace) -> int:
    """Smooth the files, and say what was done."""
    paths = tables([Path(path) for path in arguments.data])
    first = Path(arguments.data[0])
    suffix = paths[0].suffix.lower() if paths[0].suffix.lower() == SUFFIX else ".csv"
    out = Path(arguments.out) if arguments.out else Path(f"{first.stem}-smoothed{suffix}")
    if out.suffix.lower() != suffix and (out.suffix or suffix != SUFFIX):
        folder = ", or have no suffix: a folder of such files" if suffix == SUFFIX else ""
        raise ConfigError.at("--out", f"must end in {suffix} as what is read{folder}, got {str(out)!r}")
    Inputs.of(paths).check(out)
    if out.exists():
        raise ConfigError.at("--out", f"{str(out)!r} exists already: delete it, or name another file")
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    workers = options.whole("--workers", arguments.workers, cores, 1)
    stated = (arguments.time, arguments.rate, arguments.columns, arguments.units, arguments.dates)
    wishes = Wishes.of(*stated, None, None)
    every, gap = seconds("--every", arguments.every), seconds("--gap", arguments.gap)
    on_one = nullcontext() if workers == 1 else processes(workers)
    on_several = dask_client(arguments.scheduler) if arguments.scheduler else on_one
    with terminable(), on_several as executor, on_terminal() as progress:
        told, why, assumed, back = smooth_files(paths, out, arguments.by, every, gap, executor, progress, wishes)
    parts = f"{count(told.objects, 'object')} in {count(told.pieces, 'piece')}"
    others = f"; {told.elsewhere:,} rows of ranges and bearings left out: they are no positions" if told.elsewhere else ""
    left_out = told.left_out - told.elsewhere
    lost = f"; {left_out:,} rows left out: {why or 'no time, no name or other columns'}" if left_out else ""
    print(f"{told.rows:,} rows of {parts}; {told.gross:,} positions are gross{others}{lost}")
    if told.gross > MANY_GROSS * told.rows:
        print("so many gross positions may be of several objects taken for one: --by names the column that tells them apart")
    if back:
        print(f"LOOKS WRONG: {back}")
    if told.mixed:
        mixed = count(told.mixed, "object")
        print(f"rows of {mixed} seem to be of several under one name: no deviation is claimed of them, their cells hold nan")
    for guess in assumed:
        print(f"assumed: {guess}")
    print(f"written to {out}: {told.written:,} rows")
    if arguments.json:
        print(json.dumps({"out": str(out), **asdict(told)}))
    return DONE
