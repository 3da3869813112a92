"""What recordings hold that no sensor sends: marks of what is missing, rows written twice, clocks set back."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from vedette import Array, Axis, Indices, Scan, Sensor, Space
from vedette_files.readers import Sample

LEAST, FAR_BEYOND = 10, 5.0
"""Of so many values one that is so many times as large as any other, and stands there twice, looks like a mark: by hand.

So does a row that comes so often, and so many times as often as any other; and so many rows after a leap back in time are
no rows out of order.
"""

LEAPS = 1.5
"""The step after a position that was held is so many times the usual one: by hand, as it is 2 for one held once."""

HOUR, PAUSE = 3600.0, 600.0
"""s: where summer time begins an hour lacks, where it ends one comes again; a pause so long hides both: by hand."""

COPIED = 0.05
"""Such a part of the returns that repeats another of the same scan to the last digit was written twice: by hand."""


def odd_returns(name: str, space: Space, z: Array, of: Indices, *, named: bool) -> Iterator[str]:
    """Yield in words what looks like no returns of a sensor: all of them (k, m) over `space`, as read; (k,) `of` which scan.

    named: whether returns name their objects: these may stay where they are, and are told once.
    """
    for axis, column in zip(space.axes, z.T, strict=True):
        yield from _far_mark(name, axis, column)
    if named or len(z) < LEAST:
        return
    yield from _standing_mark(name, space, z)
    copies = len(z) - len(np.unique(np.column_stack([of, z]), axis=0))
    if copies >= max(LEAST, COPIED * len(z)):
        told = f"{name}: {copies:,} of {len(z):,} returns repeat another of their scan to the last digit"
        yield f"{told}: each counts as one more; if they were written twice, delete the copies"


def _far_mark(name: str, axis: Axis, values: Array) -> Iterator[str]:
    """Yield that one of the values stands in several rows and far beyond all others, as -9999 does."""
    sizes, counts = np.unique(np.abs(values[np.isfinite(values)]), return_counts=True)
    enough = axis.period is None and len(values) >= LEAST and len(sizes) > 1
    if enough and counts[-1] > 1 and sizes[-1] >= FAR_BEYOND * sizes[-2]:
        mark = values[np.abs(values) == sizes[-1]][0]
        least = f"and at most {sizes[-2]:.4g} in all others"
        yield f"{name}: {axis.name} is {mark:.10g} {axis.unit} in {counts[-1]} returns, {least}: {CURE}"


def _standing_mark(name: str, space: Space, z: Array) -> Iterator[str]:
    """Yield that one row comes again and again, as no other does: the same number along all axes, but angles."""
    rows, counts = np.unique(z[np.isfinite(z).all(axis=-1)], axis=0, return_counts=True)
    if not len(rows):
        return
    mark, count = rows[np.argmax(counts)], int(np.max(counts))
    flat = mark[[axis.period is None for axis in space.axes]]
    alike = len(flat) > 0 and np.ptp(flat) == 0 and (len(flat) > 1 or flat[0] == 0)
    if alike and count >= max(LEAST, FAR_BEYOND * np.max(np.delete(counts, np.argmax(counts)), initial=0)):
        value = ", ".join(f"{axis.name} = {each:.10g} {axis.unit}" for axis, each in zip(space.axes, mark, strict=True))
        yield f"{name}: {count:,} returns are {value} to the last digit, and no other comes so often: {CURE}"


def held_positions(name: str, places: Array, codes: Indices, of: Indices) -> Iterator[str]:
    """Yield that positions of objects are repeated until the next one comes, and then leap: nothing measured the copies.

    Of all returns: where each is (k, m), its object's code, and in which scan it is. Who stands still does not leap.
    """
    order = np.lexsort([of, codes])
    steps, whose = np.linalg.norm(np.diff(places[order], axis=0), axis=-1), codes[order]
    later = (whose[1:] == whose[:-1]) & (whose[1:] >= 0) & (np.diff(of[order]) > 0)
    moved, again = later & (steps > 0), later & (steps == 0)
    if np.sum(again) < max(LEAST, COPIED * np.sum(later)):
        return
    after, usual = steps[1:][moved[1:] & again[:-1]], steps[1:][moved[1:] & moved[:-1]]
    if min(len(after), len(usual)) >= LEAST and np.median(after) >= LEAPS * np.median(usual):
        count = f"{np.sum(again):,} of {len(codes):,}"
        told = f"{name}: {count} returns are exactly where their object was before, and then it leaps"
        yield f"{told}: if positions are held until the next one comes, keep the first row of each, with its own time"


CURE = "if that stands for what is missing, leave these cells empty"


def set_back(name: str, samples: Sequence[Sample[Any]], objects: Sequence[int] = ()) -> Iterator[str]:
    """Yield that many samples in the order of time go back to among many others in order: sorted, they look as if at once.

    Where summer time ends none may lie among others: they go back by an hour less a usual step, at a full hour, and on.

    samples: as they stand in the file; objects: of each, whose it is, if known: the file of one object may follow another's.
    """
    times = np.array([sample.time for sample in samples])
    whose = np.array(objects or [-1] * len(samples))
    leaps = np.flatnonzero(np.diff(times) < 0) + 1
    if not len(leaps):
        return
    begins, ends = np.concatenate([[0], leaps]), np.concatenate([leaps, [len(times)]])
    usual = min(float(np.median(np.diff(np.unique(times)))), PAUSE)
    for a, b, c in zip(begins.tolist(), leaps.tolist(), ends[1:].tolist(), strict=False):
        low, high = max(times[a], times[b]), min(times[b - 1], times[c - 1])
        among = [len(np.unique(part[(part >= low) & (part <= high)])) for part in (times[a:b], times[b:c])]
        back, on = times[b - 1] - times[b], np.diff(times[b - 2 : b + 2])[::2]
        summer = HOUR - 2 * usual <= back <= HOUR and times[b - 1] % HOUR >= HOUR - 2 * usual
        summer = bool(summer and min(b - a, c - b) > 1 and np.max(on) <= PAUSE)
        if (summer or min(among) >= LEAST) and len(np.intersect1d(whose[a:b], whose[b:c])):
            told = f"{samples[b].place}: {name}: times go back by {back:.6g} s and on in order"
            sorted_ = f"sorted, {among[1]:,} times lie among those before; was a clock set back? Then read the parts apart"
            yield f"{told}: {'did summer time end? Then write them in UTC' if summer else sorted_}"
            return


def set_forward(times: Sequence[float]) -> Iterator[str]:
    """Yield that an hour lacks among local times, in s, that hardly pause."""
    gaps = np.diff(np.unique(times))
    if len(gaps) < LEAST or np.partition(gaps, -2)[-2] > PAUSE:
        return
    usual, before = float(np.median(gaps)), float(np.unique(times)[np.argmax(gaps)])
    if HOUR <= np.max(gaps) <= HOUR + 2 * usual and before % HOUR >= HOUR - 2 * usual:
        yield f"times lack the hour after {before % 86_400 / HOUR:.3g} h: did summer time begin? Then write them in UTC"


def replaced(
    sensors: Mapping[str, Sensor],
    scans: Sequence[Scan],
    cure: str = "if it is there on its platform, add them to the poses",
) -> Iterator[str]:
    """Yield of each sensor that a place of its own does not count, as the poses of its scans replace it, and the `cure`."""
    for name, sensor in sensors.items():
        own = sensor
        while isinstance(inner := getattr(own, "of", None), Sensor):
            own = inner
        stated = {axis: getattr(own, axis, 0.0) for axis in ("x", "y", "heading")}
        placed = {axis: value for axis, value in stated.items() if isinstance(value, float) and value}
        pose = next((scan.pose for scan in scans if scan.sensor == name), None) if placed else None
        if pose is not None:
            by = dict(zip(("x", "y", "heading"), (*pose.position[:2].tolist(), float(pose.heading)), strict=True))
            if told := ", ".join(f"{axis} = {value:.6g}" for axis, value in placed.items() if value != by[axis]):
                yield f"sensors.{name}: {told} of its own do not count, as poses of its scans place it; {cure.format(name)}"
