"""The files of a run that grow with it: its recording, tracks and series, and its smoothed tracks."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from typing import final

import numpy as np
from attrs import evolve

from vedette import Array, Detections, Experiment, Gaussian, Scan, Track
from vedette.experiment import Steps
from vedette.tracking import State
from vedette_files import FrameFiles, TrackRows, recording_head, scan_line
from vedette_files.results import Results
from vedette_report.running.files import SERIES
from vedette_report.running.lagging import SmoothedFiles
from vedette_report.running.resuming import RECORDING, Checkpoints, Former
from vedette_report.running.track_files import TrackFiles
from vedette_report.series.recorder import Recorder
from vedette_report.warnings.turned import SAMPLED

MOST_RETURNS = 100_000
"""Returns of an excerpt: more are not kept."""

BLOCKS = 10
"""So many blocks that are judged are written into the series at a time at most: a killed run can be seen up to there."""


@final
class GrowingFiles:
    """What comes of each scan is added; whole blocks are written, and every few of them a place to go on from.

    The files are closed by `stack`.
    """

    def __init__(self, experiment: Experiment, results: Results, steps: Steps, lag: float | None, stack: ExitStack) -> None:
        tracker, self.place = experiment.tracker, results.place
        self._experiment, self._results, self._steps = experiment, results, steps
        self._spaces = {name: sensor.measurement for name, sensor in tracker.sensors.items()}
        detected = {name: self._spaces[name] for name in experiment.preprocessors}
        self._head = list(recording_head(evolve(steps.recording, detected=detected), self._spaces))
        self._frames = FrameFiles.of(self.place / RECORDING, steps.recording)
        self.recorder = Recorder(self.place / SERIES, experiment, steps, kept=False)
        self.smoothed = None if lag is None else SmoothedFiles(self.place, experiment, steps.recording, steps.state, lag)
        self.excerpt: list[Scan] = []
        """The first scans of returns, by which what looks wrong is told; they take a few MB."""
        self._told = 0, list[TrackRows]()
        self._left, self._blocks = MOST_RETURNS, 0
        self._checkpoints: Checkpoints | None = None
        extra = () if steps.state.links is None else ("link",)
        if self.smoothed is not None:
            stack.enter_context(self.smoothed)
        self.tracks = stack.enter_context(
            TrackFiles(self.place, tracker.state, steps.recording.notes, self.recorder.modes, extra=extra, grows=True)
        )
        self._recording = stack.enter_context((self.place / RECORDING).open("w", encoding="utf-8", newline="\n"))
        self._recording.writelines(self._head)

    def play(self, former: Former) -> None:
        """Write again what a run that did not come to its end had written."""
        told_later = None if self.smoothed is None else former.smoothed_rows(self.smoothed.none)
        for scan, rows in former.play(self._steps, self._head, self._spaces, self.recorder.none):
            self._take(scan)
            self.recorder.again(scan, rows)
            if self.smoothed is not None and told_later is not None:
                self.smoothed.again(scan, self._steps.state, told_later)
            self.write_if_full()
        if self.smoothed is not None and former.drawn:
            self.smoothed.go_on(former.smoothed)

    def keep_places(self) -> None:
        """From now on keep places to go on from."""
        self._checkpoints = Checkpoints(self.place, self._experiment, self.smoothed)
        self._checkpoints.write(self._steps, self.recorder.scans)

    def add(self, scan: Scan, state: State, estimate: Gaussian, modes: Array | None) -> None:
        """Add a scan, the tracks after it and what is estimated of them."""
        self._take(scan)
        self.recorder.add(scan, self._steps.before, state, estimate, modes)
        if self.smoothed is not None:
            self.smoothed.add(scan, self._steps.before, state)

    def _take(self, scan: Scan) -> None:
        self._recording.write(scan_line(scan, self._spaces, self._frames))
        if len(self.excerpt) < SAMPLED and isinstance(scan.detections, Detections) and len(scan.detections.z) <= self._left:
            self.excerpt.append(scan)
            self._left -= len(scan.detections.z)

    @property
    def first(self) -> tuple[Sequence[Scan], Sequence[Track]]:
        """The scans of the first blocks, and the tracks in these."""
        rows = TrackRows.join(self._told[1], self._experiment.tracker.state)
        return self.excerpt[: self._told[0]], rows.take(np.argsort(rows.track, kind="stable")).tracks()

    def write_if_full(self) -> None:
        """Write a block if it is whole."""
        if self.recorder.full:
            self._write()

    def _write(self) -> None:
        self.recorder.finish_block()
        rows = self.recorder.tracks.hand_out()
        self.tracks.write(rows)
        if self.recorder.scans <= SAMPLED:
            self._told = len(self.excerpt), [*self._told[1], rows]
        self._recording.flush()
        if self.smoothed is not None:
            self.smoothed.write()
        self._blocks += 1
        if self._blocks % BLOCKS == 0:
            self.recorder.flush()
        if self._checkpoints is not None:
            self._results.keep = True
            if self._blocks % BLOCKS == 0:
                self._checkpoints.write(self._steps, self.recorder.scans)

    def close(self) -> None:
        """Write what is left: the run has ended."""
        self._write()
        self.recorder.close()
        if self.smoothed is not None:
            self.smoothed.write(all_of_it=True)
