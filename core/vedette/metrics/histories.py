"""Tracks and truth aligned at the scans of one run."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from attrs import frozen

from vedette.errors import InputError
from vedette.metrics.coverage import Indices
from vedette.space import Array, Mask, Space, SpaceError
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

    def part(self, rows: slice, first: int) -> Entries:
        """Return some of them, their scans counted from `first` on."""
        modes = None if self.mode_prob is None else self.mode_prob[rows]
        columns = (self.track[rows], self.mean[rows], self.cov[rows], self.nis[rows], self.hit[rows])
        return Entries(self.scan[rows] - first, *columns, modes)


def confirmed_entries(tracks: Sequence[Track], times: Array, space: Space) -> Entries:
    """Return the confirmed part of the histories of `tracks` over `space`, at scans of non-decreasing `times` (s,) in s."""
    n = len(space)
    own = [track.space.locate(space) for track in tracks]
    scan = np.concatenate([np.zeros(0, dtype=np.intp), *(_scan_of(track, times) for track in tracks)])
    number = np.repeat(np.arange(len(tracks)), [len(track.times) for track in tracks])
    confirmed = np.concatenate([np.zeros(0, dtype=bool), *(track.confirmed for track in tracks)])
    kept = np.flatnonzero(confirmed)
    kept = kept[np.argsort(scan[kept], kind="stable")]
    covs = (track.cov[:, part][:, :, part] for track, part in zip(tracks, own, strict=True))
    modes = [track.mode_prob for track in tracks if track.mode_prob is not None]
    return Entries(
        scan=scan[kept],
        track=number[kept],
        mean=np.concatenate([np.zeros((0, n)), *(track.mean[:, part] for track, part in zip(tracks, own, strict=True))])[
            kept
        ],
        cov=np.concatenate([np.zeros((0, n, n)), *covs])[kept],
        nis=np.concatenate([np.zeros(0), *(track.nis for track in tracks)])[kept],
        hit=np.concatenate([np.zeros(0), *(track.hit for track in tracks)])[kept],
        mode_prob=np.concatenate(modes)[kept] if modes and len(modes) == len(tracks) else None,
    )


def _scan_of(track: Track, times: Array) -> Indices:
    """Return after which scan each entry of a history (s,) was made.

    Several scans may share a time. A track that starts then has the last of them, any other the first.
    """
    first = np.searchsorted(times, track.times, "left")
    after = np.searchsorted(times, track.times, "right")
    if np.any(first == after):
        time = track.times[np.argmax(first == after)]
        raise InputError(f"tracks: track {track.id} has an entry at {time:.6f} s, when there is no scan")
    begin = np.searchsorted(track.times, track.times, "left")
    number = np.searchsorted(track.times, track.times, "right") - begin
    start = np.where(begin == 0, after - number, first)
    return start + np.arange(len(track.times)) - begin


@frozen(eq=False)
class Truth:
    """True objects at the scans: states (s, j, n) over their common axes, alive (s, j).

    unsaid (s,): the recording does not say where one of them is
    """

    space: Space
    states: Array
    alive: Mask
    unsaid: Mask

    @property
    def known(self) -> Mask:
        """Scans (s,) between the first and the last at which any object is recorded, but for those `unsaid`."""
        some = np.flatnonzero(self.alive.any(axis=1))
        inside = np.zeros(len(self.alive), dtype=bool)
        if some.size:
            inside[some[0] : some[-1] + 1] = True
        return inside & ~self.unsaid


def truth_at(truth: Sequence[Trajectory], times: Array, space: Space | None, most: float | None = None) -> Truth:
    """Return the true states at `times` (s,) over the axes that all trajectories and the tracks' `space`, if given, share.

    Between two recorded states that are more than `most` s apart nothing is said of the object; None: however far they are.
    InputError if two state one axis differently, or if they share no position.
    """
    if not truth:
        none = np.zeros((len(times), 0), dtype=bool)
        return Truth(Space(), np.zeros((len(times), 0, 0)), none, np.zeros(len(times), dtype=bool))
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
    states, alive, gaps = zip(*(_sample(trajectory, times, shared, most) for trajectory in truth), strict=True)
    return Truth(shared, np.stack(states, axis=1), np.stack(alive, axis=1), np.any(gaps, axis=0))


def positions(space: Space) -> list[int]:
    """Return the indices of the position axes that `space` has."""
    return [i for i, name in enumerate(space.names) if name in ("x", "y", "z")]


def velocities(space: Space) -> list[int]:
    """Return the indices of the velocity axes that `space` has."""
    return [i for i, name in enumerate(space.names) if name in ("vx", "vy", "vz")]


def _sample(trajectory: Trajectory, times: Array, space: Space, most: float | None) -> tuple[Array, Mask, Mask]:
    """Return `trajectory.at` of all times at once: states (s, n) over `space`, where there is one (s,), gaps (s,)."""
    known = trajectory.times
    axes = trajectory.space.locate(space)
    nowhere = np.zeros(len(times), dtype=bool)
    if not len(known):
        return np.zeros((len(times), len(space))), nowhere, nowhere
    i = np.clip(np.searchsorted(known, times) - 1, 0, max(len(known) - 2, 0))
    j = np.minimum(i + 1, len(known) - 1)
    gap = known[j] - known[i]
    part = np.clip(np.divide(times - known[i], gap, out=np.zeros(len(times)), where=gap > 0), 0.0, 1.0)
    begin, end = trajectory.states[i][:, axes], trajectory.states[j][:, axes]  # of these scans alone: a truth may be long
    step = part[:, None] * space.difference(end, begin)
    inside = (known[0] <= times) & (times <= known[-1])
    wide = nowhere if most is None else (gap > most) & (part > 0) & (part < 1)
    return space.displace(begin, step), inside & ~wide, wide
