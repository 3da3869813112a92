"""Whether the returns of one sensor lie beside those of another, or where their targets were earlier.

Clocks differ, or times are those of arrival; or a place or a direction is given wrongly.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import combinations

import numpy as np
from attrs import frozen

from vedette import Array, Gaussian, Scan, Sensor, Track, Tracker, kernels
from vedette_report.detector_errors.in_tracks import first_of, placed_in_plane, scans_at, taken
from vedette_standard import stands

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
ALIKE = 10.0
"""A lag is told from an offset where velocities spread by so many times what their own covariances make of it. By hand, on
aircraft of one airway, where less told seconds that were not there.
"""
CONTRADICT = 3.0
"""Pairs of sensors whose sums differ by so many deviations are off by no constant lag and offset. By hand."""
TRACKS = "`biased` and [registration], docs/concepts/registration.md"
STEADY = 10
"""A track of fewer returns of a sensor tells nothing: its velocity is that of these returns, so that they lie along it. Set
by hand on dense clutter, whose short tracks told .5 to .7 s that were not there.
"""


@frozen(eq=False)
class Seen:
    """What a track took of one sensor: places (s, 2) with covariances (s, 2, 2), times (s,), the track's velocities (s, 2)
    there with theirs `unsure` (s, 2, 2), and their covariances with its places `tied` (s, 2, 2).
    """

    times: Array
    places: Array
    covs: Array
    velocities: Array
    unsure: Array
    tied: Array


@frozen(eq=False)
class Shift:
    """By how much returns are late, in s, and beside others, in m (3,); deviations (3,); in errors, a s and a m (2,).

    doubt (3,): by how much the deviations are too small, as other pairs of sensors tell it. common: the velocity (2,) that
    all targets have, where theirs are too alike to tell a lag from an offset: the offset then is both.
    """

    values: Array
    deviations: Array
    errors: Array
    doubt: Array
    common: Array | None = None

    @property
    def tells(self) -> tuple[bool, bool]:
        """Whether a lag and an offset are sure, and matter."""
        (lag, *offset), sizes = self.values, self.errors
        length = np.hypot(*offset)
        late = abs(lag) > SURE * self.deviations[0] and abs(lag) * sizes[0] > MATTERS
        return bool(late), bool(length > SURE * np.hypot(*self.deviations[1:]) and length * sizes[1] > BESIDE)


def late(tracker: Tracker, scans: Sequence[Scan], tracks: Sequence[Track], turned: Collection[str] = ()) -> Iterator[str]:
    """Yield a sentence for each sensor that sees all targets late, or beside where the others do.

    All are held against one of them. turned: sensors of which it is known that they are turned, which makes both.
    """
    if len(tracker.sensors) < 2 or not {"x", "y", "vx", "vy"} <= set(tracker.state.names):
        return
    every = _seen(tracker, first_of(scans), tracks)
    shifts = dict[tuple[str, str], Shift]()
    for one, other in combinations([name for name in tracker.sensors if name in every and name not in turned], 2):
        pairs = [(every[one][track], seen) for track, seen in every[other].items() if track in every[one]]
        if found := _shift([pair for pair in pairs if min(len(seen.times) for seen in pair) >= STEADY]):
            shifts[one, other] = found
    apart = {pair: shift for pair, shift in shifts.items() if shift.common is None}
    groups = _linked(apart)
    for own in (apart, {pair: shifts[pair] for pair in shifts if not any({*pair} <= {*group} for group in groups)}):
        for group in _linked(own):
            yield from _told(tracker, group, {pair: shift for pair, shift in own.items() if pair[0] in group})


def _linked(pairs: Collection[tuple[str, str]]) -> list[list[str]]:
    """Return the names that pairs link, directly or by others."""
    names = list(dict.fromkeys(name for pair in pairs for name in pair))
    i, j = (np.array([*range(len(names)), *(names.index(pair[k]) for pair in pairs)], dtype=np.intp) for k in (0, 1))
    label = kernels.linked_clusters(i, j, len(names), len(names))[: len(names)].tolist()
    return [[name for name, of in zip(names, label, strict=True) if of == own] for own in dict.fromkeys(label)]


def _told(tracker: Tracker, names: Sequence[str], shifts: Mapping[tuple[str, str], Shift]) -> Iterator[str]:
    """Yield a sentence for each sensor that differs from the one by which the fewest do."""
    against = {first: _against(first, names, shifts) for first in names}

    def wrong(first: str) -> tuple[int, bool, float]:
        told = [shift for shift in against[first].values() if any(shift.tells)]
        beside = any(shift.tells[1] for shift in told)
        early = sum(max(-shift.values[0], 0.0) for shift in told if shift.tells[0])
        return len(told), beside and not _places(tracker.sensors[first]), early

    first = min(names, key=wrong)
    for name, shift in against[first].items():
        estimated = any(axis.unit == "s" for one in (first, name) for axis in tracker.sensors[one].observes.axes)
        is_late, beside = shift.tells
        is_late, beside = is_late and not estimated, beside and not tracker.registration.offsets
        (lag, x, y), (deviation, *wide) = shift.values, shift.deviations * shift.doubt
        told, asked, stated, found_by = list[str](), list[str](), list[str](), ""
        if is_late:
            when = "earlier" if lag > 0 else "later"
            told.append(f"where the targets of {first} were {abs(lag):.2g} +- {deviation:.1g} s {when}")
            asked.append(f"do their clocks agree, or are times of {name} those of arrival?")
            stated.append(f"lag = {lag:.3g}")
        if beside:
            told.append(f"{np.hypot(x, y):.2g} +- {np.hypot(*wide):.1g} m beside those of {first}")
            asked.append("are both placed and turned right?")
            stated.append(f"offset = {{ x = {x:.3g}, y = {y:.3g} }}")
            found_by = f"; or the tracks find it: {TRACKS}"
        if beside and shift.common is not None:
            same = -float(shift.values[1:] @ shift.common) / max(float(shift.common @ shift.common), 1e-12)
            when = "earlier" if same > 0 else "later"
            told[-1] += f", or where they were {abs(same):.2g} s {when}, which targets of one velocity do not tell apart"
            stated[-1] = f"lag = {same:.3g} or {stated[-1]}"
        cure = f'To state it of {name}, set kind = "displaced", {", ".join(stated)}, of = {{ ... }}{found_by}'
        if np.any(shift.doubt > CONTRADICT):
            cure = f"Pairs of sensors disagree on it, as where ranges or bearings are off: let the tracks find it, {TRACKS}"
        if told:
            yield f"{name}: its returns lie {', and '.join(told)}: {' '.join(asked)} {cure}"


def _places(sensor: Sensor) -> bool:
    """Return whether it tells places themselves, as reports do, and not what is seen from where it stands."""
    pose = stands(sensor)
    turned = pose is not None and (np.any(pose.position) or bool(pose.heading))
    return {"x", "y"} <= set(sensor.measurement.names) and not turned


def _against(first: str, names: Sequence[str], shifts: Mapping[tuple[str, str], Shift]) -> dict[str, Shift]:
    """Return how each other sensor is shifted against the first, by least squares of what all pairs tell."""
    others = [name for name in names if name != first]
    A = np.array([[(name == other) - (name == one) for name in others] for one, other in shifts], dtype=float)
    d, sigma = (np.array([getattr(shift, name) for shift in shifts.values()]) for name in ("values", "deviations"))
    (values, deviations), doubt = np.zeros((2, len(others), 3)), np.ones(3)
    for k in range(3):
        W = A / sigma[:, k, None]
        cov = np.linalg.inv(W.T @ W)
        values[:, k] = cov @ W.T @ (d[:, k] / sigma[:, k])
        off = np.sum(((d[:, k] - A @ values[:, k]) / sigma[:, k]) ** 2) / max(len(A) - len(others), 1)
        deviations[:, k], doubt[k] = np.sqrt(np.diag(cov)), max(np.sqrt(off), 1.0)
    near = [max((pair for pair in shifts if name in pair), key=lambda pair: first in pair) for name in others]
    return {
        name: Shift(values[i], deviations[i], shifts[pair].errors, doubt, shifts[pair].common)
        for i, (name, pair) in enumerate(zip(others, near, strict=True))
    }


def _seen(tracker: Tracker, scans: Sequence[Scan], tracks: Sequence[Track]) -> Mapping[str, Mapping[int, Seen]]:
    """Return by sensor and track what it took, of sensors whose returns tell a place."""
    at, told = scans_at(scans), defaultdict[str, dict[int, list[list[Array]]]](dict)
    placed: dict[int, Gaussian | None] = {}
    spot, pace = ([tracker.state.names.index(axis) for axis in axes] for axes in (("x", "y"), ("vx", "vy")))
    for track in tracks:
        for row, i, column in taken(track, at):
            if track.confirmed[row]:
                if i not in placed:
                    placed[i] = placed_in_plane(tracker.sensors[scans[i].sensor], scans[i])
                if (place := placed[i]) is not None:
                    own = scans[i].detections.time
                    time = scans[i].time if own is None else float(own[column])
                    entry = [np.array(time), place.mean[column], place.cov[column], track.mean[row, pace]]
                    entry += [track.cov[row][np.ix_(pace, pace)], track.cov[row][np.ix_(pace, spot)]]
                    told[scans[i].sensor].setdefault(track.id, []).append(entry)
    return {
        name: {track: Seen(*map(np.array, zip(*rows, strict=True))) for track, rows in of.items()}
        for name, of in told.items()
    }


def _shift(pairs: Sequence[tuple[Seen, Seen]]) -> Shift | None:
    """Return by how much the second are later than the first, and lie beside them; None where that is not known.

    A return that is late by l lies at d = o - l v from where the target is, with an offset o that is the same for all. The
    errors of v spread the velocities, and go with those of d, for the track took the return: what they add is taken out.
    """
    A, d = list[Array]([np.zeros((0, 2, 3))]), list[Array]([np.zeros((0, 2))])
    times, moved = list[Array]([np.zeros(0)]), list[Array]([np.zeros(0)])
    added, paces = list[Array]([np.zeros((0, 2))]), list[Array]([np.zeros((0, 2))])
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
        W = np.swapaxes(root, -1, -2) @ root
        added.append(np.stack([np.einsum("nij,nji->n", W, one[good]) for one in (then.unsure, then.tied)], axis=-1))
        paces.append(late)
    X, y, when = np.concatenate(A), np.concatenate(d), np.argsort(np.concatenate(times), kind="stable")
    if len(y) < ENOUGH:
        return None
    squares, sums, more = np.swapaxes(X, -1, -2) @ X, np.einsum("nij,ni->nj", X, y), np.concatenate(added)
    whole = np.sum(squares, axis=0)
    spread = whole[0, 0] - whole[0, 1:] @ np.linalg.solve(whole[1:, 1:], whole[1:, 0])
    alike = bool(spread < ALIKE * np.sum(more[:, 0]))
    squares[:, 0, 0] -= more[:, 0]
    sums[:, 0] += more[:, 1]
    some = slice(1, 3) if alike else slice(0, 3)
    parts = [(squares[rows].sum(axis=0)[some, some], sums[rows].sum(axis=0)[some]) for rows in np.array_split(when, PARTS)]
    A, b = (np.sum(each, axis=0) for each in zip(*parts, strict=True))
    if max(np.linalg.cond(A - square) for square, _ in parts) > 1e9:
        return None
    values, deviations = np.zeros(3), np.zeros(3)
    values[some] = np.linalg.solve(A, b)
    others = np.array([np.linalg.solve(A - square, b - total) for square, total in parts])
    deviations[some] = np.sqrt((PARTS - 1) * np.var(others, axis=0))
    beside = np.median(np.linalg.norm(X[..., 1:] @ values[1:], axis=-1)) / max(np.hypot(*values[1:]), 1e-12)
    errors = np.array([np.median(np.concatenate(moved)), beside])
    common = np.mean(np.concatenate(paces), axis=0) if alike else None
    return Shift(values, np.maximum(deviations, 1e-9), errors, np.ones(3), common)
