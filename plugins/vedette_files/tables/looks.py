"""Rows of returns become scans: those of one time, of one scan's number, of one turn of the antenna, or each alone."""

from __future__ import annotations

from collections import Counter
from itertools import groupby
from math import floor, inf

from attrs import frozen

from vedette.errors import Problem
from vedette_files.input_files import shown
from vedette_files.readers import NOT_OF_SCAN, Sample, in_time_order

Cells = tuple[str, tuple[float, ...] | None, int, tuple[float, ...]]
"""A row's scan id, its values, None where all cells are empty, its code and its covariance."""


@frozen
class Look:
    """One scan: its id, empty if the file has none, its returns over the axes of `Reading.placed`, and their codes.

    times: of the returns, where they have their own, and noises: their covariances; else nothing.
    """

    scan: str
    returns: tuple[tuple[float, ...], ...]
    codes: tuple[int, ...] = ()
    times: tuple[float, ...] = ()
    noises: tuple[tuple[float, ...], ...] = ()


def by_time(rows: list[Sample[Cells]], refused: list[Problem], sort: bool) -> list[Sample[Look]]:
    return [_look(list(scan)) for _, scan in groupby(in_time_order(rows, refused, sort=sort), lambda row: row.time)]


def by_row(rows: list[Sample[Cells]], refused: list[Problem], sort: bool) -> list[Sample[Look]]:
    return [_look([row]) for row in in_time_order(rows, refused, sort=sort)]


def by_scan(rows: list[Sample[Cells]], refused: list[Problem], sort: bool) -> list[Sample[Look]]:
    """Return scans at the time of most of their rows; rows of another time are refused, unless most rows are such."""
    scans: dict[str, list[Sample[Cells]]] = {}
    for row in rows:
        scans.setdefault(row.value[0], []).append(row)
    times = sum(len({row.time for row in members}) for members in scans.values())
    if times > 0.5 * (len(scans) + len(rows)):
        return _of_turns(list(scans.values()), refused, sort)
    looks = []
    for scan, members in scans.items():
        time = Counter(row.time for row in members).most_common(1)[0][0]
        where = f"scan {shown(scan)} elsewhere"
        refused += [
            Problem(row.place, f"time {row.time!r} s is not that of {where}, {time!r} s", kind=NOT_OF_SCAN)
            for row in members
            if row.time != time
        ]
        looks.append(_look([row for row in members if row.time == time]))
    return in_time_order(looks, refused, sort=sort)


def by_turn(turn: float, rows: list[Sample[Cells]], refused: list[Problem], sort: bool) -> list[Sample[Look]]:
    """Return scans of the rows of each turn, the first of which begins with the first row."""
    kept = in_time_order(rows, refused, sort=sort)
    first = kept[0].time if kept else 0.0
    return [_look(list(scan), own=True) for _, scan in groupby(kept, lambda row: floor((row.time - first) / turn))]


def _of_turns(turns: list[list[Sample[Cells]]], refused: list[Problem], sort: bool) -> list[Sample[Look]]:
    """Return scans whose rows have times of their own; rows out of the time between the scans around are refused."""
    turns = sorted(turns, key=_middle) if sort else turns
    middles = [-inf, *map(_middle, turns), inf]
    looks = []
    for before, turn, after in zip(middles, turns, middles[2:], strict=False):
        low, high = (before, after) if before <= after else (-inf, inf)  # if the scans are out of order, they are told
        looks.append(_look(sorted((row for row in turn if low <= row.time <= high), key=lambda row: row.time), own=True))
        text = f"is not between the scans around its own, of {before!r} and {after!r} s"
        refused += [Problem(row.place, f"time {row.time!r} s {text}") for row in turn if not low <= row.time <= high]
    return in_time_order(looks, refused, sort=sort)


def _middle(rows: list[Sample[Cells]]) -> float:
    """Return a scan's median time."""
    return sorted(row.time for row in rows)[(len(rows) - 1) // 2]


def _look(rows: list[Sample[Cells]], own: bool = False) -> Sample[Look]:
    """Return the scan of rows, of the time of the last; `own`: each return keeps its time."""
    given = [(row.time, values, *row.value[2:]) for row in rows if (values := row.value[1]) is not None]
    told = [one for one, _ in dict.fromkeys((one, i if one[2] < 0 else -1) for i, one in enumerate(given))]
    times = tuple(time for time, *_ in told) if own else ()
    codes, noises = tuple(code for _, _, code, _ in told), tuple(noise for *_, noise in told if noise)
    look = Look(rows[0].value[0], tuple(values for _, values, *_ in told), codes, times, noises)
    return Sample(rows[0].place, rows[-1].time, look, len(rows))
