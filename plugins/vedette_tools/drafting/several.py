"""A table of several sensors that measure different things, as a radar's ranges beside the positions of AIS."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from vedette.errors import InputError
from vedette.space import Array, Indices, Mask
from vedette_files.tables.numbers import degrees, is_number
from vedette_tools.drafting.chains import Chain
from vedette_tools.drafting.titles import Meaning

Pair = tuple[str, str]

POLAR: Pair = ("range", "bearing")
GEODETIC: Pair = ("latitude", "longitude")
FLAT: Pair = ("x", "y")
EAST: Pair = ("east", "north")
PAIRS = (POLAR, GEODETIC, FLAT, EAST)
"""Pairs of axes of which one tells where returns are; what a sensor measures itself goes first."""

HELD, OFTEN = 0.5, 0.02
"""A sensor measures what such a part of its rows hold; without a column of sensors, one of so few rows is none."""

BARE = ("distance", "dist", "angle")
"""Titles, in small letters, of steps and turns along a path where a row holds a position too."""

UNNAMED = {POLAR: "radar", GEODETIC: "reports", FLAT: "positions", EAST: "positions"}
"""What sensors are called where no column names them."""

MOST = 200_000
"""So many pairs of a return and a report tell where a sensor stands."""

AGREE, ALONE = 0.3, 1.5
"""It stands where such a part of the reports have a return, and so many times as many as at any other place: by hand."""

GAP = 3.0
"""A report is not carried on over more than so many of the usual waits."""


def measured_by(
    measured: Mapping[str, Meaning], columns: Mapping[str, Sequence[str]], who: str, sensors: Sequence[str]
) -> dict[str, Pair]:
    """Return the pair of axes that each sensor measures; a sensor that tells no place is left out.

    Where a row holds both, latitudes and longitudes of the returns go before ranges in a unit that no title states.
    With a column `who` of `sensors` the first that most of its rows hold. Without, rows that hold the one pair or the other,
    hardly ever both, are of two sensors; else all are of one, whose name is "".
    """
    there = [pair for pair in PAIRS if set(pair) <= set(measured)]
    if there[1:] and POLAR in there and all(measured[axis].title.lower() in BARE for axis in POLAR):
        there = [*there[1:], POLAR]
    cells = {pair: [columns[measured[axis].title] for axis in pair] for pair in there}
    holds = {pair: is_angle if pair == GEODETIC else is_number for pair in there}
    held = {pair: np.array([all(map(holds[pair], row)) for row in zip(*cells[pair], strict=True)]) for pair in there}
    if not there:
        return {}
    both = {POLAR, GEODETIC} <= {*there} and np.mean(held[POLAR] & held[GEODETIC]) >= HELD
    if both and not measured["range"].unit and _of_returns(columns[measured["time"].title], cells[GEODETIC]):
        there = [GEODETIC, *(pair for pair in there if pair != GEODETIC)]
    if len(sensors) > 1:
        of = np.array(columns[who])
        pair_of = {name: next((pair for pair in there if np.mean(held[pair][of == name]) >= HELD), None) for name in sensors}
        return {name: pair for name, pair in pair_of.items() if pair}
    either = [pair for pair in there if len(held[pair]) and np.mean(held[pair]) >= OFTEN]
    if not who and len(either) == 2 and np.mean(held[either[0]] & held[either[1]]) < OFTEN * np.mean(held[either[1]]):
        return {UNNAMED[pair]: pair for pair in either}
    return {"": next((pair for pair in there if len(held[pair]) and np.mean(held[pair]) >= HELD), there[0])}


def _of_returns(times: Sequence[str], places: Sequence[Sequence[str]]) -> bool:
    """Return whether places are those of returns, not of who sees them: most of one time have a place of their own."""
    moments = len({*times})
    return len({*zip(times, *places, strict=True)}) - moments > HELD * (len(times) - moments)


def is_angle(cell: str) -> bool:
    """Return whether a cell holds a latitude or a longitude."""
    try:
        return bool(np.isfinite(degrees(cell)))
    except ValueError:
        return False


def check_together(path: object, pair_of: Mapping[str, Pair], read: Mapping[str, str], titles: Sequence[str]) -> None:
    """Raise InputError for sensors whose positions no source reads beside one another, and for a row of several positions.

    read: the columns of axes that were found, not stated, among `titles`.
    """
    for pair in pair_of.values():
        if set(pair) <= set(read):
            axes = FLAT if pair == EAST else pair
            _check_one_a_row(path, dict(zip(axes, (read[axis] for axis in pair), strict=True)), titles)
    pairs = {pair: name for name, pair in pair_of.items() if pair != POLAR}
    if len(pairs) > 1:
        told = " and ".join(f"{name} gives {' and '.join(pair)}" for pair, name in pairs.items())
        raise InputError(f"{path}: {told}: give the positions of all sensors in the same two columns")


def _check_one_a_row(path: object, pair: Mapping[str, str], titles: Sequence[str]) -> None:
    """Raise InputError for a row of several positions, as x1, y1, x2, y2: of objects side by side, or corners of a box."""
    found = [re.fullmatch(r"(\D*)(\d+)(\D*)", title) for title in pair.values()]
    if not all(found) or len({each[2] for each in found if each}) > 1:
        return
    kinds = [re.compile(re.escape(each[1]) + r"(\d+)" + re.escape(each[3])) for each in found if each]
    held = [{match[1] for title in titles if (match := kind.fullmatch(title))} for kind in kinds]
    if others := sorted((held[0] & held[1]) - {each[2] for each in found if each}):
        another = ", ".join(f"{each[1]}{others[0]}{each[3]}" for each in found if each)
        told = f"a row holds {', '.join(pair.values())} and {another}: write a row for each position, with its object's name"
        stated = ",".join(f"{axis}={title}" for axis, title in pair.items())
        raise InputError(f"{path}: {told}; or read one alone: --columns {stated}")


def stand(reports: Sequence[Chain], times: Array, spots: Sequence[Array], width: float) -> tuple[Array, float] | None:
    """Return where (2,) a sensor stands whose returns `spots`, of scans at `times`, are relative to it; None if unsure.

    Where it is put there, targets that report their places have returns there: each pair of a report and a return of one
    time tells a place, those that belong together the same. `width`: of the errors, in m. Beside the place, in which part of
    the looks at reports a return lies within three widths.
    """
    told, looks = _offsets(reports, times, spots)
    if looks == 0 or not len(told):
        return None
    every, count = np.unique(np.rint(told / width).astype(int), axis=0, return_counts=True)
    near = np.array([_near(every, count, cell) for cell in every[np.argsort(-count)[:50]]])
    first = every[np.argsort(-count)[:50]][int(np.argmax(near))]
    place = width * first.astype(float)
    for _ in range(5):
        within = told[np.linalg.norm(told - place, axis=-1) < 3 * width]
        place = np.median(within, axis=0)
    apart = np.abs(every - place / width).max(axis=-1)
    others = every[apart > 6]
    rival = max((_near(every, count, cell) for cell in others[np.argsort(-count[apart > 6])[:20]]), default=0)
    share = len(within) / looks
    if share < AGREE or len(within) < ALONE * rival:
        return None
    return place, min(share, 1.0)


def _near(every: Indices, count: Indices, cell: Indices) -> int:
    """Return how many pairs lie in a cell and those around it."""
    return int(np.sum(count[np.abs(every - cell).max(axis=-1) <= 1]))


def carried(chain: Chain, times: Array) -> tuple[Mask, Array]:
    """Return at which times (s,) the place of a chain's target is known, and where it was (s, 2): on the way between two."""
    k = np.searchsorted(chain.times, times)
    waits = np.diff(chain.times)
    near = waits[np.clip(k - 1, 0, len(waits) - 1)] <= GAP * float(np.median(waits))
    spots = np.stack([np.interp(times, chain.times, along) for along in chain.spots.T], axis=-1)
    return (k > 0) & (k < len(chain.times)) & near, spots


def _offsets(reports: Sequence[Chain], times: Array, spots: Sequence[Array]) -> tuple[Array, int]:
    """Return the place that each pair of a report and a return tells, and at how many reports the sensor looked."""
    step = max(1, sum(map(len, spots)) * len(reports) // MOST)
    told, looks = [np.zeros((0, 2))], 0
    for chain in reports:
        for there, spot, places in zip(*carried(chain, times[::step]), spots[::step], strict=True):
            if there and len(places):
                looks += 1
                told.append(spot - places)
    return np.concatenate(told), looks
