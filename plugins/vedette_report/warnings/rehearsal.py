"""What a tracker makes of a target as its own config describes it: whether its track is begun, confirmed, and kept.

A track is kept, too, from one look of its sensor to the next, while others look elsewhere.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import takewhile

import numpy as np
from attrs import evolve

from vedette.errors import VedetteError
from vedette.supporting import ImagingSensor
from vedette.tracking import State, Tracker
from vedette.types import Detections, Scan

SCANS, PLACES = 20, 10
"""Scans in which a target is played, and returns of the recording in whose places it is."""
BETWEEN = 50
"""Scans of other sensors that are played from one look to the next, at most."""
OFTEN = 0.5
"""The probability of a loss, within SCANS, from which on it is told."""


def rehearsed(tracker: Tracker, scans: Sequence[Scan]) -> Iterator[tuple[str, str, str]]:
    """Yield what becomes of a target that gives a return in the same place in each scan, if that is nothing.

    Each is the place in the config, a sentence, and what would be better. The places are those of returns of `scans`, of
    each sensor that starts tracks, and the time from scan to scan is theirs. Where a camera's frames say whether a
    target is there, nothing is played: returns alone do not.
    """
    if any(isinstance(sensor, ImagingSensor) for sensor in tracker.sensors.values()):
        return
    for name in sorted(tracker.starters):
        chosen, dt = _chosen(name, scans)
        if not chosen:
            continue
        try:
            yield from _of_sensor(tracker, name, [_played(tracker, scan, dt, scan.detections.z[:1]) for scan in chosen], dt)
        except (VedetteError, ValueError, ArithmeticError, np.linalg.LinAlgError):
            return  # another part of the run says what is wrong


def unwatched(tracker: Tracker, scans: Sequence[Scan]) -> Iterator[tuple[str, str, str]]:
    """Yield each sensor whose tracks end before its next look, as others look elsewhere meanwhile: as `rehearsed` does."""
    if len(tracker.sensors) < 2 or any(isinstance(sensor, ImagingSensor) for sensor in tracker.sensors.values()):
        return
    looks = {name: _chosen(name, scans) for name in tracker.sensors}
    for name in sorted(tracker.starters):
        chosen, dt = looks[name]
        try:
            ends = [*takewhile(bool, (_ends(tracker, scan, dt, looks) for scan in chosen))]
        except (VedetteError, ValueError, ArithmeticError, np.linalg.LinAlgError):
            continue
        if chosen and len(ends) == len(chosen):
            said = (
                f"{name}: looks every {dt:.3g} s, and where {ends[0]} sees nothing a track of {name} ends before its next "
                f"look, by the scans of {ends[0]}"
            )
            yield "lifecycle", said, f"a max_out_of_coverage of several looks, as {5 * dt:,.0f} s"


def _ends(tracker: Tracker, scan: Scan, dt: float, looks: Mapping[str, tuple[list[Scan], float]]) -> str:
    """Return the sensor whose scans end the tracks that begin in a scan, before the next one; "" if none does."""
    again = Scan(dt, scan.sensor, Detections.of(scan.detections.z), scan.pose)
    begun = tracker.step(tracker.start(), Scan(0.0, scan.sensor, again.detections, scan.pose))
    mean = tracker.estimate(begun).mean
    if not len(begun.ids) or not np.isin(begun.ids, tracker.step(begun, again).ids).any():
        return ""
    for name, sensor in tracker.sensors.items():
        chosen, gap = looks[name]
        if name == scan.sensor or not chosen or 2 * gap > dt:
            continue
        x, placed = mean[:, tracker.state.locate(sensor.observes)], sensor.placed(chosen[0].pose)
        unseen = begun.ids[np.broadcast_to(placed.detects(x) == 0, len(x))]
        if not len(unseen):
            continue
        state, nothing = begun, Detections.of([], len(sensor.measurement))
        for time in np.linspace(0.0, dt, min(int(dt / gap), BETWEEN) + 1)[1:-1].tolist():
            state = tracker.step(state, Scan(time, name, nothing, chosen[0].pose))
        if not np.isin(unseen, state.ids).any():
            return name
    return ""


def _chosen(name: str, scans: Sequence[Scan]) -> tuple[list[Scan], float]:
    """Return some scans of a sensor that hold returns, and the time from one look to the next; none if that is unknown."""
    every = (_whole(scan) for scan in scans if scan.sensor == name and scan.frame is None)
    of_sensor = [scan for scan in every if len(scan.detections.z)]
    gaps = np.diff([scan.time for scan in scans if scan.sensor == name])
    if not of_sensor or not np.any(gaps > 0) or of_sensor[0].detections.noise is not None:
        return [], 0.0
    chosen = [of_sensor[i] for i in np.unique(np.linspace(0, len(of_sensor) - 1, PLACES).astype(int))]
    return chosen, float(np.median(gaps[gaps > 0]))


def _whole(scan: Scan) -> Scan:
    """Return a scan without returns that lack a component."""
    seen, whole = scan.detections, scan.detections.complete
    if seen.missing is None:
        return scan
    return evolve(scan, detections=Detections(seen.z[whole], seen.valid[whole], noise=seen.noise_of(whole)))


def _played(tracker: Tracker, scan: Scan, dt: float, z: np.ndarray) -> list[State]:
    """Return the states over scans that hold a return in the same place each, and nothing else."""
    states = [tracker.start()]
    for i in range(SCANS):
        states.append(tracker.step(states[-1], Scan(i * dt, scan.sensor, Detections.of(z), scan.pose)))
    return states[1:]


def _of_sensor(tracker: Tracker, name: str, plays: list[list[State]], dt: float) -> Iterator[tuple[str, str, str]]:
    """Yield what is wrong with all plays of one sensor."""
    if any(state.confirmed.any() for play in plays for state in play):
        yield from _kept(tracker, name, next(play for play in plays if play[-1].confirmed.any() or play is plays[-1]), dt)
        return
    if not any(len(state.ids) for play in plays for state in play):
        return
    weights = [
        float(np.max(play[1].hit[np.isin(play[1].ids, play[0].ids)], initial=0.0)) for play in plays if len(play[0].ids)
    ]
    if weights and max(weights) < 0.5:
        said = (
            f"{name}: of a new track's second return, exactly where the first was, at most {100 * max(weights):.2g} % is "
            "taken to be the target's: clutter and the chance of a miss outweigh it"
        )
        yield "birth", said, "births with more existence, a smaller spread of velocities, or less clutter"
        return
    most = max(float(np.max(state.existence, initial=0.0)) for play in plays for state in play)
    height = f"{most:.3g}" if most < 0.999 else f"1 - {1 - most:.2g}"
    said = (
        f"{name}: a target that gives a return in the same place in each of {SCANS} scans is not confirmed; its existence "
        f"rises to {height} at most"
    )
    yield "lifecycle", said, "a lower threshold, or births with more existence"


def _kept(tracker: Tracker, name: str, play: list[State], dt: float) -> Iterator[tuple[str, str, str]]:
    """Yield that a confirmed track ends by as many misses in a row as its target often has."""
    state, numbers = play[-1], play[-1].ids[play[-1].confirmed]
    sensor = tracker.sensors[name]
    if not len(numbers) or sensor.measurement.axes == ():
        return
    mean = tracker.estimate(state).mean[state.confirmed][:, tracker.state.locate(sensor.observes)]
    detects, nothing = float(np.mean(sensor.detects(mean))), Detections.of([], len(sensor.measurement))
    for misses in range(1, SCANS + 1):
        state = tracker.step(state, Scan(state.time + dt, name, nothing))
        if not np.isin(numbers, state.ids[state.confirmed]).any():
            often = 1.0 - math.exp(-SCANS * max(detects, 0.0) * (1.0 - detects) ** misses)
            if often > OFTEN:
                said = (
                    f"{name}: a confirmed track is lost after {misses} misses in a row, and a target that is detected with "
                    f"probability {detects:.3g} has so many within {SCANS} scans with probability {often:.2g}"
                )
                yield "lifecycle", said, "a lower threshold of ending, or a longer wait"
            return
