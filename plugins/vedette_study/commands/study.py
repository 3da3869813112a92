"""`vedette study`: a grid of trackers over many runs."""

from __future__ import annotations

import json
import os
import shutil
import warnings
from argparse import Namespace
from collections.abc import Mapping
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import attrs

from vedette.commands import DONE, FAILED, INTERRUPTED, options
from vedette.errors import ConfigError
from vedette_files.files_read import Inputs
from vedette_files.writing import check_folder, locked
from vedette_report.drawing.brought import drawing
from vedette_report.drawing.canvas import Look
from vedette_report.output import can_write, write_charts
from vedette_report.progress import on_terminal
from vedette_report.warnings.words import of_recording
from vedette_study.judgement import demand_comparable, judgement, read_judgement, verdicts, write_judgement
from vedette_study.outcome import Outcome
from vedette_study.plan import plan, read_study
from vedette_study.store import told
from vedette_study.study import perform
from vedette_study.summary import charts, text, write_study

INPUT = ("source", "sensors", "preprocessors")
"""The parts of a config by which its input is read: points that are alike in them read the same."""

FILES = ("manifest.json", "summary.txt", "summary.json", "summary.csv", "study.zarr/", "report.html")
"""Files that a study may leave, besides pictures and chunks."""


def _asked(arguments: Namespace, kept: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return the table of the study, with what the options say, or a judgement that it is held against."""
    table = read_study(arguments.study, alone=bool(kept or arguments.write))
    if kept is not None:
        table |= {"runs": kept["runs"], "seed": kept["seed"]}
        if arguments.runs is not None or arguments.seed is not None:
            raise ConfigError.at("--against", "the judgement says how many runs and from which seed: leave out both")
    numbers = {"runs": arguments.runs, "seed": arguments.seed, "chunk": arguments.chunk}
    return table | {name: options.whole(f"--{name}", given, 0) for name, given in numbers.items() if given is not None}


def run(arguments: Namespace) -> int:
    """Run the study, print its tables, write its files; return 130 if Ctrl-C ended it early."""
    kept = None if arguments.against is None else read_judgement(Path(arguments.against))
    table = _asked(arguments, kept)
    folder = None if arguments.out is None else Path(arguments.out)
    if folder is not None:
        check_folder(folder)
    look = drawing(arguments.format, arguments.columns, arguments.style).look
    planned = plan(table, arguments.overrides)
    if kept is not None:
        demand_comparable(planned, kept)
    threads = options.whole("--threads", arguments.threads, len(os.sched_getaffinity(0)))
    began, cpu = perf_counter(), process_time()
    reads = Inputs.of(arguments.study, arguments.style, [at.config for at in planned.points])
    with locked(folder, reads, FILES):
        with on_terminal() as progress:
            outcome = perform(
                planned,
                threads=threads,
                out=folder,
                resume=arguments.resume,
                scheduler=arguments.scheduler,
                accept_other_code=arguments.accept_other_code,
                wait=float(options.whole("--wait", arguments.wait, 600)),
                progress=progress,
            )
        seconds = perf_counter() - began
        inputs = {json.dumps([at.config.get(part) for part in INPUT], default=str): at.experiment for at in planned.points}
        used, written = process_time() - cpu, list[str]()
        if folder is not None:
            with told(folder):
                written = _write(folder, outcome, look)
        judged = [] if kept is None or outcome.interrupted else verdicts(outcome, kept)
        if arguments.write and not outcome.interrupted:
            write_judgement(Path(arguments.write), judgement(outcome, kept))
        for said in dict.fromkeys(said for experiment in inputs.values() for said in of_recording(experiment)):
            print(f"LOOKS WRONG: {said}")
        print(text(outcome))  # once all is written: the reader may have gone
        print(f"{seconds:.1f} s, {used:.1f} s of CPU time in this process")
        if written:
            print(f"{folder}: {', '.join(written)}")
        for verdict in judged:
            print(verdict)
        if arguments.json:
            against = [attrs.asdict(verdict) for verdict in judged]
            print(json.dumps(outcome.data() | {"seconds": seconds} | ({"against": against} if judged else {})))
        failed = FAILED if any(verdict.fails for verdict in judged) else DONE
        return INTERRUPTED if outcome.interrupted else failed


def _write(folder: Path, outcome: Outcome, look: Look) -> list[str]:
    """Write tables always, labelled arrays and pictures where their libraries are installed; return the files' names."""
    written = write_study(folder, outcome)
    if can_write("labelled arrays", "study", "xarray", "zarr"):
        written.append(_write_zarr(folder, outcome))
    return written + write_charts(folder, charts(outcome), look)


def _write_zarr(folder: Path, outcome: Outcome) -> str:
    """Write `study.zarr` beside the old one, then put it in its place; returns its name."""
    name = "study.zarr"
    unfinished = folder / f".{name}.part"
    shutil.rmtree(unfinished, ignore_errors=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # zarr's own, on strings and on metadata that it may change
        outcome.dataset().to_zarr(unfinished, mode="w", consolidated=False)
    shutil.rmtree(folder / name, ignore_errors=True)
    unfinished.rename(folder / name)
    return name
