"""Whether the returns of one sensor lie beside those of another, or where their targets were earlier.

Clocks differ, or times are those of arrival; or a place or a direction is given wrongly.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations

import numpy as np
from attrs import frozen

from vedette.roles import Sensor
from vedette.space import Array
from vedette.tracking import Tracker
from vedette.types import Gaussian, Scan, Track
from vedette_report.detector_errors.in_tracks import first_of, scans_at, taken

LONGEST = 30.0
"""s: between returns further apart than this nothing is known of where a target is."""
PARTS = 10
"""In time, each of which is left out in turn, tell how far a lag may be wrong: errors go on from return to return."""
ENOUGH, SURE, MATTERS = 20, 6.0, 0.5
"""A lag is told by so many returns, where it is so many of its deviations, and moves a target by such a part of an error, or
more. By hand, before any scene was drawn.
"""
BESIDE = 1.0
"""An offset is told where it is so many errors or more. By hand."""
STEADY = 10
"""A track of fewer returns of a sensor tells nothing: its velocity is that of these returns, so that they lie along it. Set
by hand on dense clutter, whose short tracks told .5 to .7 s that were not there.
"""


@frozen(eq=False)
class Seen:
    """What a track took of one sensor: places (s, 2) with covariances (s, 2, 2), times (s,), velocities (s, 2) there."""

    times: Array
    places: Array
    covs: Array
    velocities: Array


@frozen(eq=False)
class Shift:
    """By how much returns are late, in s, and lie beside others (2,), in m; the deviations (3,), and both in errors."""

    lag: float
    offset: Array
    deviations: Array
    moved: float
    beside: float


def late(tracker: Tracker, scans: Sequence[Scan], tracks: Sequence[Track]) -> Iterator[str]:
    """Yield a sentence for each pair of sensors of which one sees all targets late, or beside where the other does."""
    if len(tracker.sensors) < 2 or not {"x", "y", "vx", "vy"} <= set(tracker.state.names):
        return
    every = _seen(tracker, first_of(scans), tracks)
    for one, other in combinations([name for name in tracker.sensors if name in every], 2):
        pairs = [(every[one][track], seen) for track, seen in every[other].items() if track in every[one]]
        found = _shift([pair for pair in pairs if min(len(seen.times) for seen in pair) >= STEADY])
        if found is None:
            continue
        estimated = any(axis.unit == "s" for name in (one, other) for axis in tracker.sensors[name].observes.axes)
        if abs(found.lag) > SURE * found.deviations[0] and found.moved > MATTERS and not estimated:
            first, then = (one, other) if found.lag > 0 else (other, one)
            lag = abs(found.lag)
            told = (
                f"{then}: its returns lie where the targets of {first} were {lag:.2g} +- {found.deviations[0]:.1g} s earlier"
            )
            stated = f'set kind = "displaced", lag = {lag:.3g}, of = {{ ... }}'
            yield f"{told}: do their clocks agree, or are times of {then} those of arrival? To state it, {stated}"
        length, deviation = np.hypot(*found.offset), np.hypot(*found.deviations[1:])
        if length > SURE * deviation and found.beside > BESIDE and not tracker.registration.offsets:
            x, y = found.offset
            told = f"{other}: its returns lie {length:.2g} +- {deviation:.1g} m beside those of {one}"
            stated = f'set kind = "displaced", offset = {{ x = {x:.3g}, y = {y:.3g} }}, of = {{ ... }}'
            found_by = "or the tracks find it: `biased` and [registration], docs/concepts/registration.md"
            yield f"{told}: are both placed and turned right? To state it of {other}, {stated}; {found_by}"


def _seen(tracker: Tracker, scans: Sequence[Scan], tracks: Sequence[Track]) -> Mapping[str, Mapping[int, Seen]]:
    """Return by sensor and track what it took, of sensors whose returns tell a place."""
    at, told = scans_at(scans), defaultdict[str, dict[int, list[list[Array]]]](dict)
    placed: dict[int, Gaussian | None] = {}
    pace = [tracker.state.names.index(axis) for axis in ("vx", "vy")]
    for track in tracks:
        for row, i, column in taken(track, at):
            if track.confirmed[row]:
                if i not in placed:
                    placed[i] = _placed(tracker.sensors[scans[i].sensor], scans[i])
                if (place := placed[i]) is not None:
                    own = scans[i].detections.time
                    time = scans[i].time if own is None else float(own[column])
                    entry = [np.array(time), place.mean[column], place.cov[column], track.mean[row, pace]]
                    told[scans[i].sensor].setdefault(track.id, []).append(entry)
    return {
        name: {track: Seen(*map(np.array, zip(*rows, strict=True))) for track, rows in of.items()}
        for name, of in told.items()
    }


def _placed(sensor: Sensor, scan: Scan) -> Gaussian | None:
    """Return where a scan's returns lie in the plane; None if they do not tell."""
    seen = scan.detections
    if scan.frame is not None or seen.missing is not None or not {"x", "y"} <= set(sensor.observes.names):
        return None
    try:
        found = sensor.placed(scan.pose).invert(seen.z, seen.noise)
    except (NotImplementedError, ValueError):
        return None
    where = [sensor.observes.names.index(axis) for axis in "xy"]
    return Gaussian(found.mean[:, where], found.cov[:, where][:, :, where])


def _shift(pairs: Sequence[tuple[Seen, Seen]]) -> Shift | None:
    """Return by how much the second are later than the first, and lie beside them; None where that is not known.

    A return that is late by l lies at d = o - l v from where the target is, with an offset o that is the same for all.
    """
    A, d = list[Array]([np.zeros((0, 2, 3))]), list[Array]([np.zeros((0, 2))])
    times, moved = list[Array]([np.zeros(0)]), list[Array]([np.zeros(0)])
    for first, then in pairs:
        after = np.clip(np.searchsorted(first.times, then.times), 1, max(len(first.times) - 1, 1))
        if len(first.times) < 2:
            continue
        wait = first.times[after] - first.times[after - 1]
        part = (then.times - first.times[after - 1]) / np.maximum(wait, 1e-12)
        good = (wait <= LONGEST) & (part >= 0) & (part <= 1)
        w, late = part[good, None], then.velocities[good]
        there = (1 - w) * first.places[after - 1][good] + w * first.places[after][good]
        w = w[..., None]
        cov = then.covs[good] + (1 - w) ** 2 * first.covs[after - 1][good] + w**2 * first.covs[after][good]
        root = np.linalg.inv(np.linalg.cholesky(cov))
        A.append(root @ np.concatenate([-late[..., None], np.broadcast_to(np.eye(2), cov.shape)], axis=-1))
        d.append((root @ (then.places[good] - there)[..., None])[..., 0])
        times.append(then.times[good])
        moved.append(np.linalg.norm(root @ late[..., None], axis=(-1, -2)))
    X, y, when = np.concatenate(A), np.concatenate(d), np.argsort(np.concatenate(times), kind="stable")
    if len(y) < ENOUGH:
        return None
    squares, sums = np.swapaxes(X, -1, -2) @ X, np.einsum("nij,ni->nj", X, y)
    parts = [(squares[rows].sum(axis=0), sums[rows].sum(axis=0)) for rows in np.array_split(when, PARTS)]
    whole = [sum(each) for each in zip(*parts, strict=True)]
    if max(np.linalg.cond(whole[0] - square) for square, _ in parts) > 1e9:
        return None
    lag, *offset = np.linalg.solve(*whole)
    others = np.array([np.linalg.solve(whole[0] - square, whole[1] - total) for square, total in parts])
    deviations = np.sqrt((PARTS - 1) * np.var(others, axis=0))
    beside = np.median(np.linalg.norm(X[..., 1:] @ np.array(offset), axis=-1))
    return Shift(lag, np.array(offset), deviations, float(abs(lag) * np.median(np.concatenate(moved))), float(beside))
