"""Whether the returns of one sensor lie where the tracks of another were earlier: clocks differ, or times are of arrival."""

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
from vedette_report.detector_errors.in_tracks import scans_at, taken

MOST = 5000
"""So many scans are looked at, at most."""
LONGEST = 30.0
"""s: between returns further apart than this nothing is known of where a target is."""
PARTS = 10
"""In time, each of which is left out in turn, tell how far a lag may be wrong: errors go on from return to return."""
ENOUGH, SURE, MATTERS = 20, 6.0, 0.5
"""A lag is told by so many returns, where it is so many of its deviations, and moves a target by such a part of an error, or
more. By hand, before any scene was drawn.
"""
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


def late(tracker: Tracker, scans: Sequence[Scan], tracks: Sequence[Track]) -> Iterator[str]:
    """Yield a sentence for each pair of sensors of which one sees all targets as late, whatever their courses."""
    if len(tracker.sensors) < 2 or not {"x", "y", "vx", "vy"} <= set(tracker.state.names):
        return
    every = _seen(tracker, scans[:MOST], tracks)
    for one, other in combinations([name for name in tracker.sensors if name in every], 2):
        pairs = [(every[one][track], seen) for track, seen in every[other].items() if track in every[one]]
        pairs = [pair for pair in pairs if min(len(seen.times) for seen in pair) >= STEADY]
        lag, deviation, moved = _lag(pairs)
        if abs(lag) > SURE * deviation and moved > MATTERS:
            first, then = (one, other) if lag > 0 else (other, one)
            told = f"{then}: its returns lie where the targets of {first} were {abs(lag):.2g} +- {deviation:.1g} s earlier"
            stated = f'set kind = "displaced", lag = {abs(lag):.3g}, of = {{ ... }}'
            yield f"{told}: do their clocks agree, or are times of {then} those of arrival? To state it, {stated}"


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


def _lag(pairs: Sequence[tuple[Seen, Seen]]) -> tuple[float, float, float]:
    """Return by how much the second are later than the first, in s, its deviation, and how many of their errors that is.

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
        return 0.0, np.inf, 0.0
    squares, sums = np.swapaxes(X, -1, -2) @ X, np.einsum("nij,ni->nj", X, y)
    parts = [(squares[rows].sum(axis=0), sums[rows].sum(axis=0)) for rows in np.array_split(when, PARTS)]
    whole = [sum(each) for each in zip(*parts, strict=True)]
    if max(np.linalg.cond(whole[0] - square) for square, _ in parts) > 1e9:
        return 0.0, np.inf, 0.0
    lag = float(np.linalg.solve(*whole)[0])
    others = [float(np.linalg.solve(whole[0] - square, whole[1] - total)[0]) for square, total in parts]
    deviation = float(np.sqrt((PARTS - 1) / PARTS * np.sum((np.array(others) - np.mean(others)) ** 2)))
    return lag, deviation, float(abs(lag) * np.median(np.concatenate(moved)))
