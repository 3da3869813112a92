"""What all readers share: where a recording lies, its lines, and what keeps it in time order."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Generic, TypeVar

import numpy as np
from attrs import frozen

from vedette.errors import ConfigError, InputError, Problem
from vedette.space import Array, Axis, Space
from vedette.types import Detections

V = TypeVar("V")

NORTH_EAST = "x north, y east"
FRAMES = ("x east, y north", NORTH_EAST)
"""Where the axes of the plane may point. A recording's note `frame` says so where it is not the first: maps turn by it."""


def find(path: str, wanted: str, files: Sequence[str] = ()) -> Path:
    """Where a config's `source.path` points: a folder that holds `files`, or one file if there are none.

    ConfigError if it is missing or leads nowhere, InputError if a file is not there; both say what is `wanted`.
    """
    if not path:
        raise ConfigError([Problem("path", f"is not given. Wanted: {wanted}")])
    found = Path(path).expanduser()
    if not found.exists():
        raise ConfigError([Problem("path", f"there is no file or folder {path!r}. Wanted: {wanted}")])
    for name in files:
        if not (found / name).is_file():
            raise InputError(f"{found / name}: there is no such file. Wanted: {wanted}")
    return found


def lines(path: Path) -> Iterator[tuple[int, str]]:
    """The lines of a UTF-8 file, counted from 1, without their ends; InputError if it cannot be read or holds nothing.

    What is not UTF-8 becomes U+FFFD, so that one bad byte costs one line and not the file.
    """
    number = 0
    try:
        with path.open(encoding="utf-8-sig", errors="replace") as file:
            for number, line in enumerate(file, start=1):
                yield number, line.rstrip("\n")
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    if number == 0:
        raise InputError(f"{path}: is empty")


@frozen(eq=False)
class Sample(Generic[V]):
    """Something that a file tells about one time in s, and where it stands."""

    place: str
    time: float
    value: V


def in_time_order(samples: Sequence[Sample[V]], refused: list[Problem]) -> list[Sample[V]]:
    """The samples without those that break the order of time, which are added to `refused`: as few as possible.

    What stays is the longest non-decreasing subsequence; of several, the one that keeps the earlier entries. So one time
    far ahead is refused by itself, rather than all that follow it.
    """
    keep = _longest_in_order([sample.time for sample in samples])
    kept = []
    following = iter([sample.time for sample, good in zip(samples, keep, strict=True) if good])
    after = next(following, None)
    for sample, good in zip(samples, keep, strict=True):
        if good:
            kept.append(sample)
            after = next(following, None)
            continue
        around = [f"after {kept[-1].time!r} s"] if kept else []
        around += [] if after is None else [f"before {after!r} s"]
        refused.append(Problem(sample.place, f"time {sample.time!r} s is out of order: it stands {' and '.join(around)}"))
    return kept


def _longest_in_order(times: Sequence[float]) -> list[bool]:
    # From the back: tails[k] is minus the time that starts the best run of k + 1 entries so far, starts[k] its index.
    tails: list[float] = []
    starts: list[int] = []
    following = [-1] * len(times)
    for i in range(len(times) - 1, -1, -1):
        k = bisect_right(tails, -times[i])
        following[i] = starts[k - 1] if k else -1
        tails[k : k + 1] = [-times[i]]
        starts[k : k + 1] = [i]
    keep = [False] * len(times)
    i = starts[-1] if starts else -1
    while i >= 0:
        keep[i] = True
        i = following[i]
    return keep


def detections(columns: Mapping[str, Array], measured: Space) -> Detections:
    """One scan over the `measured` axes from `columns`, axis name to values (k,), angles wrapped."""
    z = np.stack([columns[name] for name in measured.names], axis=-1)
    return Detections.of(measured.canonical(z), len(measured))


def beyond_period(name: str, axis: Axis, values: Array) -> str | None:
    """Say that `values` on an axis that wraps are larger than its period, so probably in another unit; or nothing."""
    largest = float(np.max(np.abs(values[np.isfinite(values)]), initial=0.0))
    if axis.period is None or largest <= 1.0001 * axis.period:
        return None
    return (
        f"{name}: {axis.name} goes up to {largest:.4g} {axis.unit}, beyond its period of {axis.period:.4g} {axis.unit}: are "
        "the values in degrees? Then state it, as in source.detections.units.bearing = 'deg'"
    )


def polar(x: Array, y: Array, heading: float = 0.0) -> dict[str, Array]:
    """Range and bearing (k,) of what lies at `x`, `y` (k,) from a platform; the heading turns the bearing."""
    return {"range": np.hypot(x, y), "bearing": np.arctan2(y, x) - heading}
