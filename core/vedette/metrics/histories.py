"""Tracks and truth aligned at the scans of one run."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

import numpy as np
from attrs import frozen

from vedette.errors import InputError
from vedette.space import Array, Indices, Mask, Space, SpaceError
from vedette.types import Track, Trajectory


@frozen(eq=False)
class Entries:
    """Confirmed tracks after the scans, over some of their axes: `e` entries, by scan, then by track.

    scan (e,) and track (e,) index the scans and the tracks; mean (e, n), cov (e, n, n), nis (e,), hit (e,),
    mode_prob (e, r) or None
    """

    scan: Indices
    track: Indices
    mean: Array
    cov: Array
    nis: Array
    hit: Array
    mode_prob: Array | None

    def part(self, rows: slice | Mask, first: int) -> Entries:
        """Return some of them, their scans counted from `first` on."""
        modes = None if self.mode_prob is None else self.mode_prob[rows]
        columns = (self.track[rows], self.mean[rows], self.cov[rows], self.nis[rows], self.hit[rows])
        return Entries(self.scan[rows] - first, *columns, modes)


def confirmed_entries(tracks: Sequence[Track], times: Array, space: Space) -> Entries:
    """Return the confirmed part of the histories of `tracks` over `space`, at scans of non-decreasing `times` (s,) in s."""
    n, real = len(space), np.zeros(0)
    number = np.repeat(np.arange(len(tracks)), [len(track.times) for track in tracks])
    scan = _scans(tracks, number, np.concatenate([real, *(track.times for track in tracks)]), times)
    kept = np.flatnonzero(np.concatenate([np.zeros(0, dtype=bool), *(track.confirmed for track in tracks)]))
    kept = kept[np.argsort(scan[kept], kind="stable")]
    mean, cov = [np.zeros((0, n))], [np.zeros((0, n, n))]
    for alike in (list(group) for _, group in groupby(tracks, key=lambda track: id(track.space))):
        part = alike[0].space.locate(space)
        if lacking := [track.id for track in alike if track.mean.shape[-1] != len(track.space)]:
            raise InputError(f"track {lacking[0]}: its states must have the {len(alike[0].space)} axes of {alike[0].space}")
        mean.append(np.concatenate([track.mean for track in alike])[:, part])
        cov.append(np.concatenate([track.cov for track in alike])[:, part][:, :, part])
    modes = [track.mode_prob for track in tracks if track.mode_prob is not None]
    return Entries(
        scan=scan[kept],
        track=number[kept],
        mean=np.concatenate(mean)[kept],
        cov=np.concatenate(cov)[kept],
        nis=np.concatenate([real, *(track.nis for track in tracks)])[kept],
        hit=np.concatenate([real, *(track.hit for track in tracks)])[kept],
        mode_prob=np.concatenate(modes)[kept] if modes and len(modes) == len(tracks) else None,
    )


def _scans(tracks: Sequence[Track], number: Indices, entered: Array, times: Array) -> Indices:
    """Return after which scan each entry (e,) of the tracks was made, of which track and at what time they are given.

    Several scans may share a time. A track that starts then has the last of them, any other the first.
    """
    first, after = np.searchsorted(times, entered, "left"), np.searchsorted(times, entered, "right")
    if np.any(first == after):
        bad = int(np.argmax(first == after))
        raise InputError(
            f"tracks: track {tracks[number[bad]].id} has an entry at {entered[bad]:.6f} s, when there is no scan"
        )
    starts = np.diff(number, prepend=-1) != 0
    begins = np.flatnonzero(starts | (np.diff(entered, prepend=np.nan) != 0))
    count = np.diff(begins, append=len(number))
    begin = np.where(starts[begins], after[begins] - count, first[begins])
    return np.repeat(begin - begins, count) + np.arange(len(number))


@frozen(eq=False)
class Truth:
    """True objects at the scans: states (s, j, n) over their common axes, alive (s, j).

    unsaid (s, j): of those that the recording does not tell the place of; their states are interpolated
    """

    space: Space
    states: Array
    alive: Mask
    unsaid: Mask


def truth_at(truth: Sequence[Trajectory], times: Array, space: Space | None, most: float | None = None) -> Truth:
    """Return the true states at `times` (s,) over the axes that all trajectories and the tracks' `space`, if given, share.

    Between two recorded states that are more than `most` s apart nothing is said of the object; None: however far they are.
    InputError if two state one axis differently, or if they share no position.
    """
    if not truth:
        none = np.zeros((len(times), 0), dtype=bool)
        return Truth(Space(), np.zeros((len(times), 0, 0)), none, none)
    shared, seen = truth[0].space if space is None else space, set[Space]()
    for trajectory in truth:
        if trajectory.space in seen:
            continue
        seen.add(trajectory.space)
        try:
            shared.union(trajectory.space)
        except SpaceError as error:
            raise InputError(f"truth {trajectory.name!r}: {error}") from None
        shared = Space(tuple(axis for axis in shared.axes if axis.name in trajectory.space))
    if not positions(shared):
        raise InputError(f"truth {truth[0].name!r}: must have a position axis x, y or z of the tracks, has {truth[0].space}")
    return Truth(shared, *_samples(truth, times, shared, most))


def positions(space: Space) -> list[int]:
    """Return the indices of the position axes that `space` has."""
    return [i for i, name in enumerate(space.names) if name in ("x", "y", "z")]


def velocities(space: Space) -> list[int]:
    """Return the indices of the velocity axes that `space` has."""
    return [i for i, name in enumerate(space.names) if name in ("vx", "vy", "vz")]


def _samples(truth: Sequence[Trajectory], times: Array, space: Space, most: float | None) -> tuple[Array, Mask, Mask]:
    """Return `Trajectory.at` of all: states (s, j, n) over `space`, where there is one (s, j), and where a gap (s, j)."""
    shape, parts = (len(times), len(truth)), {id(path.space): path.space.locate(space) for path in truth}
    if not (len(times) and len(truth)):
        return np.zeros((*shape, len(space))), np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool)
    count = np.array([len(path.times) for path in truth])
    i = np.stack([path.times.searchsorted(times) for path in truth], axis=-1)
    i = np.clip(i - 1, 0, np.maximum(count - 2, 0))
    first = i.min(axis=0)  # of each object only what these scans need: a truth may be long
    length = np.minimum(i.max(axis=0) + 2, count) - first
    spans = list(zip(truth, first.tolist(), (first + length).tolist(), strict=True))
    none = np.zeros((1, len(space)))  # for objects without a state, which are nowhere
    known = np.concatenate([*(path.times[a:b] for path, a, b in spans), none[:, 0]])
    states = np.concatenate([*(path.states[a:b, parts[id(path.space)]] for path, a, b in spans), none])
    last = np.cumsum(length) - 1
    i = np.where(count > 0, i - first + last + 1 - length, len(known) - 1)
    k = np.where(count > 0, np.minimum(i + 1, last), i)
    begin, end, low, high = states[i], states[k], known[i], known[k]
    edges = np.array([(path.times[0], path.times[-1]) if len(path.times) else (np.inf, -np.inf) for path in truth])
    inside = (edges[:, 0] <= times[:, None]) & (times[:, None] <= edges[:, 1])
    gap = high - low
    part = np.clip(np.divide(times[:, None] - low, gap, out=np.zeros(shape), where=gap > 0), 0.0, 1.0)
    wide = np.zeros(shape, dtype=bool) if most is None else (gap > most) & (part > 0) & (part < 1)
    return space.displace(begin, part[..., None] * space.difference(end, begin)), inside & ~wide, wide
