"""From the states after each scan to the tracks' histories."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, final

import numpy as np
from attrs import evolve

from vedette.space import Array
from vedette.tracking.state import State, weighted_distance
from vedette.tracking.tracker import Tracker
from vedette.types import Gaussian, Track

_COLUMNS = ("mean", "cov", "confirmed", "existence")


@final
class History:
    """Collects the states of one run, scan by scan. Holds references only: states are never changed."""

    def __init__(self, tracker: Tracker) -> None:
        self._tracker = tracker
        self._rows: list[dict[str, Any]] = []
        self._parents: dict[int, tuple[int, ...]] = {}
        self._merged: dict[int, tuple[float, int]] = {}

    def add(self, state: State) -> tuple[Gaussian, Array | None]:
        """Keep the state of every track (t,) after a scan; return the estimates, and the mode probabilities, if any."""
        estimate = self._tracker.estimate(state)
        modes = self._tracker.estimator.mode_prob(state.belief)
        self._rows.append(
            {
                "ids": state.ids,
                "time": state.time,
                "mean": estimate.mean,
                "cov": estimate.cov,
                "confirmed": state.confirmed,
                "existence": state.existence,
                "mode_prob": modes,
                "identity": state.identity,
                "link": state.links,
                "weights": state.weights,
                "distances": state.distances,
                "returns": state.returns,
            }
        )
        if self._merged:
            for number in self._merged.keys() & set(state.ids.tolist()):
                del self._merged[number]  # a hypothesis that has it became the best
        if (lineage := state.lineage) is not None:
            for child, parent in lineage.splits.tolist():
                self._parents[child] = (*self._parents.get(child, ()), parent)
            for ended, other in lineage.merges.tolist():
                self._merged[ended] = state.time, other
        return estimate, modes

    def tracks(self) -> tuple[Track, ...]:
        """Return the tracks that were ever confirmed, in the order of their ids."""
        if not self._rows:
            return ()
        ids = self._column("ids")
        order = np.argsort(ids, kind="stable")
        order = order[np.isin(ids[order], ids[self._column("confirmed")])]
        edges = [*np.flatnonzero(np.diff(ids[order], prepend=-1)), len(order)]
        columns: dict[str, Any] = {name: self._column(name)[order] for name in _COLUMNS}
        columns["times"] = np.repeat([row["time"] for row in self._rows], [len(row["ids"]) for row in self._rows])[order]
        columns["nis"], columns["hit"] = (column[order] for column in _detected(self._rows))
        columns |= {name: self._column(name)[order] for name in ("mode_prob", "link") if self._rows[0][name] is not None}
        if any(row["identity"] is not None for row in self._rows):
            codes = [np.full(len(row["ids"]), -1) if row["identity"] is None else row["identity"] for row in self._rows]
            columns["identity"] = np.concatenate(codes)[order]
        weights, returns = _associations(self._rows)
        tracks = []
        for i, j in pairwise(edges):
            number, rows = int(ids[order[i]]), order[i:j].tolist()
            parts = [returns[row] for row in rows]
            tracks.append(
                Track(
                    id=number,
                    space=self._tracker.state,
                    weights=tuple(weights[row].copy() for row in rows),  # not views of all tracks'
                    returns=None if all(row is None for row in parts) else tuple(parts),
                    parents=self._parents.get(number, ()),
                    merged=self._merged.get(number),
                    **{"mode_prob": None, **{name: column[i:j] for name, column in columns.items()}},
                )
            )
        return tuple(tracks)

    def _column(self, name: str) -> Array:
        return np.concatenate([row[name] for row in self._rows])


def _detected(rows: Sequence[dict[str, Any]]) -> tuple[Array, Array]:
    """Return the NIS and the probability of having been detected of all tracks of all scans, by scans of as many returns."""
    sizes = np.array([row["weights"].shape[-1] for row in rows])
    of_track = np.repeat(sizes, [len(row["ids"]) for row in rows])
    nis, hit = np.empty(len(of_track)), np.empty(len(of_track))
    for size in np.unique(sizes):
        some = [row for row in rows if row["weights"].shape[-1] == size]
        weights, distances = (np.concatenate([row[name] for row in some]) for name in ("weights", "distances"))
        nis[of_track == size], hit[of_track == size] = weighted_distance(weights, distances), 1.0 - weights[:, 0]
    return nis, hit


def _associations(rows: Sequence[dict[str, Any]]) -> tuple[list[Array], list[Array | None]]:
    """Return each track's weights, and the returns that they are of, if those are not all of the scan's."""
    weights, returns = list[Array](), list[Array | None]()
    for row in rows:
        if row["returns"] is None:
            weights.extend(row["weights"])
            returns += [None] * len(row["ids"])
        else:
            sizes = np.count_nonzero(row["returns"] >= 0, axis=-1).tolist()
            weights += [own[: 1 + size] for own, size in zip(row["weights"], sizes, strict=True)]
            returns += [own[:size].copy() for own, size in zip(row["returns"], sizes, strict=True)]
    return weights, returns


def from_the_start(track: Track) -> Track:
    """Return a track that was ever confirmed as confirmed from its first scan on, and when that was known of each scan."""
    first = int(np.argmax(track.confirmed))
    at = np.where(track.confirmed, track.times, np.nan)
    at[:first] = track.times[first]
    return evolve(track, confirmed=track.confirmed | (np.arange(len(at)) < first), confirmed_at=at)
