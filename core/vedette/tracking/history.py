"""From the states after each scan to the tracks' histories."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, final

import numpy as np

from vedette.space import Array
from vedette.tracking.state import State
from vedette.tracking.tracker import Tracker
from vedette.types import Track


@final
class History:
    """Collects the states of one run, scan by scan. Holds references only: states are never changed."""

    def __init__(self, tracker: Tracker) -> None:
        self._tracker = tracker
        self._rows: list[dict[str, Any]] = []

    def add(self, state: State) -> None:
        """Keep what a scan left of every track (t,)."""
        estimate = self._tracker.estimate(state)
        self._rows.append(
            {
                "ids": state.ids,
                "times": np.full(len(state.ids), state.time),
                "mean": estimate.mean,
                "cov": estimate.cov,
                "confirmed": state.confirmed,
                "existence": state.existence,
                "mode_prob": self._tracker.estimator.mode_prob(state.belief),
                "nis": state.nis,
                "hit": state.hit,
                "weights": list(state.weights),
            }
        )

    def tracks(self) -> tuple[Track, ...]:
        """The tracks that were ever confirmed, in the order of their ids."""
        if not self._rows:
            return ()
        ids = self._column("ids")
        order = np.argsort(ids, kind="stable")
        edges = [*np.flatnonzero(np.diff(ids[order], prepend=-1)), len(order)]
        names = ("times", "mean", "cov", "confirmed", "existence", "nis", "hit")
        columns: dict[str, Any] = {name: self._column(name)[order] for name in names}
        mode_prob = None if self._rows[0]["mode_prob"] is None else self._column("mode_prob")[order]
        weights = [row for rows in self._rows for row in rows["weights"]]
        found = []
        for i, j in pairwise(edges):
            if columns["confirmed"][i:j].any():
                found.append(
                    Track(
                        id=int(ids[order[i]]),
                        space=self._tracker.state,
                        mode_prob=None if mode_prob is None else mode_prob[i:j],
                        weights=tuple(weights[row] for row in order[i:j]),
                        **{name: column[i:j] for name, column in columns.items()},
                    )
                )
        return tuple(found)

    def _column(self, name: str) -> Array:
        return np.concatenate([row[name] for row in self._rows])
