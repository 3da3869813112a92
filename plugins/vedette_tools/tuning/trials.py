"""Where targets were, and whether a sensor detected them: what the tracks of a run say, given all its scans."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from attrs import define, field, frozen

from vedette import Array, Indices, Mask, Scan, Tracker
from vedette.tracking import State
from vedette_standard import Detection, PlacedSensor


@frozen(eq=False)
class Trials:
    """What tracks met, each (n,): range in m, bearing in rad, the scan's number, the probability that the target was there
    given all scans, and that it was detected if it was.
    """

    distance: Array
    bearing: Array
    scan: Indices
    there: Array
    hit: Array

    def counts(self, table: Detection, folds: int, scans: int) -> Array:
        """Return trials and hits (2, folds, rows, columns) in each cell, in so many stretches of the recording."""
        sums = np.zeros((2, folds, *table.probability.shape))
        cells = (self.scan * folds // scans, *table.cells(self.distance, self.bearing))
        np.add.at(sums[0], cells, self.there)
        np.add.at(sums[1], cells, self.there * self.hit)
        return sums


@define
class _Life:
    """A track: existence after each scan, the probability of surviving until then from the scan before, and its trials."""

    existence: list[float] = field(factory=list)
    survives: list[float] = field(factory=list)
    trials: list[tuple[float, float, int, int, float]] = field(factory=list)


def trials(tracker: Tracker, name: str, within: PlacedSensor, ran: Iterable[tuple[State, Scan, State]]) -> Trials:
    """Return the trials of the sensor called `name` in a run; `within`: it or the sensor in it whose view is asked for.

    A scan in which a track begins is none: it began as there was a return.
    """
    lives, space, last = dict[int, _Life](), tracker.state.locate(within.observes), frozenset[int]()
    for k, (before, scan, state) in enumerate(ran):
        after = {number: row for row, number in enumerate(state.ids.tolist())}
        rows = [row for row, number in enumerate(before.ids.tolist()) if number in after]
        survives: Array = np.ones(len(before.ids))
        if len(rows) and not tracker.lifecycle.permanent:
            survives = tracker.lifecycle.predict(survives, scan.time - before.time)
        polar: Array = np.zeros((0, 2))
        seen: Mask = np.zeros(0, dtype=bool)
        if scan.sensor == name and rows:
            placed = within.placed(scan.pose)
            assert isinstance(placed, PlacedSensor)
            x = tracker.expect(before, scan).tracks.mean[rows][:, space]
            polar, seen = placed.polar(x), np.broadcast_to(placed.detects(x) > 0, len(rows))
        for i, row in enumerate(rows):
            number = int(before.ids[row])
            now, life = after[number], lives[number] if number in lives else lives.setdefault(number, _first(before, row))
            exists = float(state.existence[now])
            if len(seen) and seen[i]:
                hit = min(float(state.hit[now]) / exists, 1.0) if exists > 0 else 0.0
                life.trials.append((float(polar[i, 0]), float(polar[i, 1]), k, len(life.existence), hit))
            life.existence.append(exists)
            life.survives.append(float(survives[row]))
        last = frozenset(after)
    trials = [
        (distance, bearing, k, there[at], hit)
        for number, life in lives.items()
        for there in (smoothed(life.existence, life.survives, number in last),)
        for distance, bearing, k, at, hit in life.trials
    ]
    columns = np.array(trials).reshape(-1, 5).T
    return Trials(columns[0], columns[1], columns[2].astype(int), columns[3], columns[4])


def _first(state: State, row: int) -> _Life:
    """Return the life of a track that is met for the first time."""
    return _Life([float(state.existence[row])], [1.0])


def smoothed(existence: list[float], survives: list[float], goes_on: bool) -> Array:
    """Return the probability (s,) that a target was there after each of its scans, given all: it goes away but once.

    It is e' + (1 - e') e (1 - p) / (1 - p e), with e by the scans until k, p that it stays until k+1, e' at k+1 given all.
    A track that does not go on after its last scan is not there at the next.
    """
    detected, later = np.zeros(len(existence)), 0.0
    for k in range(len(existence) - 1, -1, -1):
        e, ends = existence[k], k == len(existence) - 1
        p = min(survives[min(k + 1, len(existence) - 1)], 1.0)
        gone = 1.0 - p * e
        later = e if ends and goes_on else later + (1.0 - later) * (e * (1.0 - p) / gone if gone > 0 else 1.0)
        detected[k] = later
    return detected
