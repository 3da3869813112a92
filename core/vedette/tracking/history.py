"""From the states after each scan to the tracks' histories."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, final

import numpy as np

from vedette.space import Array
from vedette.tracking.state import State
from vedette.tracking.tracker import Tracker
from vedette.types import Gaussian, Track

_COLUMNS = ("ids", "times", "mean", "cov", "confirmed", "existence", "nis", "hit")


@final
class History:
    """Collects the states of one run, scan by scan. Holds references only: states are never changed."""

    def __init__(self, tracker: Tracker) -> None:
        self._tracker = tracker
        self._rows: list[dict[str, Any]] = []
        self._handed_out: set[int] = set()

    @property
    def scans(self) -> int:
        """Number of scans that it holds."""
        return len(self._rows)

    def add(self, state: State) -> tuple[Gaussian, Array | None]:
        """Keep the state of every track (t,) after a scan; return the estimates, and the mode probabilities, if any."""
        estimate = self._tracker.estimate(state)
        modes = self._tracker.estimator.mode_prob(state.belief)
        self._rows.append(
            {
                "ids": state.ids,
                "times": np.full(len(state.ids), state.time),
                "mean": estimate.mean,
                "cov": estimate.cov,
                "confirmed": state.confirmed,
                "existence": state.existence,
                "mode_prob": modes,
                "nis": state.nis,
                "hit": state.hit,
                **_associations(state),
            }
        )
        return estimate, modes

    def tracks(self) -> tuple[Track, ...]:
        """Return the tracks that were ever confirmed, in the order of their ids."""
        if not self._rows:
            return ()
        ids = self._column("ids")
        order = np.argsort(ids, kind="stable")
        edges = [*np.flatnonzero(np.diff(ids[order], prepend=-1)), len(order)]
        columns: dict[str, Any] = {name: self._column(name)[order] for name in _COLUMNS[1:]}
        mode_prob = None if self._rows[0]["mode_prob"] is None else self._column("mode_prob")[order]
        weights = [row for rows in self._rows for row in rows["weights"]]
        returns = [row for rows in self._rows for row in rows["returns"]]
        found = []
        for i, j in pairwise(edges):
            number = int(ids[order[i]])
            if number in self._handed_out or columns["confirmed"][i:j].any():
                found.append(
                    Track(
                        id=number,
                        space=self._tracker.state,
                        mode_prob=None if mode_prob is None else mode_prob[i:j],
                        weights=tuple(weights[row] for row in order[i:j]),
                        returns=_any_of([returns[row] for row in order[i:j]]),
                        **{name: column[i:j] for name, column in columns.items()},
                    )
                )
        return tuple(found)

    def hand_out(self) -> tuple[Track, ...]:
        """Return the histories of the tracks that were ever confirmed, in pieces: nothing is returned twice.

        What was returned is dropped, and so are tracks that ended unconfirmed. Those that may still be confirmed stay.
        """
        found = self.tracks()
        alive = self._rows[-1]["ids"] if self._rows else np.zeros(0, dtype=np.int64)
        known = self._handed_out | {track.id for track in found}
        self._handed_out = known & set(alive.tolist())
        waiting = [number for number in alive.tolist() if number not in known]
        self._rows = [row for row in (_of(row, waiting) for row in self._rows) if len(row["ids"])] if waiting else []
        return found

    def _column(self, name: str) -> Array:
        return np.concatenate([row[name] for row in self._rows])


def _of(row: dict[str, Any], ids: list[int]) -> dict[str, Any]:
    """Return a row's entries of some tracks, in arrays of its own, so that the others' are freed."""
    own = np.isin(row["ids"], ids)
    kept = {name: row[name][own] for name in _COLUMNS}
    modes = None if row["mode_prob"] is None else row["mode_prob"][own]
    numbers = np.flatnonzero(own).tolist()
    weights, returns = [row["weights"][i].copy() for i in numbers], [row["returns"][i] for i in numbers]
    return {**kept, "mode_prob": modes, "weights": weights, "returns": returns}


def _associations(state: State) -> dict[str, list[Any]]:
    """Return each track's weights, and the returns that they are of, if those are not all of the scan's."""
    if state.returns is None:
        return {"weights": list(state.weights), "returns": [None] * len(state.ids)}
    sizes = np.count_nonzero(state.returns >= 0, axis=-1).tolist()
    weights = [row[: 1 + size].copy() for row, size in zip(state.weights, sizes, strict=True)]
    return {"weights": weights, "returns": [row[:size].copy() for row, size in zip(state.returns, sizes, strict=True)]}


def _any_of(rows: list[Any]) -> tuple[Any, ...] | None:
    return None if all(row is None for row in rows) else tuple(rows)
