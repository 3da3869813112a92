"""The figures that compare whole tracks with whole true trajectories, from what a run leaves of each scan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, final

import numpy as np
from attrs import asdict, frozen

from vedette import Array, Indices, Judge, Mask, Scan, Sensor, Trajectory
from vedette.metrics import NONE, Match, Near, positions, velocities
from vedette_standard.whole_tracks.bound import position_bound
from vedette_standard.whole_tracks.clear import clear_mot
from vedette_standard.whole_tracks.hota import hota
from vedette_standard.whole_tracks.idf1 import idf1
from vedette_standard.whole_tracks.ospa2 import ospa2
from vedette_standard.whole_tracks.siap import assigned, siap
from vedette_standard.whole_tracks.trajectory import trajectory_gospa

PARTS = ("localisation", "missed", "false", "switches")


@frozen(eq=False)
class _Look:
    """One scan: its time in s; the true objects that are there (a,), and which track covers each (a,); the tracks (t,).

    near: the pairs of true objects and tracks within the reach of any figure. counted (t,): the tracks that are
    not far from all objects; owner: the object that each of these is assigned to; position and velocity: their errors.
    """

    time: float
    alive: Indices
    cover: Indices
    present: Indices
    near: Near
    counted: Mask
    owner: Indices
    position: Array
    velocity: Array | None

    @property
    def numbers(self) -> int:
        """How many numbers it takes, 8 bytes each: those that it holds, and what its arrays take besides."""
        return 128 + 2 * len(self.alive) + 5 * len(self.present) + 3 * len(self.near.track)


@final
class WholeTracks:
    """Collects of each scan what the figures of whole tracks need: it grows with the run.

    `most`: beyond so many numbers it drops them all and is `dropped`: there are no such figures then.
    """

    def __init__(self, truths: int, options: Judge, most: float) -> None:
        self._truths, self._options, self._most = truths, options, most
        self._looks: list[_Look] = []
        self._numbers = 0
        self.dropped = not most

    def add(self, match: Match, times: Array, which: Indices, begin: int) -> None:
        """Add the scans of a block from `begin` on; `which` of all true objects are those of the match."""
        if self.dropped:
            return
        space, far, radius = match.truth.space, self._options.far, self._options.cover_radius
        spot, speed, reach = positions(space), velocities(space), max(self._options.gospa_cutoff, radius)
        for i in range(begin, len(times)):
            apart, rows, there = match.apart[i], match.rows[i], np.flatnonzero(match.truth.alive[i])
            close = np.ones(apart.shape[1], dtype=bool) if far is None else apart.nearest <= far
            nearest = assigned(apart.among(tracks=close), radius)
            owned = np.flatnonzero(nearest != NONE)
            entry = np.arange(rows.start, rows.stop)[close][owned]
            error = space.difference(match.entries.mean[entry], match.truth.states[i, nearest[owned]])
            look = _Look(
                time=float(times[i]),
                alive=which[there],
                cover=match.cover[i, there],
                present=match.entries.track[rows],
                near=apart.within(reach).numbered(which, self._truths),
                counted=close,
                owner=np.where(nearest == NONE, NONE, which[nearest]) if len(which) else nearest,
                position=np.linalg.norm(error[:, spot], axis=-1),
                velocity=np.linalg.norm(error[:, speed], axis=-1) if speed else None,
            )
            self._looks.append(look)
            self._numbers += look.numbers
        if self._numbers > self._most:
            self._looks, self.dropped = [], True

    def figures(self, scans: int, false: int) -> dict[str, Any]:
        """Return the figures of the first so many scans, with so many `false` entries of tracks; none if it dropped them."""
        if self.dropped:
            return {}
        looks, options = self._looks[:scans], self._options
        named = np.unique(np.concatenate([look.present for look in looks]))
        present = tuple(np.searchsorted(named, look.present) for look in looks)
        alive, cover = np.zeros((scans, self._truths), dtype=bool), np.full((scans, self._truths), NONE)
        for i, look in enumerate(looks):
            alive[i, look.alive] = True
            cover[i, look.alive] = np.where(look.cover == NONE, NONE, np.searchsorted(named, look.cover))
        apart = tuple(look.near for look in looks)
        mot = clear_mot(apart, present, alive, cover, false)
        if options.far is not None:
            present = tuple(columns[look.counted] for columns, look in zip(present, looks, strict=True))
            apart = tuple(look.near.among(tracks=look.counted) for look in looks)
        return {
            "mota": mot.mota,
            "motp_m": mot.motp,
            **self._of_trajectories(apart, present, alive, len(named)),
            **_siap(looks, present, alive),
        }

    def position_bound(
        self, sensors: Mapping[str, Sensor], truth: Sequence[Trajectory], scans: Sequence[Scan], judged: Indices
    ) -> float | None:
        """Return the bound of the position error in m, over the judged ones of these scans; None if none was asked for."""
        bound = self._options.bound
        return None if bound is None or self.dropped else position_bound(bound, sensors, truth, scans, judged)

    def _of_trajectories(
        self, apart: Sequence[Near], present: Sequence[Indices], alive: Mask, tracks: int
    ) -> dict[str, Any]:
        options, scans = self._options, len(apart)
        cutoff, order = options.gospa_cutoff, options.gospa_order
        switch = cutoff if options.switch_penalty is None else options.switch_penalty
        gospa = trajectory_gospa(apart, present, alive, cutoff, switch, order, options.largest_program)
        higher = hota(apart, present, alive, tracks, cutoff)
        per_scan = {} if gospa is None else {f"trajectory_gospa_{part}": getattr(gospa, part) / scans for part in PARTS}
        if gospa is not None:
            per_scan["trajectory_gospa_m"] = gospa.value / scans ** (1 / order)
        return {
            **per_scan,
            "ospa2_m": ospa2(apart, present, alive, tracks, cutoff, order, options.ospa2_scans),
            "idf1": idf1(apart, present, alive, options.cover_radius),
            "hota": higher.value,
            **{f"hota_{part}": getattr(higher, part) for part in ("detection", "association", "localisation")},
        }


def _siap(looks: Sequence[_Look], present: Sequence[Indices], alive: Mask) -> dict[str, Any]:
    """Return the attributes of a single integrated air picture."""
    fast = [look.velocity for look in looks if look.velocity is not None]
    picture = siap(
        [look.owner for look in looks],
        present,
        alive,
        np.array([look.time for look in looks]),
        np.concatenate([look.position for look in looks]),
        np.concatenate(fast) if len(fast) == len(looks) else None,
    )
    units = {"position": "_m", "velocity": "_mps", "changes": "_per_s"}
    return {f"siap_{name}{units.get(name, '')}": value for name, value in asdict(picture).items()}
