"""A run whose results are written as it goes and not kept: limited by the disk, with constant memory."""

from __future__ import annotations

import json
from contextlib import ExitStack
from pathlib import Path
from typing import Any, final

import numpy as np
from attrs import evolve, frozen

from vedette.config import to_config
from vedette.experiment import Experiment, Result
from vedette.io.atomic import whole_file
from vedette.io.frames import FrameFiles
from vedette.io.jsonl import recording_head, scan_line
from vedette.io.tracks import csv_head, csv_rows, jsonl_head, jsonl_rows
from vedette.metrics import Score
from vedette.metrics.consistency import gate_truncation
from vedette.progress import Progress, silent
from vedette.report.figures import figures
from vedette.report.summary import head, innovation_rows, rows
from vedette.tracking.history import History
from vedette.tracking.state import State
from vedette.types import Scan

_SCANS, _ENTRIES = 200, 5_000
"""After so many scans, or tracks times scans, the tracks' histories are written and dropped."""


@frozen(eq=False)
class Streamed:
    """What remains of a run whose results were written: `result` without tracks and scans, `score` without the truth."""

    result: Result
    score: Score
    text: str
    figures: dict[str, Any]
    files: tuple[str, ...]


@final
class _Innovations:
    """Sums over confirmed tracks, as in `judge`: the NIS, its expectation, and the number of axes."""

    def __init__(self, experiment: Experiment) -> None:
        self._sensor, self._gate = experiment.judge.sensor, experiment.tracker.gate.probability
        self._factor: dict[tuple[int, float], float] = {}
        self.tracks = 0
        self.total = self.expected = self.axes = 0.0
        self._confirmed: set[int] = set()

    def add(self, scan: Scan, state: State) -> None:
        """Add one scan."""
        alive = set(state.ids[state.confirmed].tolist())
        self.tracks += len(alive - self._confirmed)
        self._confirmed = alive | (self._confirmed & set(state.ids.tolist()))
        m = scan.detections.z.shape[-1]
        used = state.confirmed & (state.nis > 0)
        if self._sensor in (None, scan.sensor) and used.any():
            gate = self._gate if scan.frame is None else 1.0
            if (m, gate) not in self._factor:
                self._factor[m, gate] = float(gate_truncation(m, gate))
            self.total += float(np.sum(state.nis[used]))
            self.expected += float(np.sum(state.hit[used])) * m * self._factor[m, gate]
            self.axes += m * int(np.count_nonzero(state.hit[used] > 0.5))

    @property
    def nis(self) -> float | None:
        """The sum over what is expected; None if no confirmed track took a return."""
        return self.total / self.expected if self.expected > 0 else None


def stream(experiment: Experiment, folder: Path, *, strict: bool = False, progress: Progress = silent) -> Streamed:
    """Run an experiment and write its tracks and its recording as it goes; only counts and sums stay in memory.

    The lines are those of a run that keeps all, in the order in which they came: some scans, and within them track by track.
    The files have their names from the beginning, so a run that is killed leaves what it had done.
    """
    folder.mkdir(parents=True, exist_ok=True)
    steps = experiment.steps(strict=strict, progress=progress)
    tracker, seen, interrupted = experiment.tracker, _Innovations(experiment), False
    spaces = {name: sensor.measurement for name, sensor in tracker.sensors.items()}
    detected = {name: spaces[name] for name in experiment.preprocessors}
    history, waiting = History(tracker), 0
    frames = FrameFiles.of(folder / "recording.jsonl", steps.recording)
    modes = tracker.estimator.mode_prob(steps.state.belief)
    with ExitStack() as stack:
        table, lines, recording = (
            stack.enter_context((folder / name).open("w", encoding="utf-8", newline="\n"))
            for name in ("tracks.csv", "tracks.jsonl", "recording.jsonl")
        )
        table.write(csv_head(tracker.state, 0 if modes is None else modes.shape[-1]))
        lines.write(jsonl_head(tracker.state))
        recording.writelines(recording_head(evolve(steps.recording, detected=detected), spaces))

        def write() -> None:
            for track in history.hand_out():
                table.writelines(csv_rows(track))
                lines.writelines(jsonl_rows(track))
            for file in (table, lines, recording):
                file.flush()

        try:
            for scan, state in steps:
                recording.write(scan_line(scan, spaces, frames))
                seen.add(scan, state)
                history.add(state)
                waiting += 1 + len(state.ids)
                if waiting >= _ENTRIES or history.scans >= _SCANS:
                    write()
                    waiting = 0
        except KeyboardInterrupt:
            interrupted = True
        write()
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
    )
    score = Score(scans=0, tracks=seen.tracks, nis=seen.nis)
    found, text = figures(experiment, result, score), _summary(experiment, result, score, seen)
    for name, content in (
        ("config.json", json.dumps(to_config(experiment), indent=2) + "\n"),
        ("summary.json", json.dumps(found, indent=2) + "\n"),
        ("summary.txt", text),
    ):
        with whole_file(folder / name) as file:
            file.write(content)
    names = ("tracks.csv", "tracks.jsonl", "recording.jsonl", "config.json", "summary.json", "summary.txt")
    return Streamed(result, score, text, found, names)


def _summary(experiment: Experiment, result: Result, score: Score, seen: _Innovations) -> str:
    """Return the summary of a run that kept nothing."""
    lines = head(experiment, result, score)
    if result.recording.truth:
        lines += rows([("not judged", "against the truth: that takes the tracks' histories, which --stream does not keep")])
    lines += ["", "Are the covariances as large as the errors?", *rows(innovation_rows(score.nis, seen.axes))]
    return "\n".join(lines) + "\n"
