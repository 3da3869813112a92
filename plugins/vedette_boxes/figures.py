"""HOTA, MOTA and IDF1 of boxes by their overlap, as the MOTChallenge's evaluation has them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, final

import numpy as np
from attrs import field, frozen

from vedette import Array, Gaussian, Indices
from vedette.metrics import Figure
from vedette_boxes.rows import BoxRows, overlap
from vedette_boxes.sensors.box import BOX
from vedette_boxes.shown import shown
from vedette_standard.whole_tracks import hota, idf1

HALF = 0.5
"""Intersection over union from which on a track is that of an object, for MOTA and IDF1."""
CONTINUED = 1000.0
"""What it is worth that a pair was matched in the frame before, against an overlap of 1 at most."""
_ROUNDING = 2.3e-16


@final
@frozen(eq=False)
class Frames:
    """Objects and tracks of some frames: per frame their ids (j,) and (t,), and the overlap (j, t) of their boxes."""

    truth: list[Indices] = field(factory=list)
    tracks: list[Indices] = field(factory=list)
    alike: list[Array] = field(factory=list)

    def add(self, objects: Indices, boxes: Array, tracks: Indices, estimates: Array) -> None:
        """Take a frame: objects (j,) with boxes (j, 4), and tracks (t,) with boxes (t, 4)."""
        self.truth.append(objects)
        self.tracks.append(tracks)
        self.alike.append(overlap(boxes, estimates))


def of_files(truth: BoxRows, results: BoxRows) -> Frames:
    """Return the frames of a file of true boxes and of one of results."""
    frames = Frames()
    for number in np.union1d(truth.frame, results.frame):
        there, here = truth.of(truth.frame == number), results.of(results.frame == number)
        frames.add(there.id, there.box, here.id, here.box)
    return frames


def judged(frames: Frames) -> dict[str, float]:
    """Return HOTA with its parts, MOTA and IDF1; none without true objects.

    Luiten, Osep, Dendorfer, Torr, Geiger, Leal-Taixe, Leibe, HOTA: A Higher Order Metric for Evaluating Multi-Object
    Tracking, Int. J. Computer Vision 129, 2021.
    """
    objects = np.unique(np.concatenate([*frames.truth, np.zeros(0, dtype=int)]))
    tracks = np.unique(np.concatenate([*frames.tracks, np.zeros(0, dtype=int)]))
    if not len(objects):
        return {}
    alive = np.zeros((len(frames.truth), len(objects)), dtype=bool)
    apart, present = list[Array](), list[Any]()
    for row, there, here, alike in zip(alive, frames.truth, frames.tracks, frames.alike, strict=True):
        which = np.searchsorted(objects, there)
        row[which] = True
        distance = np.full((len(objects), len(here)), np.inf)
        distance[which] = 1.0 - alike
        apart.append(distance)
        present.append(np.searchsorted(tracks, here))
    higher, same = hota(apart, present, alive, len(tracks), 1.0), idf1(apart, present, alive, 1.0 - HALF + 1e-12)
    return {
        "hota": higher.value,
        "detection": higher.detection,
        "association": higher.association,
        "localisation": higher.localisation,
        "mota": _mota(frames),
        "idf1": 0.0 if same is None else same,
    }


def _mota(frames: Frames) -> float:
    """Return 1 - (missed + false + switches) / objects.

    Each frame is matched at the greatest sum of overlaps of at least HALF, pairs of the frame before first; a switch is a
    match with another track than the object's last one.
    Bernardin, Stiefelhagen, Evaluating Multiple Object Tracking Performance, EURASIP J. Image and Video Processing, 2008.
    """
    from scipy.optimize import linear_sum_assignment

    wrong = objects = 0
    last, before = dict[int, int](), dict[int, int]()
    for there, here, alike in zip(frames.truth, frames.tracks, frames.alike, strict=True):
        objects += len(there)
        if not len(there) or not len(here):
            wrong += len(there) + len(here)
            continue
        continued = np.array([[before.get(one) == other for other in here.tolist()] for one in there.tolist()])
        worth = np.where(alike >= HALF - _ROUNDING, alike + CONTINUED * continued, 0.0)
        rows, columns = linear_sum_assignment(-worth)
        taken = worth[rows, columns] > 0
        before = dict(zip(there[rows[taken]].tolist(), here[columns[taken]].tolist(), strict=True))
        wrong += len(there) + len(here) - 2 * len(before)
        wrong += sum(last.get(one, other) != other for one, other in before.items())
        last |= before
    return 1.0 - wrong / objects


@final
class OfRun:
    """One of these figures of a run whose tracks and truth have boxes in px; None of any other."""

    def __init__(self, name: str) -> None:
        self._name, self._frames = name, Frames()

    def add(self, block: Any) -> None:
        """Take some more scans."""
        match = block.found
        if not set(BOX.axes) <= set(match.truth.space.axes):
            return
        where, entries = match.truth.space.locate(BOX), match.entries
        boxes, here = shown(Gaussian(entries.mean, entries.cov), match.truth.space, entries.hit)
        for i, part in enumerate(match.rows):
            there = np.flatnonzero(match.truth.alive[i])
            rows = part.start + np.flatnonzero(here[part])
            self._frames.add(block.which[there], match.truth.states[i, there][:, where], entries.track[rows], boxes[rows])

    def value(self) -> float | None:
        """Return the figure of all scans so far."""
        return judged(self._frames).get(self._name)


TOLD: Mapping[str, str] = {
    "hota": "HOTA of boxes by their overlap",
    "detection": "its part of detection",
    "association": "its part of association",
    "mota": "MOTA of boxes that overlap by half",
    "idf1": "IDF1 of boxes that overlap by half",
}


def figures() -> Sequence[Figure]:
    """Return the figures of runs of boxes."""
    starts: dict[str, Callable[[], OfRun]] = {name: partial(OfRun, name) for name in TOLD}
    return [Figure(f"box_{name}", "1", about, within=(-np.inf, 1.0), start=starts[name]) for name, about in TOLD.items()]
