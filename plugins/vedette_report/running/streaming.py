"""A run whose results are written as it goes and not kept: limited by the disk, with constant memory."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from attrs import evolve, frozen

from vedette import Array, ConfigError, Experiment, Gaussian, Problem, Progress, Result, Scan, Tracker
from vedette.experiment import LOOKED_AT, NAMED, Steps
from vedette.metrics import Score
from vedette.progress import silent
from vedette.tracking import State, check_again
from vedette_files import Tables
from vedette_files.files_read import NOTHING_READ, Inputs
from vedette_files.results import Results, results_in
from vedette_report.drawing.brought import drawing
from vedette_report.figures import figures, length_unit
from vedette_report.running.files import NAMES, SERIES, write_config, write_of_plugins, write_summaries
from vedette_report.running.growing import GrowingFiles
from vedette_report.running.resuming import RECORDING, Former
from vedette_report.running.smoothed import smoothed_figures, smoothed_summary
from vedette_report.summary.words import summary

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
        raise ConfigError.at("retroactive", "must be false where tracks are judged as they go, got true")
    replaces = () if former is None else (former.place, *former.beside)
    with results_in(folder, reads, (*NAMES, *drawing().names()), replaces) as results:
        write_config(results.place, experiment)
        steps = experiment.steps(strict=False, progress=progress) if steps is None else steps
        return _written(experiment, results, steps, shown, former, lag)


def _written(
    experiment: Experiment, results: Results, steps: Steps, shown: Shown | None, former: Former | None, lag: float | None
) -> Streamed:
    steps.intake.refused.limit(NAMED)
    tracker, interrupted, confirmed = experiment.tracker, False, False
    with ExitStack() as stack:
        files = GrowingFiles(experiment, results, steps, lag, stack)
        if former is not None:
            files.play(former)
        files.keep_places()
        try:
            for scan, state in steps.apart():
                estimate, modes = estimates(tracker, state)
                confirmed = confirmed or bool(np.any(state.confirmed))
                files.add(scan, state, estimate, modes)
                if shown is not None:
                    shown(scan, steps.before, state, estimate, modes, files.recorder.judged())
                files.write_if_full()
        except KeyboardInterrupt:
            interrupted = True
        if not confirmed:
            check_again(experiment, partial(steps.again, files.excerpt[:LOOKED_AT]))
        files.close()
    return _concluded(experiment.outcome(steps, interrupted=interrupted), files, lag)


def _concluded(result: Result, files: GrowingFiles, lag: float | None) -> Streamed:
    """Write the figures and the summary of a run that ended."""
    experiment, score, smoothed = result.made_by, files.recorder.judge.score(), files.smoothed
    told = figures(experiment, result, score)
    seen = evolve(result, scans=tuple(files.excerpt))
    first, bands = files.first, files.recorder.bands
    text, brief = (summary(experiment, seen, score, bands, brief=short, first=first) for short in (False, True))
    further: list[str] = []
    if smoothed is not None and lag is not None:
        later = smoothed.score()
        told |= {"smoothed": smoothed_figures(lag, later)}
        compared = smoothed_summary(score, later, lag, length_unit(experiment))
        text, brief, further = text + compared, brief + compared, smoothed.names
    summaries = write_summaries(files.place, experiment, told, text)
    written = (*files.tracks.names[:2], RECORDING, SERIES, *summaries, *files.tracks.names[2:], *further)
    of_plugins, problems = write_of_plugins(files.place, experiment, result, "vedette_files_of_stream")
    return Streamed(result, score, text, brief, told, (*written, *of_plugins), tuple(problems))


def estimates(tracker: Tracker, state: State) -> tuple[Gaussian, Array | None]:
    """Return the estimates (t,) after a scan, and the mode probabilities (t, r), if any."""
    return tracker.estimate(state), tracker.estimator.mode_prob(state.belief)
