"""The series of a run, collected scan by scan: what its page and its pictures show. docs/formats.md lists the columns."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import BinaryIO, final

import numpy as np

from vedette.experiment import Experiment, Steps
from vedette.io.series import Column, SeriesFile, Tables
from vedette.metrics.histories import truth_at
from vedette.metrics.running import Block, RunningJudge
from vedette.report.gates import gates
from vedette.report.plane import Plane, positions_of
from vedette.report.series_about import about, no_rows
from vedette.report.series_judged import judged
from vedette.space import Array
from vedette.tracking.state import State
from vedette.types import Gaussian, Recording, Scan

_FEW = 10
"""Scans whose rows are held apart."""

SCANS, ENTRIES = 200, 5_000
"""After so many scans, or tracks times scans, a block is judged."""


@final
class SeriesWriter:
    """Collects what each scan did to the tracks, and writes it once the scans are judged. It does not grow with the run."""

    def __init__(self, target: Path | BinaryIO, experiment: Experiment, recording: Recording, modes: int) -> None:
        self._tracker = experiment.tracker
        space, sensors = self._tracker.state, self._tracker.sensors
        self._plane = Plane.of(space, recording) if len(space) > 1 else None
        plane = self._plane
        told = [(j, true) for j, true in enumerate(recording.truth) if len(true.times)]
        self._truth = [(j, true) for j, true in told if plane is not None and plane.within(true.space)]
        self._codes = {name: i for i, name in enumerate(sensors)}
        self._axes = max(len(sensor.measurement) for sensor in sensors.values())
        self._triangle, self._measured = np.triu_indices(len(space)), np.triu_indices(self._axes)
        self._gap = experiment.judge.truth_gap
        self._scans = self._entries = 0
        self._joined: list[Tables] = [no_rows(len(space), self._axes, modes)]
        self._rows: list[Tables] = []
        self._file = SeriesFile(target, about(experiment, recording, plane, modes))

    def add(self, scan: Scan, before: State, state: State, estimate: Gaussian, modes: Array | None) -> None:
        """Collect a scan, the states before and after it, and that one's estimates (t,) and mode probabilities (t, r)."""
        seen, tracks, pose = scan.detections, len(state.ids), scan.pose
        place = np.full(2, np.nan)
        if pose is not None and self._plane is not None and self._plane.is_ground:
            place = self._plane.platform(pose.position[:2])
        k = 0 if scan.frame is not None else len(seen.z)
        z = np.full((k, self._axes), np.nan)
        z[:, : seen.z.shape[-1]] = seen.z[:k]
        found = gates(self._tracker, scan, before, state, self._plane)
        m = found.expected.shape[-1]
        expected, innovation = np.full((tracks, self._axes), np.nan), np.full((tracks, self._axes, self._axes), np.nan)
        expected[:, :m], innovation[:, :m, :m] = found.expected, found.innovation
        weights = state.weights[:, 1:] if scan.frame is None else state.weights[:, :0]
        entry, column = np.nonzero(weights)
        own = column if state.returns is None else state.returns[entry, column]
        self._rows.append(
            {
                "scans": {
                    "time": np.array([scan.time]),
                    "sensor": np.array([self._codes[scan.sensor]], dtype=np.int16),
                    "returns": np.array([k], dtype=np.int32),
                    "tracks": np.array([tracks], dtype=np.int32),
                    "platform": place[None],
                    "heading": np.array([np.nan if pose is None else float(pose.heading)]),
                },
                "returns": {
                    "scan": np.full(k, self._scans, dtype=np.int32),
                    "z": z,
                    "position": positions_of(scan, self._tracker.sensors[scan.sensor], self._plane)[:k],
                },
                "entries": {
                    "scan": np.full(tracks, self._scans, dtype=np.int32),
                    "track": np.asarray(state.ids, dtype=np.int64),
                    "mean": estimate.mean,
                    "cov": estimate.cov[:, self._triangle[0], self._triangle[1]],
                    "confirmed": state.confirmed,
                    "existence": state.existence,
                    "hit": state.hit,
                    "nis": state.nis,
                    "modes": np.zeros((tracks, 0)) if modes is None else modes,
                    "expected": expected,
                    "innovation": innovation[:, self._measured[0], self._measured[1]],
                    "gate_position": found.position,
                    "gate_cov": found.cov[:, [0, 0, 1], [0, 1, 1]],
                },
                "weights": {
                    "entry": self._entries + entry.astype(np.int64),
                    "return": own.astype(np.int32),
                    "weight": weights[entry, column],
                },
            }
        )
        self._scans += 1
        self._entries += tracks
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
        tables["truth"] = self._true(tables["scans"]["time"], first)
        self._file.add(tables)

    def close(self) -> None:
        """Write what waits."""
        self._file.flush()

    def _join(self) -> None:
        """Put the rows of some scans together: many small arrays take several times the memory of what is in them."""
        if self._rows:
            self._joined = [_together([*self._joined, *self._rows])]
        self._rows = []

    def _true(self, times: Array, first: int) -> dict[str, Column]:
        """Return where the true objects are at each scan."""
        near = (
            [(j, true) for j, true in self._truth if true.times[0] <= times[-1] and times[0] <= true.times[-1]]
            if len(times)
            else []
        )
        if not near or self._plane is None:
            return {"scan": np.zeros(0, np.int32), "object": np.zeros(0, np.int32), "position": np.zeros((0, 2))}
        found = truth_at([true for _, true in near], times, self._plane.space, self._gap)
        scan, j = np.nonzero(found.alive & ~found.unsaid[:, None])
        return {
            "scan": (first + scan).astype(np.int32),
            "object": np.array([number for number, _ in near], dtype=np.int32)[j],
            "position": self._plane.points(found.space, found.states[scan, j]),
        }


def _together(parts: Sequence[Tables]) -> Tables:
    """Return tables with the rows of all parts."""
    return {
        table: {name: np.concatenate([part[table][name] for part in parts]) for name in columns}
        for table, columns in parts[0].items()
    }


@final
class Recorder:
    """The series of a run that keeps all: it judges and writes in the blocks of one that keeps nothing."""

    def __init__(self, target: Path | BinaryIO, experiment: Experiment, steps: Steps) -> None:
        tracker, recording = experiment.tracker, steps.recording
        self._judge = RunningJudge(recording.truth, tracker.state, experiment.judge, tracker.gate.probability)
        modes = tracker.estimator.mode_prob(steps.state.belief)
        self._writer = SeriesWriter(target, experiment, recording, 0 if modes is None else modes.shape[-1])
        self._scans = self._entries = 0

    def add(self, scan: Scan, before: State, state: State, estimate: Gaussian, modes: Array | None) -> None:
        """Take what `Experiment.finish` tells its `watch`."""
        self._writer.add(scan, before, state, estimate, modes)
        self._judge.add(scan, state.ids, state.confirmed, estimate, state.nis, state.hit, modes)
        self._scans, self._entries = self._scans + 1, self._entries + len(state.ids)
        if self._scans >= SCANS or self._entries >= ENTRIES:
            self._writer.finish_block(self._judge.finish_block())
            self._scans = self._entries = 0

    def close(self) -> None:
        """Judge and write what is left."""
        self._writer.finish_block(self._judge.finish_block())
        self._writer.close()
