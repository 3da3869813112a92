"""What was told of each scan, for readers of any speed."""

from __future__ import annotations

from bisect import bisect_left
from threading import Condition
from typing import final

from attrs import frozen

from vedette.types import Frame

MOST = 64 * 2**20
"""Bytes of records that wait for slow readers; beyond them the oldest go."""

EVENT = 2**20
"""Bytes that a reader is given at once, or one record."""


@frozen(eq=False)
class Taken:
    """What a reader gets: `text`, the records of the scans before `next`; how many before them are `lost`.

    `ended` says why none will follow, None if some may. `picture` is the last frame, with its scan's number.
    """

    text: bytes
    next: int
    lost: int
    ended: str | None
    picture: tuple[int, Frame] | None


@final
class Journal:
    """The records of a run's scans, numbered from 0 on. Whoever adds one never waits for a reader."""

    def __init__(self, most: int = MOST) -> None:
        self._first, self._records = list[int](), list[bytes]()
        self._most, self._bytes, self._changed = most, 0, Condition()
        self._picture: tuple[int, Frame] | None = None
        self._ended: str | None = None
        self.count = 0

    def add(self, record: bytes, scans: int, frame: Frame | None = None) -> None:
        """Add the record of the next `scans`, and the frame of the last of them, if it has one."""
        with self._changed:
            self._first.append(self.count)
            self._records.append(record)
            self._bytes += len(record)
            self.count += scans
            if frame is not None:
                self._picture = self.count - 1, frame
            while self._bytes > self._most and len(self._records) > 1:
                self._bytes -= len(self._records.pop(0))
                self._first.pop(0)
            self._changed.notify_all()

    def end(self, why: str) -> None:
        """Say that no further record comes, and why: `ended` or `interrupted`."""
        with self._changed:
            self._ended = why
            self._changed.notify_all()

    def after(self, number: int, wait: float) -> Taken:
        """Return the records from this scan on, once there is one or none will come, or after `wait` s."""
        with self._changed:
            self._changed.wait_for(lambda: self.count > number or self._ended is not None, wait)
            begin = end = bisect_left(self._first, number)
            first = self._first[begin] if begin < len(self._first) else self.count
            size = 0
            while end < len(self._records) and (size < EVENT or begin == end):
                size += len(self._records[end])
                end += 1
            last = self._first[end] if end < len(self._first) else self.count
            ended = self._ended if last == self.count else None
            return Taken(b"".join(self._records[begin:end]), last, first - number, ended, self._picture)
