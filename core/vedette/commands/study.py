"""`vedette study`: a grid of trackers over many runs."""

from __future__ import annotations

import json
import os
from argparse import Namespace
from pathlib import Path
from time import perf_counter, process_time

from vedette.commands import asked
from vedette.commands.ending import DONE, INTERRUPTED
from vedette.commands.output import can_write, look_of, write_charts
from vedette.montecarlo.outcome import Outcome
from vedette.montecarlo.plan import plan, read_study
from vedette.montecarlo.store import told
from vedette.montecarlo.study import perform
from vedette.progress import on_terminal
from vedette.report.canvas import Look
from vedette.report.files import check_folder
from vedette.report.montecarlo import charts, text, write_study
from vedette.report.warnings import of_recording

INPUT = ("source", "sensors", "preprocessors")
"""The parts of a config by which its input is read: points that are alike in them read the same."""


def run(arguments: Namespace) -> int:
    """Run the study, print its tables, write its files; return 130 if Ctrl-C ended it early."""
    table = read_study(arguments.study)
    for name in ("runs", "seed", "chunk"):
        given = getattr(arguments, name)
        if given is not None:
            table[name] = asked.whole(f"--{name}", given, 0)
    folder = None if arguments.out is None else Path(arguments.out)
    if folder is not None:
        check_folder(folder)
    look = look_of(arguments)
    planned = plan(table, arguments.overrides)
    threads = asked.whole("--threads", arguments.threads, len(os.sched_getaffinity(0)))
    began, cpu = perf_counter(), process_time()
    with on_terminal() as progress:
        outcome = perform(
            planned, threads=threads, out=folder, resume=arguments.resume, scheduler=arguments.scheduler, progress=progress
        )
    seconds = perf_counter() - began
    inputs = {json.dumps([at.config.get(part) for part in INPUT], default=str): at.experiment for at in planned.points}
    for said in dict.fromkeys(said for experiment in inputs.values() for said in of_recording(experiment)):
        print(f"LOOKS WRONG: {said}")
    print(text(outcome))
    print(f"{seconds:.1f} s, {process_time() - cpu:.1f} s of CPU time in this process")
    if folder is not None:
        with told(folder):
            print(f"{folder}: {', '.join(_write(folder, outcome, look))}")
    if arguments.json:
        print(json.dumps(outcome.data() | {"seconds": seconds}))
    return INTERRUPTED if outcome.interrupted else DONE


def _write(folder: Path, outcome: Outcome, look: Look) -> list[str]:
    """Write tables always, labelled arrays and pictures where their libraries are installed; return the files' names."""
    written = write_study(folder, outcome)
    if can_write("labelled arrays", "study", "xarray", "zarr"):
        from vedette.montecarlo.arrays import write_zarr

        written.append(write_zarr(folder, outcome))
    return written + write_charts(folder, charts(outcome), look)
