"""`vedette run`: from a config to tracks, figures and pictures."""

from __future__ import annotations

import json
import sys
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from time import process_time
from typing import TYPE_CHECKING, Any

import numpy as np
from attrs import evolve

from vedette import ConfigError, Experiment, LazyScans, Result, Scan, load, to_config
from vedette.commands import DONE, INTERRUPTED, options
from vedette.experiment import Steps
from vedette.tracking import check_smoothing
from vedette.types import come_once
from vedette_files.files_read import Inputs
from vedette_files.results import results_in, settle, unfinished_runs
from vedette_files.writing import check_folder, locked
from vedette_report.drawing.brought import drawing
from vedette_report.figures import figures, length_unit, timings
from vedette_report.progress import on_terminal
from vedette_report.running.files import NAMES, write_config, write_files, write_of_plugins
from vedette_report.running.finishing import Finishing
from vedette_report.running.smoothed import read_lag, smooth_result, smoothed_figures, smoothed_summary, write_smoothed
from vedette_report.series.recorder import recorded_run
from vedette_report.summary.words import summary

if TYPE_CHECKING:
    from vedette_report.running.resuming import Former

LONG, MANY = 10_000, 1_000_000
"""More scans, or more returns, are judged and written as they come, and not kept: so many returns took 2 GB if of tracks."""


def run(arguments: Namespace) -> int:
    """Run, write and report; return 130 if Ctrl-C ended it early, with what was done written all the same."""
    begun = process_time()
    if arguments.resume:
        return _go_on(arguments, begun)
    if arguments.config is None:
        raise ConfigError.at("CONFIG", "is missing: name the config of the run, or --resume with its folder")
    experiment = load(arguments.config, overrides=options.overrides(arguments))
    folder = Path(arguments.out) if arguments.out else Path("out") / Path(arguments.config).stem
    check_folder(folder)
    reads = Inputs.of(arguments.config, arguments.style, to_config(experiment))
    pictures = drawing(arguments.format, arguments.columns, arguments.style)
    lag = None if arguments.smooth is None else read_lag(arguments.smooth)
    _check(arguments, experiment, lag)
    keep = arguments.keep or arguments.strict or lag == np.inf or experiment.retroactive
    with on_terminal() as progress:
        steps = experiment.steps(strict=arguments.strict, progress=progress, named=np.inf)
        if arguments.stream or (not keep and _is_long(steps.recording.scans)):
            return _stream(experiment, steps, folder, reads, arguments, begun, lag=lag)
        with results_in(folder, reads, (*NAMES, *pictures.names())) as results:
            write_config(results.place, experiment)
            with Finishing() as finishing:
                recorded = recorded_run(experiment, steps, keep_states=lag is not None, tracked=finishing.begin)
                result, judged = recorded.result, recorded.judged
                score = judged.score
                numbers, text = figures(experiment, result, score), summary(experiment, result, score, judged.bands)
                told = text if arguments.all else summary(experiment, result, score, judged.bands, brief=True)
                smoothed = None if lag is None else smooth_result(experiment, recorded, lag)
                if lag is not None and smoothed is not None:
                    numbers |= {"smoothed": smoothed_figures(lag, smoothed.score)}
                    compared = smoothed_summary(score, smoothed.score, lag, length_unit(experiment))
                    text, told = text + compared, told + compared
                written = write_files(results.place, experiment, recorded, numbers, text)
                if smoothed is not None:
                    written += write_smoothed(results.place, experiment, result, smoothed)
            stopped = finishing.pressed
            try:
                if pictures.possible() and not stopped:
                    written += pictures.of_run(evolve(result, judged=judged), results.place)
            except KeyboardInterrupt:
                stopped = True
            if stopped:
                print("vedette: interrupted before all pictures were drawn: all else of the run is kept", file=sys.stderr)
            further, problems = write_of_plugins(results.place, experiment, result)
    written += [*([_page(folder)] if arguments.report else []), *further]
    for problem in problems:
        print(f"vedette: {problem}", file=sys.stderr)
    _tell(arguments, result, told, numbers, f"{folder}: {', '.join(written)}", begun)
    return INTERRUPTED if result.interrupted or stopped else DONE


def _check(arguments: Namespace, experiment: Experiment, lag: float | None) -> None:
    """Raise ConfigError if options exclude one another, or what the config asks for."""
    if arguments.stream and (arguments.keep or lag == np.inf):
        keeps = "--keep keeps" if arguments.keep else "--smooth without a lag needs"
        raise ConfigError.at("--stream", f"keeps nothing of the past, which {keeps}: give one of the two")
    if arguments.stream and experiment.retroactive:
        told = "judges tracks as they go, but retroactive = true tells of a track's first scans later: give one of the two"
        raise ConfigError.at("--stream", told)
    if lag is not None:
        check_smoothing(experiment.tracker)


def _is_long(scans: Sequence[Scan]) -> bool:
    """Return whether scans are so many, or hold so many returns, that a run of them is not kept."""
    if isinstance(scans, LazyScans) or len(scans) > LONG:
        return len(scans) > LONG
    return sum(len(scan.detections.z) for scan in scans) > MANY


def _go_on(arguments: Namespace, begun: float) -> int:
    """Go on from a streamed run that did not come to its end."""
    from vedette_report.running.resuming import Former

    for option in ("out", "keep", "smooth"):
        if getattr(arguments, option) not in (None, False):
            told = "a run that goes on writes into the folder that --resume names, and keeps nothing of the past"
            raise ConfigError.at(f"--{option}", told)
    folder = Path(arguments.resume)
    check_folder(folder)
    with locked(folder):
        settled = settle(folder)
    if settled and not unfinished_runs(folder):
        print(f"vedette: {folder}: the run had come to its end; its last files are in their places now", file=sys.stderr)
        return DONE
    former = Former.of(folder)
    config = former.place / "config.json" if arguments.config is None else arguments.config
    experiment = load(config, overrides=options.overrides(arguments))
    former.check(experiment, accept=arguments.accept_other_code)
    told = f"goes on from scan {former.scans:,} of {former.place.name}" if former.scans else "begins anew"
    print(f"vedette: {folder}: the run did not end, and {told}", file=sys.stderr)
    reads = Inputs.of(config, to_config(experiment))
    with on_terminal() as progress:
        steps = experiment.steps(strict=arguments.strict, progress=progress, named=np.inf)
        return _stream(experiment, steps, folder, reads, arguments, begun, former, former.lag)


def _stream(
    experiment: Experiment,
    steps: Steps,
    folder: Path,
    reads: Inputs,
    arguments: Namespace,
    begun: float,
    former: Former | None = None,
    lag: float | None = None,
) -> int:
    """Run, write and judge during the run, and keep nothing in memory."""
    from vedette_report.running.streaming import stream

    done = stream(experiment, folder, steps=steps, reads=reads, former=former, lag=lag)
    if not arguments.stream and former is None:
        large = f"of more than {LONG:,} scans or {MANY:,} returns"
        long = "whose end is not known" if come_once(steps.recording.scans) else large
        why = f"a run {long} keeps no history, so there are no pictures; --keep draws them"
        print(f"vedette: {why}", file=sys.stderr)
    for problem in done.problems:
        print(f"vedette: {problem}", file=sys.stderr)
    written = [*done.files, *([_page(folder)] if arguments.report else [])]
    text = done.text if arguments.all else done.brief
    _tell(arguments, done.result, text, done.figures, f"{folder}: {', '.join(written)}", begun)
    return INTERRUPTED if done.result.interrupted else DONE


def _page(folder: Path) -> str:
    """Write the page of the run; return its name."""
    from vedette_report.page.build import write_page

    write_page(folder, folder / "report.html")
    return "report.html"


def _tell(arguments: Namespace, result: Result, text: str, numbers: dict[str, Any], written: str, begun: float) -> None:
    """Print the result of a run, and what a scan took; `begun`: the s of CPU before it."""
    took = timings(result)
    print(text if arguments.all else f"{text}\nsummary.txt has more, and --all prints it")
    if took["seconds_per_scan"] is not None:
        rest = 1e3 * (process_time() - begun - result.seconds) / result.intake.scans
        beside = "" if arguments.resume else f" to track, {rest:.3g} to read, judge, write and draw"
        print(f"{1e3 * took['seconds_per_scan']:.3g} ms a scan{beside}")
    print(written)
    if arguments.json:
        print(json.dumps(numbers | took))
