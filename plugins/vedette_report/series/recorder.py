"""The series of a run, collected scan by scan: what its page and its pictures show, and what its tracks are written from.

docs/reference/series.md lists the columns.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
from typing import BinaryIO, final

import numpy as np
from attrs import evolve, frozen

from vedette import Array, Experiment, Frame, Gaussian, Indices, Mask, Recording, Result, Scan
from vedette.experiment import Steps
from vedette.metrics import ENTRIES, SCANS, Block, RunningJudge
from vedette.tracking import State
from vedette_files import Column, Series, SeriesFile, SeriesTracks, Tables, TrackRows, full_covariances, read_series
from vedette_report.figures import forgiven_figures
from vedette_report.series.about import about
from vedette_report.series.judged import judged
from vedette_report.series.rows import ScanRows
from vedette_report.series.tables import no_rows, together
from vedette_report.series.traces import Bands, Judged

_FEW = 10
"""Scans whose rows are held apart: many small arrays take several times the memory of what is in them."""

_KEPT = 500_000
"""Numbers that a run which keeps nothing may keep for the figures of whole tracks: 4 MB, some 3,000 scans of few tracks."""

_BARE = Frame(np.zeros((1, 1)))
"""Stands for a frame until the run is over: all of them would not fit into memory."""


@frozen(eq=False)
class SmoothedSteps:
    """The recording of a run that is over and a state of it, in place of `Steps`."""

    recording: Recording
    state: State


@frozen(eq=False)
class _Seen:
    """What the judge takes of a scan: `RunningJudge.add`."""

    scan: Scan
    ids: Indices
    confirmed: Mask
    estimate: Gaussian
    nis: Array
    hit: Array
    modes: Array | None


@final
class Recorder:
    """Judges a run as it goes and writes its series block by block; `judge` has its score, `tracks` what it left.

    `kept`: the run keeps all, so the judge may keep what the figures of whole tracks need, and the blocks. Where tracks
    count as confirmed from the start once they are, all is judged and written at the end, when that is known.
    """

    def __init__(
        self, target: Path | BinaryIO, experiment: Experiment, steps: Steps | SmoothedSteps, *, kept: bool = True
    ) -> None:
        tracker, recording = experiment.tracker, steps.recording
        self.judge = RunningJudge(
            recording.truth,
            tracker.state,
            experiment.judge,
            tracker.gate.probability,
            sensors=tracker.sensors,
            figures=forgiven_figures(),
            keep=np.inf if kept else _KEPT,
            nobody=recording.nobody,
        )
        modes = tracker.estimator.mode_prob(steps.state.belief)
        self.modes = 0 if modes is None else modes.shape[-1]
        self.bands, self.blocks, self._kept = Bands(), list[Block](), kept
        self.tracks = SeriesTracks(tracker.state)
        self._of = ScanRows(experiment, recording)
        self._file = SeriesFile(target, about(experiment, recording, self._of.plane, self.modes))
        none = no_rows(len(tracker.state), self._of.axes, self.modes, links=steps.state.links is not None)
        self._later = list[tuple[dict[str, dict[str, Column]], _Seen]]() if experiment.retroactive else None
        if self._later is not None:
            none = {**none, "entries": {**none["entries"], "confirmed_at": np.zeros(0)}}
        self._none: Tables = none
        self._rows, self._told = list[Tables](), list[Tables]()
        self._scans = self._entries = self._judged = 0
        self._block = (0, 0)

    def add(self, scan: Scan, before: State, state: State, estimate: Gaussian, modes: Array | None) -> None:
        """Take what `Experiment.finish` tells its `watch`."""
        rows = self._of.of(scan, before, state, estimate, modes)
        seen = _Seen(scan, state.ids, state.confirmed, estimate, state.nis, state.hit, modes)
        if self._later is None:
            self._take(rows, seen)
        else:
            bare = scan if scan.frame is None else evolve(scan, frame=_BARE)
            self._later.append((rows, evolve(seen, scan=bare)))

    def again(self, scan: Scan, rows: dict[str, dict[str, Column]]) -> None:
        """Take a scan that a run took before this one, with the rows that its series have of it, of the tables `none`."""
        told, low = rows["entries"], rows["below"]
        cov = full_covariances(told["cov"], low["entry"], low["place"], low["value"])
        modes = told["modes"] if self.modes else None
        seen = _Seen(scan, told["track"], told["confirmed"], Gaussian(told["mean"], cov), told["nis"], told["hit"], modes)
        self._take(rows, seen)

    @property
    def none(self) -> Tables:
        """The tables of a run that nobody has judged, without rows."""
        return self._none

    @property
    def scans(self) -> int:
        """How many scans were taken."""
        return self._scans

    def _take(self, rows: dict[str, dict[str, Column]], seen: _Seen) -> None:
        for table in ("returns", "entries", "splits", "merges"):
            rows[table]["scan"] += self._scans
        for table in ("weights", "below"):
            rows[table]["entry"] += self._entries
        self._rows.append(rows)
        if len(self._rows) > _FEW:
            self._rows = [together(self._rows)]
        self.judge.add(seen.scan, seen.ids, seen.confirmed, seen.estimate, seen.nis, seen.hit, seen.modes)
        self._scans, self._entries = self._scans + 1, self._entries + len(seen.ids)
        if self._kept and self.full:
            self.finish_block()

    @property
    def full(self) -> bool:
        """Whether enough has come for a block."""
        scans, entries = self._scans - self._block[0], self._entries - self._block[1] + self._scans - self._block[0]
        return scans >= SCANS or entries >= ENTRIES

    def judged(self) -> Tables:
        """Judge what came since this was last asked for; return its tables, numbered from the run's first scan and entry."""
        rows, self._rows = together([self._none, *self._rows]), list[Tables]()
        block = self.judge.finish_block()
        if block is not None:
            self.bands.add(block)
            if self._kept:
                self.blocks.append(block)
        times = rows["scans"]["time"]
        more = judged(block, len(times), rows["entries"]["confirmed"])
        tables: Tables = {
            **rows,
            "truth": self._of.true(times, self._judged),
            **{table: {**rows[table], **columns} for table, columns in more.items()},
        }
        self._judged += len(times)
        self._told.append(tables)
        return tables

    def finish_block(self) -> None:
        """Judge and write what came since the last block."""
        if self._rows:
            self.judged()
        if self._told:
            tables, self._told = together(self._told), []
            self._file.add(tables)
            self.tracks.add(tables)
            self._block = self._scans, self._entries

    def close(self) -> None:
        """Judge and write what is left."""
        for rows, seen in self._from_the_start():
            self._take(rows, seen)
        if not self._scans:
            self.judged()  # the tables without rows: a reader finds all columns
        self.finish_block()
        self.flush()

    def flush(self) -> None:
        """Write the blocks that wait."""
        self._file.flush()

    def _from_the_start(self) -> Iterator[tuple[dict[str, dict[str, Column]], _Seen]]:
        """Yield the scans that waited, their tracks confirmed from the start if they were ever confirmed, and since when."""
        waited, self._later = self._later or [], None
        first: dict[int, int] = {}
        for i, (_, seen) in enumerate(waited):
            for number in seen.ids[seen.confirmed].tolist():
                first.setdefault(number, i)
        times = np.array([seen.scan.time for _, seen in waited])
        for i, (rows, seen) in enumerate(waited):
            known = np.array([first.get(number, -1) for number in seen.ids.tolist()], dtype=np.intp)
            early = known > i
            at = np.where(early, times[known], np.where(seen.confirmed, seen.scan.time, np.nan))
            confirmed = seen.confirmed | early
            entries = {**rows["entries"], "confirmed": confirmed, "confirmed_at": at}
            yield {**rows, "entries": entries}, evolve(seen, confirmed=confirmed)


@frozen(eq=False)
class Recorded:
    """A run that kept all: its result, what the judge said of it, the content of `series.npz`, and its tracks' rows."""

    result: Result
    judged: Judged
    packed: bytes
    rows: TrackRows

    def series(self) -> Series:
        """Return the series."""
        return read_series(BytesIO(self.packed))


def recorded_run(
    experiment: Experiment, steps: Steps, *, keep_states: bool = False, tracked: Callable[[], None] = lambda: None
) -> Recorded:
    """Make all steps of a run that was opened, and keep and judge them; `tracked` is called when the last is made."""
    packed = BytesIO()
    series = Recorder(packed, experiment, steps)
    result = experiment.finish(steps, keep_states=keep_states, watch=series.add)
    tracked()
    series.close()
    names = np.array([track.id for track in result.tracks])
    judged = Judged(series.judge.score(), tuple(series.blocks), names)
    return Recorded(result, judged, packed.getvalue(), series.tracks.hand_out())
