"""Where the true objects are at times that only go on: all objects at once, so that it keeps up with many scans a second."""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import numpy as np

from vedette import Array, Recording
from vedette_files import Column
from vedette_report.map.plane import Plane


@final
class TrueObjects:
    """Says of scan after scan what `ScanRows.true` says of all: linear between states, nothing across more than `most` s."""

    def __init__(self, recording: Recording, plane: Plane | None, most: float | None) -> None:
        shown = [(j, true) for j, true in enumerate(recording.truth) if plane is not None and plane.within(true.space)]
        told = [(j, true) for j, true in shown if len(true.times)]
        self._plane, self._most = plane, np.inf if most is None else most
        self._object = np.array([j for j, _ in told], dtype=np.int32)
        sizes = np.array([len(true.times) for _, true in told], dtype=np.intp)
        self._last = np.cumsum(sizes) - 1
        self._at = self._first = self._last - sizes + 1
        self._times = np.concatenate([np.zeros(0), *(true.times for _, true in told)])
        points = [plane.points(true.space, true.states) for _, true in told] if plane is not None else []
        self._points = np.concatenate([np.zeros((0, 2)), *points])

    def true(self, times: Sequence[float]) -> dict[str, Column]:
        """Return the rows of scans at these times, none before those of the last call, numbered from 0."""
        states = [self._of(time) for time in times]
        return {
            "scan": np.repeat(np.arange(len(states), dtype=np.int32), [len(own) for own, _ in states]),
            "object": np.concatenate([np.zeros(0, np.int32), *(own for own, _ in states)]),
            "position": np.concatenate([np.zeros((0, 2)), *(spots for _, spots in states)]),
        }

    def _of(self, time: float) -> tuple[Column, Array]:
        """Return which objects there are at a time, and where."""
        times, last = self._times, self._last
        if self._plane is None or not len(last):
            return np.zeros(0, np.int32), np.zeros((0, 2))
        while np.any(late := times[np.minimum(self._at + 1, last)] < time) and np.any(late & (self._at < last)):
            self._at = self._at + (late & (self._at < last))
        i, j = self._at, np.minimum(self._at + 1, last)
        gap = times[j] - times[i]
        part = np.clip(np.divide(time - times[i], gap, out=np.zeros(len(i)), where=gap > 0), 0.0, 1.0)
        if np.any((gap > self._most) & (part > 0) & (part < 1)):
            return np.zeros(0, np.int32), np.zeros((0, 2))  # nothing is judged there, and nothing shown
        alive = (times[self._first] <= time) & (time <= times[last])
        step = part[:, None] * self._plane.space.difference(self._points[j], self._points[i])
        return self._object[alive], self._plane.space.displace(self._points[i], step)[alive]
