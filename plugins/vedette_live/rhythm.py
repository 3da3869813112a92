"""When the silence of a sensor is no pause: it came at a steady interval, and has not for many of these."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from math import inf
from statistics import median
from typing import final

from attrs import define, field

from vedette.streams import now

LOOKS = 30
"""Latest intervals that are judged."""
STEADY = 24
"""Of these, that are within half their median of it: one in five scans may be lost. Where messages come by chance, at
exponential intervals, that is so for 2.5 of a million of runs."""
LEAST = 1.0
"""s of an interval at least: what comes faster is counted together."""
MANY = 8.0
"""Intervals of silence from which it is told, by hand; a turn that is lost is one."""
SHORT = 10.0
"""s of silence that are told of no sensor, by hand."""
PAUSES = 3.0
"""Longest pauses between the latest messages of a sender of batches, of which as many are no silence, by hand."""
LATE = 1.0
"""s between two looks from which on we were busy ourselves, or stopped."""


@final
@define
class Rhythm:
    """How regularly a sensor comes, by the times of its messages; `limit`: the s of silence from which it is told.

    A single return each time may be of one target, which has left: such a sensor has no limit, nor has one of few intervals.
    """

    limit: float = inf
    period: float = inf
    heard: float = -inf
    _time: float = -inf
    _came: float = -inf
    _empty: bool = False
    _count: int = 0
    _looks: deque[tuple[float, float, bool]] = field(factory=lambda: deque[tuple[float, float, bool]](maxlen=LOOKS))

    def hear(self, time: float, came: float, returns: int) -> None:
        """Take a message of a `time`, which came at another, by our clock, with so many returns."""
        self.heard = came
        self._empty |= not returns
        self._count += returns
        if (apart := abs(time - self._time)) < LEAST:
            return
        self._looks.append((apart, came - self._came, self._empty or self._count > 1))
        self._time, self._came, self._empty, self._count = time, came, False, 0
        if len(self._looks) == LOOKS:
            self.period = median(apart for apart, _, _ in self._looks)
            alike = sum(many and abs(apart - self.period) <= self.period / 2 for apart, _, many in self._looks)
            pause = max(pause for _, pause, _ in self._looks)
            self.limit = max(MANY * self.period, SHORT, PAUSES * pause) if alike >= STEADY else inf


@final
@define
class Rhythms:
    """The rhythms of sensors, each by its input and name, and which come no more though we waited for nothing else."""

    known: dict[tuple[int, str], Rhythm] = field(factory=dict)
    _busy: float = -inf
    _looked: float = field(factory=now)

    def hear(self, i: int, sensor: str, time: float, came: float, returns: int) -> None:
        """Take a message of a sensor, as its rhythm does."""
        self.known.setdefault((i, sensor), Rhythm()).hear(time, came, returns)

    def silences(self, waiting: bool) -> Iterator[tuple[int, str, str]]:
        """Yield each sensor, its input before it, with what is told of its silence, "" of none; `waiting`: so do scans."""
        at = now()
        if waiting or at - self._looked > LATE:
            self._busy = at
        self._looked = at
        for (i, sensor), rhythm in self.known.copy().items():
            silent = at - max(rhythm.heard, self._busy)
            told = f"nothing came for {silent:.0f} s, and it came every {rhythm.period:.3g} s"
            yield i, sensor, told if silent > rhythm.limit else ""
