"""What all readers share: where a recording lies, its lines, and what keeps it in time order."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Generic, TypeVar

import numpy as np
from attrs import frozen

from vedette.errors import ConfigError, InputError, Problem
from vedette.io.opening import inside, lines, shown, user_path
from vedette.space import Array, Space
from vedette.types import Detections

__all__ = ["FRAMES", "NORTH_EAST", "Sample", "check_files", "detections", "find", "in_time_order", "lines", "polar"]

V = TypeVar("V")

NORTH_EAST = "x north, y east"
FRAMES = ("x east, y north", NORTH_EAST)
"""Where the axes of the plane may point. A recording's note `frame` says so where it is not the first: maps turn by it."""


def find(path: str, wanted: str) -> Path:
    """Return where a config's `source.path` points, a folder or a file. ConfigError says what is `wanted`."""
    if not path:
        raise ConfigError([Problem("path", f"is not given. Wanted: {wanted}")])
    try:
        found = user_path(path)
    except ValueError as error:
        raise ConfigError([Problem("path", f"{error}. Wanted: {wanted}")]) from None
    if not found.exists():
        raise ConfigError([Problem("path", f"there is no file or folder {shown(path)}. Wanted: {wanted}")])
    if not found.is_file() and not found.is_dir():
        raise ConfigError([Problem("path", f"{shown(path)} is no regular file and no folder. Wanted: {wanted}")])
    return found


def check_files(folder: Path, files: Sequence[tuple[str, str]], wanted: str) -> None:
    """Check that files that a config names, (place in the config, name), are there and in the folder.

    ConfigError for a name or a link that leads out of the folder, InputError that says what is `wanted` for one that is not
    there.
    """
    for place, name in files:
        try:
            file = inside(folder, name)
        except ValueError as error:
            raise ConfigError([Problem(place, str(error))]) from None
        if not file.is_file():
            text = "is no regular file" if file.exists() else "there is no such file"
            raise InputError(f"{file}: {text}. Wanted: {wanted}")


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


def polar(x: Array, y: Array, heading: float = 0.0) -> dict[str, Array]:
    """Range and bearing (k,) of what lies at `x`, `y` (k,) from a platform; the heading turns the bearing."""
    return {"range": np.hypot(x, y), "bearing": np.arctan2(y, x) - heading}
