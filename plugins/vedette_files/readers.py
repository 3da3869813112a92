"""The common part of all readers: finding a recording, its lines, and keeping time order."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Generic, TypeVar

import numpy as np
from attrs import evolve, frozen

from vedette import Array, Axis, ConfigError, Detections, InputError, Problem, Space
from vedette.errors import LATE
from vedette.units import in_unit
from vedette_files.input_files import inside, shown, user_path

V = TypeVar("V")

NOT_OF_SCAN, BEYOND_PLANE = "not of its scan", "beyond the plane"
"""Kinds of problems: a time that is not that of the scan's other rows; a place that the plane does not reach."""
OFFER = "`sort = true` in the source sorts them"

NORTH_EAST = "x north, y east"
FRAMES: tuple[str, str] = ("x east, y north", NORTH_EAST)
"""Where the axes of the plane may point. A recording's note `frame` states it unless it is the first: maps follow it."""


def east_north(frame: str) -> tuple[str, str]:
    """Return the axes that point east and north: x and y, unless the frame says that x points north."""
    return ("y", "x") if frame == NORTH_EAST else ("x", "y")


def find(path: str, wanted: str) -> Path:
    """Return where a config's `source.path` points, a folder or a file. ConfigError says what is `wanted`."""
    if not path:
        raise ConfigError.at("path", f"is not given. Wanted: {wanted}")
    try:
        file = user_path(path)
    except ValueError as error:
        raise ConfigError.at("path", f"{error}. Wanted: {wanted}") from None
    if not file.exists():
        begins = "" if file.is_absolute() else f", as paths begin in the current folder, {str(Path.cwd())!r}"
        raise ConfigError.at("path", f"there is no file or folder {shown(path)}{begins}. Wanted: {wanted}")
    if not file.is_file() and not file.is_dir():
        raise ConfigError.at("path", f"{shown(path)} is no regular file and no folder. Wanted: {wanted}")
    return file


def check_files(folder: Path, files: Sequence[tuple[str, str]], wanted: str) -> None:
    """Check that files that a config names, (place in the config, name), are there and in the folder.

    ConfigError for a name or a link that leads out of the folder, InputError that says what is `wanted` for one that is not
    there.
    """
    for place, name in files:
        try:
            file = inside(folder, name)
        except ValueError as error:
            raise ConfigError.at(place, str(error)) from None
        if not file.is_file():
            text = "is no regular file" if file.exists() else "there is no such file"
            raise InputError(f"{file}: {text}. Wanted: {wanted}")


@frozen(eq=False)
class Sample(Generic[V]):
    """A value that a file gives for one time in s, and its place."""

    place: str
    time: float
    value: V
    rows: int = 1


def in_time_order(samples: Sequence[Sample[V]], refused: list[Problem], *, sort: bool = False) -> list[Sample[V]]:
    """Return the samples without those that break the order of time, or all of them sorted.

    Those that break it are added to `refused`: as few as possible.

    What stays is the longest non-decreasing subsequence; of several, the one that keeps the earlier entries. So a single
    time far ahead is refused by itself, rather than all that follow it.
    """
    if sort:
        return sorted(samples, key=lambda sample: sample.time)
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
        text = f"time {sample.time!r} s is out of order: it stands {' and '.join(around)}"
        refused.append(Problem(sample.place, text, sample.rows, kind=LATE))
    return kept


def offer_sorting(refused: Sequence[Problem], total: int) -> list[Problem]:
    """Return what was refused of `total` rows. Of three or more out of order the first leads, and offers to sort them."""
    late = [problem for problem in refused if problem.kind == LATE]
    if len(late) < 3:
        return list(refused)
    count = sum(problem.rows for problem in late)
    told = f"{late[0].text}; {count} of {total} rows go back in time and are refused: {OFFER}"
    return [evolve(late[0], text=told), *(problem for problem in refused if problem is not late[0])]


def offers_first(refused: Iterable[Sequence[Problem]]) -> list[Problem]:
    """Return the problems of all tables, those first that tell of many."""
    return sorted((problem for table in refused for problem in table), key=lambda problem: OFFER not in problem.text)


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
    """Build one scan over the `measured` axes from `columns`, axis name to values (k,), NaN is missing, angles wrapped."""
    z = np.stack([columns[name] for name in measured.names], axis=-1)
    lacking = np.isnan(z)
    return evolve(Detections.of(measured.canonical(z), len(measured)), missing=lacking if lacking.any() else None)


def beyond_period(name: str, axis: Axis, values: Array, unit: str = "") -> str | None:
    """Say that `values` on an axis that wraps exceed its period, so are probably in another unit; None if they do not.

    `unit` is the one that the config states for them, if it does. What exceeds a turn in degrees, too, is not in degrees.
    """
    largest = float(np.max(np.abs(values[np.isfinite(values)]), initial=0.0))
    if axis.period is None or largest <= 1.0001 * axis.period:
        return None
    size, went = f"{_figure(largest)} {axis.unit}", f"{name}: {axis.name} goes up to"
    beyond = f"beyond its period of {axis.period:.4g} {axis.unit}"
    place = f"source.detections.units.{axis.name}"
    if unit not in ("", axis.unit):
        as_read = largest / in_unit(unit if unit[:1].isdigit() else f"1 {unit}", axis.unit)
        stated = f"{_figure(as_read)} ({size} by {place} = {unit!r})"
        return f"{went} {stated}, {beyond}: is it the right column, and the right unit?"
    if largest > 1.0001 * math.degrees(axis.period):
        other = f"is it the right column, and its unit another, as in {place} = '0.1 deg'?"
        return f"{went} {size}, {beyond}, and beyond a turn in degrees, too: {other}"
    return f"{went} {size}, {beyond}: are the values in degrees? Then state it, as in {place} = 'deg'"


def _figure(value: float) -> str:
    return f"{value:,.0f}" if value >= 1000 else f"{value:.4g}"


def polar(x: Array, y: Array, heading: float = 0.0) -> dict[str, Array]:
    """Return range and bearing (k,) of positions `x`, `y` (k,) relative to a platform; the heading turns the bearing."""
    return {"range": np.hypot(x, y), "bearing": np.arctan2(y, x) - heading}
