"""What a likelihood needs and a config does not state: where false returns lie, how many of the new tracks are real."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from attrs import field, frozen

from vedette import Mask, Scan, Tracker
from vedette.tracking import State
from vedette_tools.tuning.field_of_view import View, views
from vedette_tools.tuning.unthresholded import has_initial

REAL = 0.99
"""A track was real if it once existed so surely."""

LEAST = 20
"""Returns of no target that are needed to tell where such lie; with fewer, all returns tell it."""

SAME = 0.3
"""The part of new tracks that are real, and a view, are settled if they change by less than this, and this of its error."""


@frozen(eq=False)
class Unstated:
    """The views of the sensors, by the returns of no target where there are enough of them, and the part of new tracks
    that are of targets, None as the birth has it. `number` counts how often they were found anew.
    """

    views: Mapping[str, View] = field(factory=dict)
    real: float | None = None
    number: int = 0

    def like(self, other: Unstated) -> bool:
        """Return whether another is the same, up to what makes no difference."""
        if (self.real is None) != (other.real is None) or self.views.keys() != other.views.keys():
            return False
        if self.real and other.real and abs(np.log(self.real / other.real)) > SAME:
            return False
        pairs = [(view, other.views[name]) for name, view in self.views.items()]
        return all(abs(np.log(a.volume / b.volume)) <= SAME / np.sqrt(a.count) for a, b in pairs)


def found(tracker: Tracker, ran: Iterable[tuple[State, Scan, State]], before: Unstated) -> Unstated:
    """Return what a run of an unthresholded tracker shows: whose returns were no target's, which new tracks were real.

    A step of expectation and maximisation: what comes of it is to be run with, and found again.
    """
    scans, took, sure, born = list[Scan](), list[list[tuple[int, int]]](), set[int](), 0
    for _, scan, state in ran:
        scans.append(scan)
        took.append(_taken(state))
        sure |= set(state.ids[state.existence >= REAL].tolist())
        born = state.born
    of_none = [_of_none(scan, pairs, sure) for scan, pairs in zip(scans, took, strict=True)]
    counts = dict.fromkeys(before.views, 0)
    for scan, mask in zip(scans, of_none, strict=True):
        if scan.sensor in counts:
            counts[scan.sensor] += int(np.count_nonzero(mask))
    seen = views(tracker.sensors, scans, of_none)
    known = {name: seen[name] if counts[name] >= LEAST and name in seen else view for name, view in before.views.items()}
    real = (len(sure) + 0.5) / (born + 1.0) if has_initial(tracker.birth) and born else None
    return Unstated(known, real, before.number + 1)


def _taken(state: State) -> list[tuple[int, int]]:
    """Return which track, by its number, took which return of a scan more probably than not."""
    rows, columns = np.nonzero(state.weights[:, 1:] > 0.5)
    returns = columns if state.returns is None else state.returns[rows, columns]
    return list(zip(state.ids[rows].tolist(), returns.tolist(), strict=True))


def _of_none(scan: Scan, pairs: Sequence[tuple[int, int]], sure: set[int]) -> Mask:
    """Return which returns of a scan no real track took."""
    mask: Mask = np.ones(len(scan.detections.z), dtype=bool)
    mask[[j for track, j in pairs if track in sure]] = False
    return mask
