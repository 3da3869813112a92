"""The figures that compare whole tracks with whole true trajectories."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from vedette.metrics.bound import Bound, bound_along
from vedette.metrics.clear import clear_mot
from vedette.metrics.coverage import NONE, Indices
from vedette.metrics.histories import positions, truth_at, velocities
from vedette.metrics.hota import hota
from vedette.metrics.matching import Match
from vedette.metrics.near import Near
from vedette.metrics.ospa2 import ospa2
from vedette.metrics.score import Judge
from vedette.metrics.siap import assigned, siap
from vedette.metrics.trajectory import trajectory_gospa
from vedette.roles import Sensor
from vedette.space import Array, Mask
from vedette.types import Scan, Trajectory

PARTS = ("localisation", "missed", "false", "switches")


def whole_tracks(found: Match, options: Judge, times: Array, false: int) -> dict[str, Any]:
    """Return the figures of many targets over all judged scans, at `times` (s,), with so many `false` entries of tracks."""
    alive, tracks, cutoff, order = found.truth.alive, len(found.tracks), options.gospa_cutoff, options.gospa_order
    counted = _counted(found, options.far)
    apart, present = found.apart, found.present
    if options.far is not None:
        present = tuple(columns[some] for columns, some in zip(present, counted, strict=True))
        apart = tuple(each.among(tracks=some) for each, some in zip(apart, counted, strict=True))
    switch = cutoff if options.switch_penalty is None else options.switch_penalty
    gospa = trajectory_gospa(apart, present, alive, cutoff, switch, order, options.largest_program)
    mot = clear_mot(found.apart, found.present, alive, found.cover, false)
    higher = hota(apart, present, alive, tracks, cutoff)
    scans = len(apart)
    own = {} if gospa is None else {f"trajectory_gospa_{part}": getattr(gospa, part) / scans for part in PARTS}
    if gospa is not None:
        own["trajectory_gospa_m"] = gospa.value / scans ** (1 / order)
    return {
        **own,
        "ospa2_m": ospa2(apart, present, alive, tracks, cutoff, order, options.ospa2_scans),
        "mota": mot.mota,
        "motp_m": mot.motp,
        "hota": higher.value,
        "hota_detection": higher.detection,
        "hota_association": higher.association,
        "hota_localisation": higher.localisation,
        **_siap(found, counted, apart, present, times, options.cover_radius),
    }


def _counted(found: Match, far: float | None) -> list[Mask]:
    """Return which tracks of each scan are within `far` of an object."""
    if far is None:
        return [np.ones(len(columns), dtype=bool) for columns in found.present]
    return [each.nearest <= far for each in found.apart]


def _siap(
    found: Match,
    counted: Sequence[Mask],
    apart: Sequence[Near],
    present: Sequence[Indices],
    times: Array,
    radius: float,
) -> dict[str, Any]:
    """Return the attributes of a single integrated air picture."""
    owners = [assigned(each, radius) for each in apart]
    scan = np.repeat(np.arange(len(owners)), [np.count_nonzero(owner != NONE) for owner in owners])
    truth = np.concatenate([owner[owner != NONE] for owner in owners])
    entry = np.concatenate(
        [
            np.arange(rows.start, rows.stop)[some][owner != NONE]
            for rows, some, owner in zip(found.rows, counted, owners, strict=True)
        ]
    )
    error = found.truth.space.difference(found.entries.mean[entry], found.truth.states[scan, truth])
    spot, speed = positions(found.truth.space), velocities(found.truth.space)
    picture = siap(
        owners,
        present,
        found.truth.alive,
        times,
        np.linalg.norm(error[:, spot], axis=-1),
        np.linalg.norm(error[:, speed], axis=-1) if speed else None,
    )
    return {
        "siap_completeness": picture.completeness,
        "siap_ambiguity": picture.ambiguity,
        "siap_spuriousness": picture.spuriousness,
        "siap_position_m": picture.position,
        "siap_velocity_mps": picture.velocity,
        "siap_changes_per_s": picture.changes,
        "siap_longest": picture.longest,
    }


def position_bound(
    bound: Bound, sensors: Mapping[str, Sensor], truth: Sequence[Trajectory], scans: Sequence[Scan], judged: Indices
) -> float | None:
    """Return the root of the mean bound of the squared position error over the judged scans and objects, in m.

    None where the truth lacks an axis of the bound's motion, or where none is there.
    """
    space = bound.motion.state
    if any(axis not in each.space.axes for each in truth for axis in space.axes):
        return None
    real = truth_at(truth, np.array([scan.time for scan in scans]), space)
    lives, life = np.unique(real.alive, axis=1, return_inverse=True)
    spot, squares = positions(space), list[Array]()
    for i, there in enumerate(lives.T):
        own = np.flatnonzero(there)
        if not len(own):
            continue
        members, looks = real.states[own][:, life.reshape(-1) == i], [scans[k] for k in own.tolist()]
        P = bound_along(bound, sensors, looks, members, space)
        if P is None:
            return None
        squares.append(np.sum(P[np.isin(own, judged)][..., spot, spot], axis=-1).ravel())
    every = np.concatenate([*squares, np.zeros(0)])
    return float(np.sqrt(np.mean(every))) if every.size else None
