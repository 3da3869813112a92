"""The series of a run, collected scan by scan: what its page and its pictures show. docs/formats.md lists the columns."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import BinaryIO, final

import numpy as np
from attrs import frozen

from vedette.config import installed_figures
from vedette.experiment import Experiment, Result, Steps
from vedette.metrics import ENTRIES, SCANS, Block, RunningJudge
from vedette.space import Array
from vedette.tracking import State
from vedette.types import Gaussian, Recording, Scan
from vedette_files import Column, SeriesFile, Tables
from vedette_report.series_about import about, no_rows
from vedette_report.series_judged import judged
from vedette_report.series_rows import ScanRows
from vedette_report.traces import Bands, Judged

_FEW = 10
"""Scans whose rows are held apart."""

_KEPT = 500_000
"""Numbers that a run which keeps nothing may keep for the figures of whole tracks: 4 MB, some 3,000 scans of few tracks."""


@final
class SeriesWriter:
    """Collects what each scan did to the tracks, and writes it once the scans are judged. It does not grow with the run."""

    def __init__(self, target: Path | BinaryIO, experiment: Experiment, recording: Recording, modes: int) -> None:
        self._of = ScanRows(experiment, recording)
        self._scans = self._entries = 0
        self._joined: list[Tables] = [no_rows(len(experiment.tracker.state), self._of.axes, modes)]
        self._rows: list[Tables] = []
        self._file = SeriesFile(target, about(experiment, recording, self._of.plane, modes))

    def add(self, scan: Scan, before: State, state: State, estimate: Gaussian, modes: Array | None) -> None:
        """Collect a scan, the states before and after it, and that one's estimates (t,) and mode probabilities (t, r)."""
        rows = self._of.of(scan, before, state, estimate, modes)
        rows["returns"]["scan"] += self._scans
        rows["entries"]["scan"] += self._scans
        rows["weights"]["entry"] += self._entries
        self._rows.append(rows)
        self._scans += 1
        self._entries += len(state.ids)
        if len(self._rows) >= _FEW:
            self._join()

    def finish_block(self, block: Block | None) -> None:
        """Write the scans since the last block, with what the judge says of them."""
        self._join()
        if not self._joined:
            return
        (joined,), self._joined = self._joined, []
        tables: dict[str, dict[str, Column]] = {table: {**columns} for table, columns in joined.items()}
        first = self._scans - len(tables["scans"]["time"])
        more = judged(block, len(tables["scans"]["time"]), tables["entries"]["confirmed"])
        tables["scans"] |= more["scans"]
        tables["entries"] |= more["entries"]
        tables["truth"] = self._of.true(tables["scans"]["time"], first)
        self._file.add(tables)

    def close(self) -> None:
        """Write what waits."""
        self._file.flush()

    def _join(self) -> None:
        """Put the rows of some scans together: many small arrays take several times the memory of what is in them."""
        if self._rows:
            self._joined = [together([*self._joined, *self._rows])]
        self._rows = []


def together(parts: Sequence[Tables]) -> Tables:
    """Return tables with the rows of all parts."""
    return {
        table: {name: np.concatenate([part[table][name] for part in parts]) for name in columns}
        for table, columns in parts[0].items()
    }


@final
class Recorder:
    """Judges a run as it goes, and writes its series block by block; `judge` has its score.

    `kept`: the run keeps all, so the judge may keep what the figures of whole tracks need, and the blocks.
    """

    def __init__(self, target: Path | BinaryIO, experiment: Experiment, steps: Steps, *, kept: bool = True) -> None:
        tracker, recording = experiment.tracker, steps.recording
        self.judge = RunningJudge(
            recording.truth,
            tracker.state,
            experiment.judge,
            tracker.gate.probability,
            sensors=tracker.sensors,
            figures=installed_figures(),
            keep=np.inf if kept else _KEPT,
        )
        modes = tracker.estimator.mode_prob(steps.state.belief)
        self.modes = 0 if modes is None else modes.shape[-1]
        self.bands, self.blocks, self._kept = Bands(), list[Block](), kept
        self._writer = SeriesWriter(target, experiment, recording, self.modes)
        self._scans = self._entries = 0

    def add(self, scan: Scan, before: State, state: State, estimate: Gaussian, modes: Array | None) -> None:
        """Take what `Experiment.finish` tells its `watch`."""
        self._writer.add(scan, before, state, estimate, modes)
        self.judge.add(scan, state.ids, state.confirmed, estimate, state.nis, state.hit, modes)
        self._scans, self._entries = self._scans + 1, self._entries + 1 + len(state.ids)
        if self._kept and self.full:
            self.finish_block()

    @property
    def full(self) -> bool:
        """Whether enough has come for a block."""
        return self._scans >= SCANS or self._entries >= ENTRIES

    def finish_block(self) -> None:
        """Judge and write what came since the last block."""
        block = self.judge.finish_block()
        if block is not None:
            self.bands.add(block)
            if self._kept:
                self.blocks.append(block)
        self._writer.finish_block(block)
        self._scans = self._entries = 0

    def close(self) -> None:
        """Judge and write what is left."""
        self.finish_block()
        self._writer.close()


@frozen(eq=False)
class Recorded:
    """A run that kept all: its result, what the judge said of it, and the content of `series.npz`."""

    result: Result
    judged: Judged
    packed: bytes


def recorded_run(experiment: Experiment, steps: Steps, *, keep_states: bool = False) -> Recorded:
    """Make all steps of a run that was opened, and keep and judge them."""
    packed = BytesIO()
    series = Recorder(packed, experiment, steps)
    result = experiment.finish(steps, keep_states=keep_states, watch=series.add)
    series.close()
    if experiment.retroactive:  # the judge saw the tracks before they were known to be confirmed from the start
        judged = Judged.of(experiment, result, installed_figures())
    else:
        judged = Judged(series.judge.score(), tuple(series.blocks), np.array([track.id for track in result.tracks]))
    return Recorded(result, judged, packed.getvalue())
