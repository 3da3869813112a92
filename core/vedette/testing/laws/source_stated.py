"""Laws of sources whose parts state, by name and unit, when scans come, when targets are there, and how bright they are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import attrs
import numpy as np

from vedette.supporting import Source
from vedette.testing.comparisons import Lacking, closed_if, demand, same
from vedette.testing.law import Law
from vedette.testing.laws.source import Opened
from vedette.testing.laws.source_pictures import BESIDE, distance, pictured
from vedette.testing.strategies import SENSOR


def within(part: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """Yield a part and all that it is made of, each with the name that a table gives to it or to what holds it."""
    yield name, part
    for field in attrs.fields(type(part)):
        held = getattr(part, field.name)
        several = held if isinstance(held, tuple) else (held,)
        for key, each in held.items() if isinstance(held, Mapping) else [(name, each) for each in several]:
            if attrs.has(type(each)):
                yield from within(each, key)


def scans_come_when_stated(source: Source, drawn: Opened) -> None:
    """If it, or its look, has an `interval`: scans are whole intervals apart, early or late by up to its `jitter`."""
    look = looks.get(SENSOR, source) if isinstance(looks := getattr(source, "looks", None), Mapping) else source
    interval, jitter = getattr(look, "interval", None), getattr(look, "jitter", 0.0)
    if not isinstance(interval, float | int):
        raise Lacking("interval")
    times = np.array([scan.time for scan in drawn.open(source).scans])
    first = getattr(look, "first", None)
    late = np.asarray(times - (times[:1] if first is None else first)) / interval
    late = np.abs(late - np.rint(late)) * interval
    most = float(np.max(late, initial=0.0))
    said = f"scans: come early or late by up to {most:.6g} s, `jitter` is {jitter:g} s and `interval` {interval:g} s"
    demand(most <= jitter + 1e-6 * interval and (len(times) < 12 or most >= jitter / 5), said)


def truth_comes_and_goes_as_stated(source: Source, drawn: Opened) -> None:
    """If a target `appears` and `disappears`: its truth is there from then on until then, as scans are.

    If it has a `start` [x, y], too, and a `course` and `speed`: its truth begins there, and so.
    """
    recording, stated = drawn.open(source), {name: one for name, one in within(source) if hasattr(one, "disappears")}
    paths = [path for path in recording.truth if path.name in stated]
    closed_if(not paths, "no target of its truth says when it appears and disappears")
    for path in paths:
        one, known = stated[path.name], f"its truth is from {path.times[0]:g} to {path.times[-1]:g} s"
        begin, end = getattr(one, "appears", -np.inf), np.inf if one.disappears is None else one.disappears
        inside = begin <= path.times[0] and path.times[-1] <= end
        seen = all(path.at(scan.time) is not None for scan in recording.scans if begin <= scan.time <= end)
        demand(inside and seen, f"{path.name}: is there from {begin:g} to {end:g} s, {known}")
        if path.times[0] == begin and hasattr(one, "course") and {"x", "y", "vx", "vy"} <= set(path.space.names):
            way = one.speed * np.array([np.cos(one.course), np.sin(one.course)])
            first = path.states[0, [path.space.names.index(name) for name in ("x", "y", "vx", "vy")]]
            same(f"{path.name}: x, y, vx, vy where it starts", first, np.array([*one.start, *way]), 1e-9)


def targets_are_as_bright_as_stated(source: Source, drawn: Opened) -> None:
    """If spots have a `peak` and a `spread` in px: by so much, 2 pi peak spread^2, a target is brighter than the `level`."""
    spots = [one for _, one in within(source) if hasattr(one, "peak") and hasattr(one, "spread")]
    total = 2.0 * np.pi * sum(one.peak * one.spread**2 for one in spots)
    area = np.pi * BESIDE**2
    noise = area * getattr(source, "clutter", 0.0) + np.sqrt(area) * getattr(source, "sigma", 0.0)
    if not spots or noise > 0.25 * abs(total) or any(np.hypot(one.x, one.y) + 3.0 * one.spread > BESIDE for one in spots):
        raise Lacking("peak", "it has no spots with a `peak`, or they are wide, or lost in noise")
    found = []
    for _, pixels, targets in pictured(drawn.open(source)):
        near = [distance(pixels, target) < BESIDE for target in targets]
        if len(near) == 1 and area < near[0].sum() + BESIDE and np.all(np.isfinite(pixels[near[0]])):
            found.append(np.sum(pixels[near[0]] - source.level))  # type: ignore[attr-defined]
    closed_if(not found, "no single target is wholly in its pictures")
    ratio = float(np.median(found)) / total
    demand(0.6 < ratio < 1.6, f"frame: a target is {ratio:.3g} times as bright as its spots state by `peak` and `spread`")


LAWS = tuple(
    Law(law, share=2) for law in (scans_come_when_stated, truth_comes_and_goes_as_stated, targets_are_as_bright_as_stated)
)
