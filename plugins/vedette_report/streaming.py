"""A run whose results are written as it goes and not kept: limited by the disk, with constant memory."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from attrs import evolve, frozen

from vedette.errors import ConfigError, Problem
from vedette.experiment import NAMED, Experiment, Result, Steps, Watch
from vedette.metrics import Score
from vedette.progress import Progress, silent
from vedette.space import Space
from vedette.tracking import History, State, Tracker, check_again
from vedette.types import Scan
from vedette_files import (
    PARQUET,
    FrameFiles,
    Terms,
    Write,
    csv_head,
    csv_rows,
    geojson_pieces,
    jsonl_head,
    jsonl_rows,
    parquet_pieces,
    recording_head,
    scan_line,
)
from vedette_report.figures import figures
from vedette_report.files import write_of_plugins, write_summaries
from vedette_report.series import Recorder
from vedette_report.summary import summary


@frozen(eq=False)
class Streamed:
    """What remains of a run whose results were written: `result` without tracks and scans, its score and figures.

    `problems`: what went wrong where plugins wrote files of their own.
    """

    result: Result
    score: Score
    text: str
    figures: dict[str, Any]
    files: tuple[str, ...]
    problems: tuple[Problem, ...] = ()


def stream(
    experiment: Experiment,
    folder: Path,
    *,
    strict: bool = False,
    progress: Progress = silent,
    steps: Steps | None = None,
    watch: Watch | None = None,
) -> Streamed:
    """Run an experiment, write its tracks and its recording and judge them as it goes; only counts and sums stay in memory.

    The lines are those of a run that keeps all, in the order in which they came: some scans, and within them track by track.
    The files have their names from the beginning, so a run that is killed leaves what it had done. `steps` is the run if it
    is open already; `watch` is called after each of them.
    """
    if experiment.retroactive:
        raise ConfigError([Problem("retroactive", "must be false where tracks are judged as they go, got true")])
    folder.mkdir(parents=True, exist_ok=True)
    try:
        return _written(experiment, folder, strict, progress, steps, watch)
    except OSError as error:
        if error.filename is not None:
            raise
        raise OSError(error.errno, f"{error.strerror}; what was written before is kept", str(folder)) from None


def _written(
    experiment: Experiment, folder: Path, strict: bool, progress: Progress, steps: Steps | None, watch: Watch | None
) -> Streamed:
    steps = experiment.steps(strict=strict, progress=progress) if steps is None else steps
    steps.intake.refused.limit(NAMED)
    tracker, interrupted = experiment.tracker, False
    spaces = {name: sensor.measurement for name, sensor in tracker.sensors.items()}
    detected = {name: spaces[name] for name in experiment.preprocessors}
    history = History(tracker)
    frames, terms = FrameFiles.of(folder / "recording.jsonl", steps.recording), Terms.of(steps.recording.notes)
    recorder = Recorder(folder / "series.npz", experiment, steps, kept=False)
    with ExitStack() as stack:
        table, lines, recording = (
            stack.enter_context((folder / name).open("w", encoding="utf-8", newline="\n"))
            for name in ("tracks.csv", "tracks.jsonl", "recording.jsonl")
        )
        table.write(csv_head(tracker.state, recorder.modes, terms))
        lines.write(jsonl_head(tracker.state))
        recording.writelines(recording_head(evolve(steps.recording, detected=detected), spaces))
        further, names = _in_its_terms(stack, folder, steps.recording.notes, tracker.state, terms)

        def write() -> None:
            recorder.finish_block()
            pieces = history.hand_out()
            for each in further:
                each(pieces)
            for track in pieces:
                table.writelines(csv_rows(track, terms))
                lines.writelines(jsonl_rows(track))
            for file in (table, lines, recording):
                file.flush()

        defined = True
        try:
            for scan, state in steps:
                recording.write(scan_line(scan, spaces, frames))
                estimate, modes = history.add(state)
                if defined and np.isnan(np.sum(estimate.mean) + np.sum(state.existence)):  # told once, of the first scan
                    defined = False
                    check_again(experiment, partial(_again, tracker, steps.before, scan))
                recorder.add(scan, steps.before, state, estimate, modes)
                if watch is not None:
                    watch(scan, steps.before, state, estimate, modes)
                if recorder.full:
                    write()
        except KeyboardInterrupt:
            interrupted = True
        write()
        recorder.close()
    intake = steps.intake
    result = Result(
        tracks=(),
        recording=steps.recording,
        scans=(),
        refused=tuple(intake.refused.first),
        begun=steps.state.born,
        seconds=steps.seconds,
        interrupted=interrupted,
        approximated=steps.state.approximated,
        intake=intake,
        experiment=experiment,
    )
    score = recorder.judge.score()
    found, text = figures(experiment, result, score), summary(experiment, result, score, recorder.bands)
    summaries = write_summaries(folder, experiment, found, text)
    written = ("tracks.csv", "tracks.jsonl", "recording.jsonl", "series.npz", *summaries)
    own, problems = write_of_plugins(folder, experiment, result, "vedette_files_of_stream")
    return Streamed(result, score, text, found, (*written, *names, *own), tuple(problems))


def _again(tracker: Tracker, before: State, scan: Scan) -> None:
    tracker.estimate(tracker.step(before, scan))


def _in_its_terms(
    stack: ExitStack, folder: Path, notes: Mapping[str, str], space: Space, terms: Terms
) -> tuple[list[Write], list[str]]:
    """Open the files of tracks as their recording came, as `write_files` writes them; return what writes, and the names."""
    further, names = [], []
    if "latitude" in terms.columns(space):
        further.append(stack.enter_context(geojson_pieces(folder / "tracks.geojson", terms)))
        names.append("tracks.geojson")
    if notes.get("table") == PARQUET and find_spec("pyarrow"):
        further.append(stack.enter_context(parquet_pieces(folder / "tracks.parquet", space, terms)))
        names.append("tracks.parquet")
    return further, names
