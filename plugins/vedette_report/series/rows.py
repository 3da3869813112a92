"""One scan of a run as rows of its series: what it did to the tracks, and where the true objects were."""

from __future__ import annotations

from typing import final

import numpy as np

from vedette import Array, Experiment, Gaussian, Recording, Scan
from vedette.metrics import truth_at
from vedette.tracking import State
from vedette_files import UNNAMED, WITHIN, Column, below, stands, triangles
from vedette_report.known import known
from vedette_report.map.gates import gates
from vedette_report.map.plane import Plane, positions_of

_NONE = np.zeros((0, 2), dtype=np.int64)


@final
class ScanRows:
    """Makes the rows of each scan of a run, counted from the scan's own begin: `scan` is 0, `entry` the scan's own.

    `plane`: the axes that the map shows, if there are two; `axes`: the most that a sensor measures.
    """

    def __init__(self, experiment: Experiment, recording: Recording) -> None:
        self._tracker = experiment.tracker
        space, sensors = self._tracker.state, self._tracker.sensors
        self.plane = Plane.of(space, recording) if len(space) > 1 else None
        plane = self.plane
        told = [(j, true) for j, true in enumerate(recording.truth) if len(true.times)]
        self._truth = [(j, true) for j, true in told if plane is not None and plane.within(true.space)]
        self._codes = {name: i for i, name in enumerate(sensors)}
        self.axes = max(len(sensor.measurement) for sensor in sensors.values())
        self._measured = np.triu_indices(self.axes)
        self._gap = experiment.judge.truth_gap

    def of(
        self, scan: Scan, before: State, state: State, estimate: Gaussian, modes: Array | None
    ) -> dict[str, dict[str, Column]]:
        """Return the rows of a scan, by the states before and after it, estimates and mode probabilities (t, r)."""
        return {
            "scans": self._scan(scan, state),
            "returns": self._returns(scan),
            "entries": self._entries(scan, before, state, estimate, modes),
            "weights": _weights(state),
            "below": _below(estimate),
            **_lineage(state),
        }

    def _scan(self, scan: Scan, state: State) -> dict[str, Column]:
        place, pose = np.full(2, np.nan), scan.pose
        if pose is not None and self.plane is not None and self.plane.is_ground:
            place = self.plane.platform(pose.position[:2])
        columns = WITHIN if state.returns is not None else state.weights.shape[1] - 1
        return {
            "time": np.array([scan.time]),
            "sensor": np.array([self._codes[scan.sensor]], dtype=np.int16),
            "returns": np.array([_count(scan)], dtype=np.int32),
            "tracks": np.array([len(state.ids)], dtype=np.int32),
            "columns": np.array([columns], dtype=np.int32),
            "platform": place[None],
            "heading": np.array([np.nan if pose is None else float(pose.heading)]),
        }

    def _returns(self, scan: Scan) -> dict[str, Column]:
        seen, k = scan.detections, _count(scan)
        z = np.full((k, self.axes), np.nan)
        z[:, : seen.z.shape[-1]] = known(seen)[:k]
        position = positions_of(scan, self._tracker.sensors[scan.sensor], self.plane)[:k]
        return {"scan": np.zeros(k, dtype=np.int32), "z": z, "position": position}

    def _entries(
        self, scan: Scan, before: State, state: State, estimate: Gaussian, modes: Array | None
    ) -> dict[str, Column]:
        """Return a row for each track."""
        tracks, n = len(state.ids), len(self._tracker.state)
        met = gates(self._tracker, scan, before, state, self.plane)
        m = met.expected.shape[-1]
        expected, innovation = np.full((tracks, self.axes), np.nan), np.full((tracks, self.axes, self.axes), np.nan)
        expected[:, :m], innovation[:, :m, :m] = met.expected, met.innovation
        return {
            "scan": np.zeros(tracks, dtype=np.int32),
            "track": np.asarray(state.ids, dtype=np.int64),
            "mean": estimate.mean,
            "cov": estimate.cov.reshape(tracks, n * n)[:, triangles(n)[0]],
            "confirmed": state.confirmed,
            "existence": state.existence,
            "hit": state.hit,
            "miss": state.weights[:, 0],
            "identity": np.full(tracks, UNNAMED) if state.identity is None else state.identity,
            **({} if state.links is None else {"link": state.links}),
            "nis": state.nis,
            "modes": np.zeros((tracks, 0)) if modes is None else modes,
            "expected": expected,
            "innovation": innovation[:, self._measured[0], self._measured[1]],
            "gate_position": met.position,
            "gate_cov": met.cov[:, [0, 0, 1], [0, 1, 1]],
        }

    def true(self, times: Array, first: int = 0) -> dict[str, Column]:
        """Return where the true objects are at scans with these times (s,), numbered from `first` on."""
        near = (
            [(j, true) for j, true in self._truth if true.times[0] <= times[-1] and times[0] <= true.times[-1]]
            if len(times)
            else []
        )
        if not near or self.plane is None:
            return {"scan": np.zeros(0, np.int32), "object": np.zeros(0, np.int32), "position": np.zeros((0, 2))}
        truth = truth_at([true for _, true in near], times, self.plane.space, self._gap)
        scan, j = np.nonzero(truth.alive)
        return {
            "scan": (first + scan).astype(np.int32),
            "object": np.array([number for number, _ in near], dtype=np.int32)[j],
            "position": self.plane.points(truth.space, truth.states[scan, j]),
        }


def _count(scan: Scan) -> int:
    """Return how many returns a scan has, 0 if it is a frame."""
    return 0 if scan.frame is not None else len(scan.detections.z)


def _weights(state: State) -> dict[str, Column]:
    """Return a row for each return that a track may have taken."""
    weights = state.weights[:, 1:]
    entry, column = np.nonzero(stands(weights) if state.returns is None else state.returns >= 0)
    taken = column if state.returns is None else state.returns[entry, column]
    return {"entry": entry.astype(np.int64), "return": taken.astype(np.int32), "weight": weights[entry, column]}


def _below(estimate: Gaussian) -> dict[str, Column]:
    """Return what differs below the diagonals of covariances, by rounding, from what is above."""
    tracks, n = estimate.mean.shape
    halves = below(estimate.cov.reshape(tracks, n * n), *triangles(n))
    return {"entry": halves.row, "place": halves.key.astype(np.int32), "value": halves.value}


def _lineage(state: State) -> dict[str, dict[str, Column]]:
    """Return the tracks that split and merged."""
    lineage = state.lineage
    splits, merges = (_NONE, _NONE) if lineage is None else (lineage.splits, lineage.merges)
    return {
        "splits": {"scan": np.zeros(len(splits), np.int32), "track": splits[:, 0], "parent": splits[:, 1]},
        "merges": {"scan": np.zeros(len(merges), np.int32), "track": merges[:, 0], "into": merges[:, 1]},
    }
