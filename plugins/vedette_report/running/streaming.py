"""A run whose results are written as it goes and not kept: limited by the disk, with constant memory."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from signal import SIGINT, signal
from threading import current_thread, main_thread
from typing import Any, TypeVar, final

import numpy as np
from attrs import evolve, frozen

from vedette.errors import ConfigError, Problem
from vedette.experiment import NAMED, Experiment, Result, Steps
from vedette.metrics import Score
from vedette.progress import Progress, silent
from vedette.space import Array
from vedette.tracking import State, Tracker, check_again
from vedette.types import Detections, Gaussian, Scan
from vedette_files import FrameFiles, Tables, recording_head, scan_line
from vedette_files.files_read import NOTHING_READ, Inputs
from vedette_files.writing import Results, results_in
from vedette_report.figures import figures, length_unit
from vedette_report.running.files import NAMES, SERIES, write_config, write_of_plugins, write_summaries
from vedette_report.running.lagging import SmoothedFiles
from vedette_report.running.resuming import Checkpoints, Former
from vedette_report.running.smoothed import smoothed_figures, smoothed_summary
from vedette_report.running.track_files import TrackFiles
from vedette_report.series.recorder import Recorder
from vedette_report.summary.words import summary
from vedette_report.warnings.turned import SAMPLED

T = TypeVar("T")

MOST_RETURNS = 100_000
"""Returns of an excerpt: more are not kept."""
_BLOCKS = 10
"""So many blocks that are judged are written into the series at a time at most: a killed run can be seen up to there."""

Shown = Callable[[Scan, State, State, Gaussian, Array | None, Tables], None]
"""Is told what `Experiment.finish` tells its `watch`, and the tables of the scan, numbered from the run's first one on."""


@frozen(eq=False)
class Streamed:
    """What remains of a run whose results were written: `result` without tracks and scans, its score and figures.

    `problems`: what went wrong where plugins wrote files of their own.
    """

    result: Result
    score: Score
    text: str
    brief: str
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
    shown: Shown | None = None,
    reads: Inputs = NOTHING_READ,
    former: Former | None = None,
    lag: float | None = None,
) -> Streamed:
    """Run an experiment, write its tracks and its recording and judge them as it goes; only counts and sums stay in memory.

    The lines are those of a run that keeps all, in the order in which they came: some scans, and within them track by track.
    They are written into a part of the folder until the run has ended, so that one that is killed leaves the folder's
    former results as they were, and what it had done beside them. `steps` is the run if it is open already; `shown` is
    called after each of them, with its tables: each scan is then judged as it comes. `reads` is what the run reads, `former`
    a run that did not come to its end, from whose last state this one goes on; its place goes when this one has ended.
    With `lag`, in s, the tracks are also written as the scans of up to so much later tell them.
    """
    if experiment.retroactive:
        raise ConfigError([Problem("retroactive", "must be false where tracks are judged as they go, got true")])
    replaces = () if former is None else (former.place, *former.beside)
    with results_in(folder, reads, NAMES, replaces) as results:
        write_config(results.place, experiment)
        steps = experiment.steps(strict=strict, progress=progress) if steps is None else steps
        return _written(experiment, results, steps, shown, former, lag)


def _written(
    experiment: Experiment, results: Results, steps: Steps, shown: Shown | None, former: Former | None, lag: float | None
) -> Streamed:
    folder = results.place
    steps.intake.refused.limit(NAMED)
    tracker, interrupted = experiment.tracker, False
    spaces = {name: sensor.measurement for name, sensor in tracker.sensors.items()}
    detected = {name: spaces[name] for name in experiment.preprocessors}
    frames, notes = FrameFiles.of(folder / "recording.jsonl", steps.recording), steps.recording.notes
    recorder = Recorder(folder / SERIES, experiment, steps, kept=False)
    extra = () if steps.state.links is None else ("link",)
    looked = Excerpt()
    smoothed = None if lag is None else SmoothedFiles(folder, experiment, steps.recording, steps.state, lag)
    with (
        smoothed or nullcontext(),
        TrackFiles(folder, tracker.state, notes, recorder.modes, extra=extra, grows=True) as tracks,
        (folder / "recording.jsonl").open("w", encoding="utf-8", newline="\n") as recording,
    ):
        described = evolve(steps.recording, detected=detected)
        recording.writelines(recording_head(described, spaces))

        blocks, checkpoints = 0, None

        def write() -> None:
            nonlocal blocks
            recorder.finish_block()
            tracks.write(recorder.tracks.hand_out())
            recording.flush()
            if smoothed is not None:
                smoothed.write()
            blocks += 1
            if blocks % _BLOCKS == 0:
                recorder.flush()
            if checkpoints is not None:
                results.keep = True
                if blocks % _BLOCKS == 0:
                    checkpoints.write(steps, recorder.scans)

        if former is not None:
            told_later = None if smoothed is None else former.smoothed_rows(smoothed.none)
            for scan, rows in former.play(steps, recording_head(described, spaces), spaces, recorder.none):
                recording.write(scan_line(scan, spaces, frames))
                looked.add(scan)
                recorder.again(scan, rows)
                if smoothed is not None and told_later is not None:
                    smoothed.again(scan, steps.state, told_later)
                if recorder.full:
                    write()
            if smoothed is not None and former.drawn:
                smoothed.go_on(former.smoothed)
        checkpoints = Checkpoints(folder, experiment, smoothed)
        if recorder.scans or smoothed is not None:  # one that begins anew is to smooth as it did
            checkpoints.write(steps, recorder.scans)
        defined, held = True, Held()
        try:
            for scan, state in held.apart(steps):
                recording.write(scan_line(scan, spaces, frames))
                looked.add(scan)
                estimate, modes = estimates(tracker, state)
                if defined and np.isnan(np.sum(estimate.mean) + np.sum(state.existence)):  # told once, of the first scan
                    defined = False
                    check_again(experiment, partial(_again, tracker, steps.before, scan))
                recorder.add(scan, steps.before, state, estimate, modes)
                if smoothed is not None:
                    smoothed.add(scan, steps.before, state)
                if shown is not None:
                    shown(scan, steps.before, state, estimate, modes, recorder.judged())
                if recorder.full:
                    write()
        except KeyboardInterrupt:
            interrupted = True
        write()
        recorder.close()
        if smoothed is not None:
            smoothed.write(all_of_it=True)
    result = experiment.outcome(steps, interrupted=interrupted)
    return _concluded(result, folder, recorder, evolve(result, scans=tuple(looked.scans)), tracks, smoothed, lag)


def _concluded(
    result: Result,
    folder: Path,
    recorder: Recorder,
    seen: Result,
    tracks: TrackFiles,
    smoothed: SmoothedFiles | None,
    lag: float | None,
) -> Streamed:
    """Write the figures and the summary of a run that ended; `seen` is the same run with its first scans."""
    experiment, score = result.made_by, recorder.judge.score()
    told = figures(experiment, result, score)
    text, brief = (summary(experiment, seen, score, recorder.bands, brief=short) for short in (False, True))
    further: list[str] = []
    if smoothed is not None and lag is not None:
        later = smoothed.score()
        told |= {"smoothed": smoothed_figures(lag, later)}
        compared = smoothed_summary(score, later, lag, length_unit(experiment))
        text, brief, further = text + compared, brief + compared, smoothed.names
    summaries = write_summaries(folder, experiment, told, text)
    written = (*tracks.names[:2], "recording.jsonl", SERIES, *summaries, *tracks.names[2:], *further)
    of_plugins, problems = write_of_plugins(folder, experiment, result, "vedette_files_of_stream")
    return Streamed(result, score, text, brief, told, (*written, *of_plugins), tuple(problems))


@final
class Excerpt:
    """The first scans of returns, by which what looks wrong is told; they take a few MB."""

    def __init__(self) -> None:
        self.scans: list[Scan] = []
        self._left = MOST_RETURNS

    def add(self, scan: Scan) -> None:
        """Keep a scan, if there is room."""
        if len(self.scans) < SAMPLED and isinstance(scan.detections, Detections) and len(scan.detections.z) <= self._left:
            self.scans.append(scan)
            self._left -= len(scan.detections.z)


@final
class Held:
    """Lets Ctrl-C end a run between two scans: one that is being written is written whole."""

    def __init__(self) -> None:
        self._busy = self._asked = False

    def apart(self, steps: Iterable[T]) -> Iterator[T]:
        """Yield what comes; KeyboardInterrupt only while the next is waited for. Threads are not interrupted at all."""
        former = signal(SIGINT, self._interrupted) if current_thread() is main_thread() else None
        try:
            for step in steps:
                self._busy = True
                yield step
                self._busy = False
                if self._asked:
                    raise KeyboardInterrupt
        finally:
            if former is not None:
                signal(SIGINT, former)

    def _interrupted(self, number: int, frame: Any) -> None:
        self._asked = True
        if not self._busy:
            raise KeyboardInterrupt


def estimates(tracker: Tracker, state: State) -> tuple[Gaussian, Array | None]:
    """Return the estimates (t,) after a scan, and the mode probabilities (t, r), if any."""
    return tracker.estimate(state), tracker.estimator.mode_prob(state.belief)


def _again(tracker: Tracker, before: State, scan: Scan) -> None:
    tracker.estimate(tracker.step(before, scan))
