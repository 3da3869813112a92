"""Laws of sources that give returns: as many lie at the truth, and as near to it, as sensor and source state."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import islice

import numpy as np
from scipy.special import ndtri

from vedette.roles import Sensor
from vedette.space import Array, Indices
from vedette.supporting import Source
from vedette.testing.bands import judge_scale
from vedette.testing.comparisons import Closed, Lacking, Unlike, closed_if, demand, same
from vedette.testing.law import Law
from vedette.testing.laws.noise_units import changed
from vedette.testing.laws.source import FAR, NEAR, OPENINGS, Opened
from vedette.testing.sensors import Altered
from vedette.testing.strategies import SENSOR
from vedette.types import Detections, Recording, Scan, Trajectory

CROWDED = 1e-4
"""False returns a m^2 and scan, or more where it states more, with which its clutter is judged."""

MANY = 1000
"""Looks of a scene that are judged."""

Look = tuple[int, int, Indices, float]
"""Of a target in a scan: which scan, how many returns it has, those near the target, and how surely it is detected."""


def _near(sensor: Sensor, recording: Recording, beyond: bool = False, alone: bool = False) -> Iterator[Look]:
    """Yield for each target in each scan: which scan, how many returns, those near it, and how surely it is detected.

    `alone`: in place of that, whether it stands apart from others, who would share its returns.
    `beyond`: for each that is not there yet, or no longer, where it appears, or was last, if nobody else is there; and at
    last how many returns lie around that.
    """
    if any(_count(scan) >= 0 and scan.pose is not None for scan in recording.scans):
        raise Closed("its sensor is on a moving platform")
    paths = [path for path in recording.truth if all(axis in path.space for axis in sensor.observes.names)]
    if beyond:  # others say where a target is now and then, not when it is there
        within = [[scan.time for scan in recording.scans if path.at(scan.time) is not None] for path in paths]
        paths = [path for path, times in zip(paths, within, strict=True) if times and np.all(np.isin(times, path.times))]
    for number, scan in enumerate(recording.scans):
        z = scan.detections.z[scan.detections.valid]
        states = [path.at(scan.time) for path in paths]
        there = [path.space.locate(sensor.observes) for path in paths]
        seen = [sensor.measure(state[own]) for state, own in zip(states, there, strict=True) if state is not None]
        for path, state, own in zip(paths, states, there, strict=True):
            if beyond:
                state = None if state is not None else path.states[0 if scan.time < path.times[0] else -1]
            if state is None:
                continue
            x = state[own]
            root = np.linalg.cholesky(np.broadcast_to(sensor.noise(x), (z.shape[-1],) * 2))
            others = _apart(sensor, root, np.reshape(seen, (-1, len(root))), x)
            if beyond and np.any(others < FAR):
                continue
            apart = _apart(sensor, root, z, x)
            lone = np.sum(others < FAR) == 1 if alone else sensor.detects(x)
            last = np.sum((apart >= NEAR) & (apart < FAR)) if beyond else lone
            yield number, len(z), np.flatnonzero(apart < NEAR), float(last)


def _count(scan: Scan) -> int:
    closed_if(scan.frame is not None, Unlike("its scans are pictures"))
    return len(scan.detections.z)


def _apart(sensor: Sensor, root: Array, z: Array, x: Array) -> Array:
    """Return how far returns (k, m) are from that of a target at x, squared, in deviations of the root of its noise."""
    return np.asarray(np.sum(np.linalg.solve(root, sensor.measurement.difference(z, sensor.measure(x)).T) ** 2, axis=0))


def returns_are_of_the_truth(source: Source, drawn: Opened) -> None:
    """If it has truth: over a few openings, returns lie around it as often as the sensor detects.

    A source may have a sensor of its own for the scene, in `sensors`: then as often as that one detects.
    """
    sensor = _own(source, drawn.sensor)
    _are_hit([look for k in range(6) for look in _near(sensor, drawn.again(k).open(source))])


def _own(source: Source, sensor: Sensor) -> Sensor:
    own = getattr(source, "sensors", None)
    return own.get(SENSOR, sensor) if isinstance(own, Mapping) else sensor


def _are_hit(looks: list[Look]) -> None:
    hits, chances = sum(len(near) > 0 for _, _, near, _ in looks), sum(chance for *_, chance in looks)
    closed_if(chances < 20, "it has too little truth for that")
    demand(hits > 0.8 * chances - 3 * np.sqrt(chances), f"returns: {hits} lie at the truth, {chances:.0f} should")


def nobody_is_seen_before_or_after(source: Source, drawn: Opened) -> None:
    """If it draws, and its truth comes and goes: before and after, no returns lie where a target appears, or was last."""
    closed_if(not source.draws or getattr(source, "sensors", None), "it draws nothing, or its scene has a sensor of its own")
    sensor = Altered(drawn.plain, 1.0, 0.0)
    scenes = (drawn.again(k, sensor).open(source) for k in range(6))
    looks = [(len(near) > 0, around) for scene in scenes for *_, near, around in _near(sensor, scene, beyond=True)]
    closed_if(len(looks) < 6 or any(around for _, around in looks), "its targets are there all the time, or in clutter")
    seen = sum(hit for hit, _ in looks)
    demand(seen < 0.8 * len(looks), f"returns: in {seen} of {len(looks)} looks lie at a target that is not there")


def scatters_as_stated(source: Source, drawn: Opened) -> None:
    """If it draws, with `sigma` in m: returns err by that in x and y, and by `extent` times a hull's length and width.

    If it has `clutter` in 1/m^2: so dense are false returns in the middle of where they lie.
    """
    if getattr(source, "clutter", 0.0):  # so dense that there are some, whatever the region
        source = changed(source, {"clutter": max(source.clutter, CROWDED)}) or source  # type: ignore[attr-defined]
    sigma, extent, density = (getattr(source, name, 0.0) for name in ("sigma", "extent", "clutter"))
    closed_if(not source.draws or hasattr(source, "level"), Unlike("it draws nothing, or pictures"))
    closed_if(not isinstance(sigma, float) or not sigma, Lacking("sigma", "it has no `sigma` in m"))
    squares, false, looks, there = [], [], 0, 0.0
    for k in range(OPENINGS):
        recording = drawn.again(k, drawn.plain).open(source)
        for scan in recording.scans:
            z, free, looks = scan.detections.z, np.ones(_count(scan), dtype=bool), looks + 1
            for path in recording.truth:
                named = dict(zip(path.space.names, () if (state := path.at(scan.time)) is None else state, strict=False))
                if not {"x", "y", *(("heading", "length", "width") if extent else ())} <= set(named):
                    continue
                off, to = z - [named["x"], named["y"]], named.get("heading", 0.0)
                turned = off @ [[np.cos(to), -np.sin(to)], [np.sin(to), np.cos(to)]]
                spread = np.hypot(sigma, extent * np.array([named.get("length", 0.0), named.get("width", 0.0)]))
                near = np.sum((turned / spread) ** 2, axis=-1) < NEAR
                free &= ~near
                there += getattr(source, "detection_probability", 0.0)
                squares += [(turned[near] / spread) ** 2] if near.sum() == 1 else []
            false.append(z[free])
    demand(len(squares) > 0.5 * there - 20.0, f"returns: {len(squares)} err as stated, {there:.3g} targets are detected")
    closed_if(len(squares) < 40, "it has too little truth for that")
    for i, axis in enumerate(("along", "across") if extent else ("x", "y")):
        judge_scale(f"errors {axis}, of returns", np.array(squares)[:, 0, i], 1.0, drawn.alpha / 3)
    rest = np.concatenate(false)
    demand(len(rest) or density < CROWDED, f"returns: none is false in {looks} scans, with {density:g} a m^2")
    if density and len(rest) > 200:
        away = np.linalg.norm(rest - rest.mean(axis=0), axis=-1)
        found, wanted = np.sum(away < away.max() / 2), density * np.pi * (away.max() / 2) ** 2 * looks
        demand(abs(found - wanted) < 7.0 * np.sqrt(wanted), f"returns: {found} are false, must be {wanted:.3g} by `clutter`")


def drawn_together_as_alone(source: Source, drawn: Opened) -> None:
    """If it has `open_together`: runs in lock-step have the times of one drawn alone, and returns at their own states."""
    if not hasattr(source, "open_together"):
        raise Unlike("it has no `open_together`")
    sensor, alone = _own(source, drawn.plain), drawn.again(0, drawn.plain).open(source)
    scenes = source.open_together({SENSOR: drawn.plain}, [np.random.default_rng([drawn.seed, run]) for run in range(6)])
    if scenes is None or any(scan.pose is not None for scan in alone.scans):
        raise Closed("it draws no such scene in lock-step, or on a moving platform")
    times = np.array([scan.time for scan in scenes.scans])
    same("times in lock-step", times, np.array([scan.time for scan in alone.scans]), 1e-9)
    there = [path.times[0] <= times.min() and times.max() <= path.times[-1] for path in alone.truth]
    demand(all(there), "open_together: draws a target in lock-step at times when, drawn alone, it is not there")
    looks: list[Look] = []
    for run, states in enumerate(scenes.states):
        seen = [scan.detections.z[run][scan.detections.valid[run]] for scan in scenes.scans]
        scans = [Scan(time, SENSOR, Detections.of(z, z.shape[-1])) for time, z in zip(times.tolist(), seen, strict=True)]
        looks += _near(sensor, Recording(tuple(scans), (Trajectory(f"of run {run}", scenes.space, times, states),)))
    _are_hit(looks)


def targets_are_missed_as_stated(source: Source, drawn: Opened) -> None:
    """If it draws and has truth: of a sensor that detects half, half are seen, and returns come in no order of targets."""
    if SENSOR in (getattr(source, "sensors", None) or ()) or hasattr(source, "detection_probability"):
        raise Closed("its scene has a sensor of its own")
    sensor = Altered(drawn.plain, 0.5, 0.0)
    asked, seen, looks, first, both = 0, 0, 0, 0, 0
    for k in range(drawn.scans):
        by_scan: dict[int, list[int]] = {}
        for scan, count, near, apart in islice(_near(sensor, drawn.again(k, sensor).open(source), alone=True), MANY):
            asked, seen, looks = asked + 1, seen + int(apart and len(near) > 0), looks + int(apart)
            if count == 2 and len(near) == 1:
                by_scan.setdefault(scan, []).append(int(near[0]))
        firsts = [rows[0] for rows in by_scan.values() if sorted(rows) == [0, 1]]
        first, both = first + firsts.count(0), both + len(firsts)
        if (looks > 300 and (both > 100 or not both)) or asked > 10 * MANY:
            break
    closed_if(looks < 50, "it has too little truth for that")
    reach = -ndtri(drawn.alpha / 4)
    told = f"returns: targets are seen {seen} times in {looks} looks of a sensor that detects half"
    demand(abs(seen - looks / 2) < reach * np.sqrt(looks) / 2 + 0.02 * looks, told)
    fair = both < 30 or abs(first - both / 2) < reach * np.sqrt(both) / 2
    demand(fair, f"returns: that of the first target stands first in {first} of {both} scans with both")


def order_of_returns_tells_nothing(source: Source, drawn: Opened) -> None:
    """If it draws and has truth: where a return stands in its scan does not tell whether it is the target's."""
    places: list[float] = []
    variance = 0.0
    for k, density in enumerate(np.append(1e-8 * 4.0 ** np.arange(12), 0.0)):
        sensor = Altered(drawn.plain, 0.9, float(density))
        counts = [_count(scan) for scan in drawn.again(k, sensor).open(source).scans]
        if counts and np.mean(counts) > 3:
            break
    else:
        raise Closed("it draws no false returns")
    enough = drawn.scans // 4
    for k in range(enough):
        for _, count, near, _ in _near(sensor, drawn.again(k, sensor).open(source)):
            if count > 1 and len(near) == 1:
                places.append(near[0] - (count - 1) / 2)
                variance += (count**2 - 1) / 12
        if len(places) > enough:
            break
    closed_if(len(places) < 40, "it has too little truth for that")
    off = float(np.sum(places) / np.sqrt(variance))
    where = "before" if off < 0 else "behind"
    told = f"returns: targets' stand {where} false ones, by {abs(off):.1f} standard errors"
    demand(abs(off) < -ndtri(drawn.alpha / 2), told)


LAWS: tuple[Law, ...] = (
    Law(returns_are_of_the_truth, share=2),
    Law(nobody_is_seen_before_or_after, share=2),
    Law(drawn_together_as_alone),
    Law(scatters_as_stated, effort="statistical"),
    Law(targets_are_missed_as_stated, needs="draws", effort="statistical"),
    Law(order_of_returns_tells_nothing, needs="draws", effort="statistical"),
)
