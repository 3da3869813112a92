"""A run judged as it goes: what remains of its scans are the sums that its score needs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, final

import numpy as np
from attrs import frozen

from vedette.metrics.coverage import Indices
from vedette.metrics.histories import Entries, Truth, truth_at
from vedette.metrics.matching import Match, matched
from vedette.metrics.score import Judge, Score
from vedette.metrics.tally import Tally
from vedette.space import Array, Mask, Space
from vedette.types import Gaussian, Scan, Trajectory


@frozen(eq=False)
class Block:
    """Some scans of a run: their match with the truth, which are judged, `chosen`, and how many axes (s,) each measures.

    `which`: the true objects of the match, among those of the run.
    """

    found: Match
    chosen: Indices
    axes: Indices
    which: Indices


@final
class RunningJudge:
    """Judges the tracks of one run scan by scan, to the figures of `judge` but for those of whole tracks.

    `truth` are all true objects, `space` the tracks' axes, `gate_probability` that of the tracker's gate. InputError where
    truth and tracks have no position axis in common.
    """

    def __init__(self, truth: Sequence[Trajectory], space: Space, options: Judge, gate_probability: float = 1.0) -> None:
        self.tracks = 0
        self._truth, self._options = truth, options
        self._tally, self._gate = Tally(truth, options), gate_probability
        self._space = truth_at(truth, np.zeros(0), space).space
        self._part = space.locate(self._space)
        self._begin = np.array([path.times[0] if len(path.times) else np.inf for path in truth])
        self._end = np.array([path.times[-1] if len(path.times) else -np.inf for path in truth])
        self._own_scans = 0
        self._confirmed: set[int] = set()
        self._alive: Indices = np.zeros(0, dtype=np.int64)
        self._rows: list[dict[str, Any]] = []

    def add(
        self, scan: Scan, ids: Indices, confirmed: Mask, estimate: Gaussian, nis: Array, hit: Array, modes: Array | None
    ) -> None:
        """Add the tracks (t,) after one scan, in the order of their ids; modes (t, r) are the mode probabilities, if any."""
        own = self._options.sensor in (None, scan.sensor)
        last = self._options.last_scan
        chosen = own and self._own_scans >= self._options.first_scan and (last is None or self._own_scans <= last)
        self._own_scans += own
        alive = set(ids[confirmed].tolist())
        self.tracks += len(alive - self._confirmed)
        self._confirmed = alive | (self._confirmed & set(ids.tolist()))
        self._alive = ids
        self._rows.append(
            {
                "time": scan.time,
                "axes": scan.detections.z.shape[-1],
                "gate": self._gate if scan.frame is None else 1.0,
                "chosen": chosen,
                "track": ids[confirmed],
                "mean": estimate.mean[confirmed],
                "cov": estimate.cov[confirmed],
                "nis": nis[confirmed],
                "hit": hit[confirmed],
                "modes": None if modes is None else modes[confirmed],
            }
        )

    def finish_block(self) -> Block | None:
        """Judge the scans since the last block, and forget them; None if there are none."""
        rows, self._rows = self._rows, []
        if not rows:
            return None
        times = np.array([row["time"] for row in rows])
        axes = np.array([row["axes"] for row in rows])
        chosen = np.flatnonzero([row["chosen"] for row in rows])
        which = np.flatnonzero((self._begin <= times[-1]) & (times[0] <= self._end))
        near = truth_at([self._truth[j] for j in which.tolist()], times[chosen], self._space, self._options.truth_gap)
        said, states = ~near.unsaid, near.states.reshape(len(chosen), len(which), len(self._space))
        real = Truth(self._space, states[said], near.alive[said], near.unsaid[said])
        entries, judged = self._entries(rows), chosen[said]
        found = matched((), entries, real, judged, self._options, self._tally.held, which)
        self._tally.add_innovations(entries, chosen, axes, np.array([row["gate"] for row in rows]))
        self._tally.add(found, times[judged], which)
        self._tally.forget(self._alive)
        return Block(found, chosen, axes, which)

    def score(self) -> Score:
        """Return the figures of all blocks that are finished."""
        return self._tally.score(self.tracks)

    def _entries(self, rows: Sequence[dict[str, Any]]) -> Entries:
        """Return the confirmed tracks of some scans, by scan, then by track."""
        whole = {name: np.concatenate([row[name] for row in rows]) for name in ("track", "mean", "cov", "nis", "hit")}
        scan = np.repeat(np.arange(len(rows)), [len(row["track"]) for row in rows])
        modes = None if rows[0]["modes"] is None else np.concatenate([row["modes"] for row in rows])
        part = self._part
        return Entries(
            scan=scan,
            track=whole["track"],
            mean=whole["mean"][:, part],
            cov=whole["cov"][:, part][:, :, part],
            nis=whole["nis"],
            hit=whole["hit"],
            mode_prob=modes,
        )
