"""What a tracker makes of a target as its own config describes it: whether its track is begun, confirmed, and kept."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from attrs import evolve

from vedette import Detections, ImagingSensor, Scan, Sensor, Tracker, VedetteError
from vedette.tracking import State

SCANS, PLACES = 20, 10
"""Scans in which a target is played, and returns of the recording in whose places it is."""
SURE, MORE = 0.98, 1.1
"""P_D from which on a sensor is stated to detect all; its scans hold some names only, where there are so many times more."""
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


def silenced(tracker: Tracker, scans: Sequence[Scan]) -> Iterator[tuple[str, str, str]]:
    """Yield each sensor of named reports, as AIS, that is stated to hear all targets, so that its silence ends tracks.

    Told as `rehearsed` tells it, where other sensors start tracks, too, or its scans hold some of its names only.
    """
    if tracker.lifecycle.certain or any(isinstance(sensor, ImagingSensor) for sensor in tracker.sensors.values()):
        return
    for name, sensor in tracker.sensors.items():
        own = [scan for scan in scans if scan.sensor == name and scan.frame is None]
        seen = [(scan.detections.identity, scan.detections.valid) for scan in own]
        codes = [np.unique(names[valid]) for names, valid in seen if names is not None]
        some = len(np.unique(np.concatenate(codes))) > MORE * np.mean([len(one) for one in codes]) if codes else False
        others = sorted(tracker.starters - {name}) or ([name] if some else [])
        for other in others if codes else ():
            chosen, dt = _chosen(other, scans)
            try:
                plays = [_played(tracker, scan, dt, scan.detections.z[:1])[-1] for scan in chosen[:1]]
                ended = [_silent(tracker, state, sensor.placed(own[0].pose), own[0]) for state in plays]
            except (VedetteError, ValueError, ArithmeticError, np.linalg.LinAlgError):
                continue
            if ended and ended[0]:
                said = (
                    f"{name}: is stated to detect all targets: of one that {other} sees, confirmed by {SCANS} returns, "
                    f"{ended[0]} of its scans without a report end the track"
                )
                yield f"sensors.{name}", said, "a detection_probability that is the part of targets that it has in a scan"
                break


def _silent(tracker: Tracker, state: State, sensor: Sensor, scan: Scan) -> int:
    """Return how many scans without returns, of a sensor that should surely detect it, end a confirmed track; 0: none do."""
    numbers, nothing = state.ids[state.confirmed], Detections.of([], len(sensor.measurement))
    x = tracker.estimate(state).mean[state.confirmed][:, tracker.state.locate(sensor.observes)]
    if not len(numbers) or np.min(np.broadcast_to(sensor.detects(x), len(x))) < SURE:
        return 0
    for count in range(1, SCANS + 1):
        state = tracker.step(state, Scan(state.time, scan.sensor, nothing, scan.pose))
        if not np.isin(numbers, state.ids[state.confirmed]).any():
            return count
    return 0


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
