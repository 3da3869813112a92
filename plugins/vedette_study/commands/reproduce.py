"""`vedette reproduce`: reproduce a published study."""

from __future__ import annotations

import json
from argparse import Namespace
from functools import partial
from importlib.metadata import version
from pathlib import Path
from time import process_time

from vedette import ConfigError, Registry, Reproduction
from vedette.commands import options
from vedette_files.files_read import Inputs
from vedette_files.writing import check_folder, locked, write_texts
from vedette_report.drawing.brought import drawing
from vedette_report.drawing.canvas import Look
from vedette_report.findings import Findings, afresh
from vedette_report.output import write_charts
from vedette_report.progress import on_terminal
from vedette_study.checkpoint import Parts
from vedette_study.reproduction import data, text
from vedette_study.survey import survey


def run(arguments: Namespace) -> int:
    """Run the study, print its tables and verdicts, write them and the figures; 0 whatever the verdicts."""
    study = _study(arguments.paper)
    if arguments.grid and not study.unsaid:
        raise ConfigError.at("--grid", f"the study {study.kind!r} leaves nothing unsaid: it has no grid")
    usual = study.grid_runs if arguments.grid else study.full_runs if arguments.full else study.default_runs
    runs, seed = options.whole("--runs", arguments.runs, usual, 2), options.whole("--seed", arguments.seed, 1)
    folder = None if arguments.out is None else Path(arguments.out)
    look = drawing(arguments.format, arguments.columns, arguments.style).look
    with locked(folder, Inputs.of(arguments.style), ("study.txt", "study.json")):
        parts = _parts(folder, study, runs, seed, grid=arguments.grid, resume=arguments.resume)
        run = partial(survey, study) if arguments.grid else study.run
        before = process_time()
        with on_terminal() as progress:
            result = run(runs, seed, progress, parts or afresh)
        seconds = process_time() - before
        written = [] if folder is None else _write(folder, result, look)
        if parts is not None:
            parts.forget()
        print(text(result))  # once all is written: the reader may have gone
        print(f"{seconds:.1f} s of CPU time")
        if written:
            print(f"{folder}: {', '.join(written)}")
        if arguments.json:
            print(json.dumps(data(result) | {"cpu_seconds": seconds}))
        return 0


def _parts(folder: Path | None, study: Reproduction, runs: int, seed: int, *, grid: bool, resume: bool) -> Parts | None:
    """Return what keeps finished parts in the folder, if there is one; ConfigError if it holds those of another study."""
    if folder is None:
        if resume:
            raise ConfigError.at("--resume", "needs the folder of the study that it is to go on with: --out")
        return None
    check_folder(folder)
    about = {"paper": study.kind, "runs": runs, "seed": seed, "grid": grid, "version": version("vedette")}
    return Parts(folder, about, resume=resume)


def _study(name: str) -> Reproduction:
    """Return the study of a paper by its name, which may have hyphens; it has no parameters, so its class alone makes it."""
    made = Registry.installed().get("reproduction", name.replace("-", "_")).cls()
    assert isinstance(made, Reproduction)
    return made


def _write(folder: Path, result: Findings, look: Look) -> list[str]:
    """Write text, JSON and, where matplotlib is installed, the figures; return the names of the files."""
    folder.mkdir(parents=True, exist_ok=True)
    texts = {"study.txt": text(result) + "\n", "study.json": json.dumps(data(result), indent=2) + "\n"}
    return [*write_texts(folder, texts), *write_charts(folder, result.charts, look)]
