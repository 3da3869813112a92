"""Scans handed out when they are due, as if they came now."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import inf, isfinite
from time import monotonic, sleep, time
from typing import Any, final

from vedette.types import come_once


@final
class Pace:
    """Hands each scan of a recording out at its time, `speed` times as fast as it was recorded, and notes when it came.

    Scans that come once, as a camera's, keep their own pace. `came` is when the last scan came, in s since 1970: when it was
    due, if what takes the scans is late. It stands in the place of a display of progress.
    """

    def __init__(self, speed: float = 1.0) -> None:
        self._speed, self.came = speed, time()

    def __call__(self, items: Sequence[Any], about: str, /) -> Iterable[Any]:
        """Yield the scans in time."""
        paced = isfinite(self._speed) and not come_once(items)
        begin = first = None
        for scan in items:
            if begin is None or first is None:
                begin, first = monotonic(), scan.time
            early = begin + (scan.time - first) / self._speed - monotonic() if paced else 0.0
            if early > 0:
                sleep(early)
            self.came = time() + min(early, 0.0)
            yield scan


def read_speed(text: str) -> float:
    """Return a speed as the command line gives it: times the recorded one, or `max`; ValueError says what is wrong."""
    if text == "max":
        return inf
    try:
        speed = float(text)
    except ValueError:
        speed = 0.0
    if not 0 < speed < inf:
        raise ValueError(f"must be above 0, as in '10' for ten times as fast as recorded, or 'max', got {text!r}")
    return speed
