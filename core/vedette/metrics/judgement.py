"""One run compared with the truth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from vedette.metrics.consistency import nees, pooled_nis
from vedette.metrics.coverage import NONE, Indices, is_lost, switches
from vedette.metrics.errors import expected_error, rmse
from vedette.metrics.gospa import gospa, ospa
from vedette.metrics.histories import Entries, positions, velocities
from vedette.metrics.matching import Match, Pairs, match
from vedette.metrics.score import Judge, Score, TruthScore
from vedette.metrics.whole import position_bound, whole_tracks
from vedette.roles import Sensor
from vedette.space import Array
from vedette.types import Scan, Track, Trajectory


def judge(
    tracks: Sequence[Track],
    truth: Sequence[Trajectory],
    scans: Sequence[Scan],
    options: Judge,
    gate_probability: float = 1.0,
    sensors: Mapping[str, Sensor] | None = None,
) -> Score:
    """Judge the tracks of one run against the truth, at the scans that the tracker took.

    Scans before any true object is recorded, or after the last one, say nothing about the tracks and are not judged.
    `gate_probability` is that of the tracker's gate: `nis` allows for the returns that it rejects. Frames are not gated.
    `sensors` are those of the scans, for the posterior Cramer-Rao bound.
    InputError where truth and tracks have no position axis in common, or a track has an entry when there is no scan.
    """
    found = match(tracks, truth, scans, options)
    chosen = options.choose(scans)
    nis = nis_ratio(found.entries, scans, chosen, gate_probability)
    if not found.scans.size:
        return Score(scans=0 if truth else len(chosen), tracks=len(found.tracks), nis=nis)
    held = found.cover
    if options.lost_error is not None and options.lost_error != options.cover_radius:
        held = found.covered_within(options.lost_error)
    pairs = found.pairs()
    times = np.array([scans[i].time for i in found.scans])
    false = _idle(found, options.near)
    lowest = None
    if options.bound is not None and sensors is not None:
        lowest = position_bound(options.bound, sensors, truth, scans, found.scans)
    return Score(
        scans=len(found.scans),
        tracks=len(found.tracks),
        nis=nis,
        position_bound_m=lowest,
        false_tracks=float(np.mean(false)),
        **_accuracy(pairs, found),
        **_sets(found, options),
        **whole_tracks(found, options, times, sum(false)),
        **_fates(truth, found, pairs, held, times, options.lost_scans),
    )


def nis_ratio(entries: Entries, scans: Sequence[Scan], chosen: Indices, gate_probability: float) -> float | None:
    """Return NIS over confirmed tracks; the scan that starts a track has no innovation, and the tracker reports 0 there."""
    axes, gates = np.array([scan.detections.z.shape[-1] for scan in scans]), gates_of(scans, gate_probability)
    used = (entries.nis > 0) & np.isin(entries.scan, chosen)
    if not used.any():
        return None
    return float(pooled_nis(entries.nis[used], entries.hit[used], axes[entries.scan[used]], gates[entries.scan[used]]))


def gates_of(scans: Sequence[Scan], gate_probability: float) -> Array:
    """Return the gate's probability in each scan (s,): 1 where it is a camera's, as frames are not gated."""
    return np.array([gate_probability if scan.frame is None else 1.0 for scan in scans])


def _accuracy(pairs: Pairs, found: Match) -> dict[str, Any]:
    """Return errors of the covered objects, and how they compare with their covariances."""
    if not pairs.entry.size:
        return {}
    space, cov = found.truth.space, found.entries.cov[pairs.entry]
    spot, speed = positions(space), velocities(space)
    modes = found.entries.mode_prob
    return {
        "position_rmse_m": rmse(pairs.error[:, spot]),
        "position_deviation_m": expected_error(cov[:, spot][:, :, spot]),
        "velocity_rmse_mps": rmse(pairs.error[:, speed]) if speed else None,
        "bias_m": tuple(np.mean(pairs.error[:, spot], axis=0).tolist()),
        "nees_position": _nees_over_axes(pairs.error[:, spot], cov[:, spot][:, :, spot]),
        "nees_state": _nees_over_axes(pairs.error, cov),
        "nees_state_axes": space.names,
        "mode_prob": None if modes is None else tuple(np.mean(modes[pairs.entry], axis=0).tolist()),
    }


def _nees_over_axes(error: Array, cov: Array) -> float | None:
    """Return the mean NEES over the number of axes, so that 1 is right; None if a covariance is singular."""
    try:
        return float(np.mean(nees(error, cov))) / int(error.shape[-1])
    except ValueError:
        return None


def _sets(found: Match, options: Judge) -> dict[str, Any]:
    """Compare all confirmed tracks with all true objects, scan by scan; return means over the scans."""
    cutoff, order = options.gospa_cutoff, options.gospa_order
    counted, every, plain = [], [], []
    for apart, alive in zip(found.apart, found.truth.alive, strict=True):
        there = apart.among(alive)
        within = there if options.far is None else there.among(tracks=apart.nearest <= options.far)
        counted.append(gospa(within, cutoff, order))
        every.append(counted[-1].value if options.far is None else gospa(there, cutoff, order).value)
        plain.append(ospa(within, cutoff, order))
    return {
        "gospa_m": float(np.mean([one.value for one in counted])),
        "gospa_localisation": float(np.mean([one.localisation for one in counted])),
        "gospa_missed": float(np.mean([one.missed for one in counted])),
        "gospa_false": float(np.mean([one.false for one in counted])),
        "gospa_all_m": float(np.mean(every)),
        "ospa_m": float(np.mean(plain)),
    }


def _idle(found: Match, near: float | None) -> list[int]:
    """Return how many tracks, within `near` of an object, cover nothing at each scan."""
    false = []
    for apart, present, covered in zip(found.apart, found.present, found.cover, strict=True):
        idle = ~np.isin(present, covered)
        false.append(int(np.count_nonzero(idle if near is None else idle & (apart.nearest <= near))))
    return false


def _fates(
    truth: Sequence[Trajectory], found: Match, pairs: Pairs, held: Indices, times: Array, lost_scans: int
) -> dict[str, Any]:
    """Return what became of each true object, and of all; `held` (s, j) is `cover` within the error of a lost track."""
    fates = []
    for j, trajectory in enumerate(truth):
        alive = found.truth.alive[:, j]
        count = int(np.count_nonzero(alive))
        covered = (found.cover[:, j] != NONE)[alive]
        ever = bool(covered.any())
        at = times[alive]
        fates.append(
            TruthScore(
                name=trajectory.name,
                scans=count,
                coverage=float(np.mean(covered)) if count else None,
                position_rmse_m=rmse(pairs.error[pairs.truth == j][:, positions(found.truth.space)]) if ever else None,
                id_switches=switches(found.cover[:, j]),
                lost=is_lost((held[:, j] != NONE)[alive], lost_scans) if count else None,
                confirmed_after_s=float(at[np.argmax(covered)] - at[0]) if ever else None,
            )
        )
    waits = [fate.confirmed_after_s for fate in fates if fate.confirmed_after_s is not None]
    return {
        "coverage": float(np.mean([fate.coverage for fate in fates if fate.coverage is not None])),
        "id_switches": sum(fate.id_switches for fate in fates),
        "lost": float(np.mean([fate.lost for fate in fates if fate.lost is not None])),
        "confirmed_after_s": float(np.mean(waits)) if waits else None,
        "truths": tuple(fates),
    }
