"""One run held against the truth."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from attrs import evolve, frozen

from vedette.consistency import nees, pooled_nis
from vedette.metrics.coverage import NONE, Indices, covering, is_lost, switches
from vedette.metrics.errors import rmse
from vedette.metrics.gospa import distances, gospa, ospa
from vedette.metrics.histories import Entries, Truth, confirmed_entries, positions, truth_at, velocities
from vedette.metrics.score import Judge, Score, TruthScore
from vedette.space import Array
from vedette.types import Scan, Track, Trajectory


def judge(
    tracks: Sequence[Track],
    truth: Sequence[Trajectory],
    scans: Sequence[Scan],
    options: Judge,
    gate_probability: float = 1.0,
) -> Score:
    """Hold the tracks of one run against the truth, at the scans that the tracker took.

    Scans before any true object is recorded, or after the last one, say nothing about the tracks and are not judged.
    `gate_probability` is that of the tracker's gate: `nis` allows for the returns that it keeps out.
    InputError where truth and tracks have no position axis in common, or a track has an entry when there is no scan.
    """
    tracks = [track for track in tracks if track.confirmed.any()]
    times = np.array([scan.time for scan in scans])
    chosen = options.choose(scans)
    real = truth_at(truth, times[chosen], tracks[0].space if tracks else None)
    entries = confirmed_entries(tracks, times, real.space)
    nis = _nis(entries, scans, chosen, gate_probability)
    if not real.alive.any():
        return Score(scans=0 if truth else len(chosen), tracks=len(tracks), nis=nis)
    known = real.known
    judged, real = chosen[known], Truth(real.space, real.states[known], real.alive[known])
    scene = _scene(entries, real, judged, options)
    cover = covering(scene.apart, scene.present, len(tracks), options.cover_radius)
    held = cover
    if options.lost_error is not None and options.lost_error != options.cover_radius:
        held = covering(scene.apart, scene.present, len(tracks), options.lost_error)
    pairs = _pairs(scene, cover, len(tracks))
    return Score(
        scans=len(judged),
        tracks=len(tracks),
        nis=nis,
        **_accuracy(pairs, scene),
        **_sets(scene, cover, options),
        **_fates(truth, scene, pairs, cover, held, times[judged], options.lost_scans),
    )


@frozen(eq=False)
class _Scene:
    """Tracks and truth at the `s` judged scans.

    scans (s,): their indices; rows: per scan, which entries; apart: per scan, the distances (j, t) in m, infinite for a
    truth that is not there.
    """

    entries: Entries
    truth: Truth
    scans: Indices
    rows: tuple[slice, ...]
    apart: tuple[Array, ...]

    @property
    def present(self) -> tuple[Indices, ...]:
        """Per scan, which tracks (t,) there are."""
        return tuple(self.entries.track[rows] for rows in self.rows)


@frozen(eq=False)
class _Pairs:
    """Covered truths and the entries of their tracks: scan (q,), truth (q,), entry (q,), error (q, n)."""

    scan: Indices
    truth: Indices
    entry: Indices
    error: Array


def _nis(entries: Entries, scans: Sequence[Scan], chosen: Indices, gate_probability: float) -> float | None:
    """Over confirmed tracks; the scan that starts a track has no innovation, and there the tracker says 0."""
    axes = np.array([scan.detections.z.shape[-1] for scan in scans])
    used = (entries.nis > 0) & np.isin(entries.scan, chosen)
    if not used.any():
        return None
    return float(pooled_nis(entries.nis[used], entries.hit[used], axes[entries.scan[used]], gate_probability))


def _scene(entries: Entries, real: Truth, judged: Indices, options: Judge) -> _Scene:
    offset = dict(zip("xy", options.offset.tolist(), strict=True))
    entries = evolve(entries, mean=entries.mean - [offset.get(name, 0.0) for name in real.space.names])
    where = positions(real.space)
    begin, end = np.searchsorted(entries.scan, judged, "left"), np.searchsorted(entries.scan, judged, "right")
    rows = tuple(slice(i, j) for i, j in zip(begin.tolist(), end.tolist(), strict=True))
    apart = tuple(
        np.where(alive[:, None], distances(states[:, where], entries.mean[part][:, where]), np.inf)
        for states, alive, part in zip(real.states, real.alive, rows, strict=True)
    )
    return _Scene(entries, real, judged, rows, apart)


def _pairs(scene: _Scene, cover: Indices, tracks: int) -> _Pairs:
    scan, truth = np.nonzero(cover != NONE)
    key = scene.entries.scan * tracks + scene.entries.track
    entry = np.searchsorted(key, scene.scans[scan] * tracks + cover[scan, truth])
    error = scene.truth.space.difference(scene.entries.mean[entry], scene.truth.states[scan, truth])
    return _Pairs(scan, truth, entry, error)


def _accuracy(pairs: _Pairs, scene: _Scene) -> dict[str, Any]:
    """Errors of the covered truths, and what their covariances say of them."""
    if not pairs.entry.size:
        return {}
    space, cov = scene.truth.space, scene.entries.cov[pairs.entry]
    spot, speed = positions(space), velocities(space)
    modes = scene.entries.mode_prob
    return {
        "position_rmse_m": rmse(pairs.error[:, spot]),
        "velocity_rmse_mps": rmse(pairs.error[:, speed]) if speed else None,
        "bias_m": tuple(np.mean(pairs.error[:, spot], axis=0).tolist()),
        "anees": _anees(pairs.error[:, spot], cov[:, spot][:, :, spot]),
        "anees_state": _anees(pairs.error, cov),
        "anees_state_axes": space.names,
        "mode_prob": None if modes is None else tuple(np.mean(modes[pairs.entry], axis=0).tolist()),
    }


def _anees(error: Array, cov: Array) -> float | None:
    """Mean NEES; it does not exist where a covariance is singular."""
    try:
        return float(np.mean(nees(error, cov)))
    except ValueError:
        return None


def _sets(scene: _Scene, cover: Indices, options: Judge) -> dict[str, Any]:
    """All confirmed tracks against all truths, scan by scan; means over the scans."""
    cutoff, order = options.gospa_cutoff, options.gospa_order
    counted, every, plain, false = [], [], [], []
    for apart, alive, present, covered in zip(scene.apart, scene.truth.alive, scene.present, cover, strict=True):
        nearest = np.min(apart, axis=0)
        there = apart[alive]
        within = there if options.far is None else there[:, nearest <= options.far]
        counted.append(gospa(within, cutoff, order))
        every.append(counted[-1].value if options.far is None else gospa(there, cutoff, order).value)
        plain.append(ospa(within, cutoff, order))
        idle = ~np.isin(present, covered)
        false.append(np.count_nonzero(idle if options.near is None else idle & (nearest <= options.near)))
    return {
        "gospa_m": float(np.mean([one.value for one in counted])),
        "gospa_localisation": float(np.mean([one.localisation for one in counted])),
        "gospa_missed": float(np.mean([one.missed for one in counted])),
        "gospa_false": float(np.mean([one.false for one in counted])),
        "gospa_all_m": float(np.mean(every)),
        "ospa_m": float(np.mean(plain)),
        "false_tracks": float(np.mean(false)),
    }


def _fates(
    truth: Sequence[Trajectory], scene: _Scene, pairs: _Pairs, cover: Indices, held: Indices, times: Array, lost_scans: int
) -> dict[str, Any]:
    """What became of each truth, and of all; `held` (s, j) is `cover` within the error of a lost track."""
    fates = []
    for j, trajectory in enumerate(truth):
        alive = scene.truth.alive[:, j]
        count = int(np.count_nonzero(alive))
        covered = (cover[:, j] != NONE)[alive]
        found = bool(covered.any())
        at = times[alive]
        fates.append(
            TruthScore(
                name=trajectory.name,
                scans=count,
                coverage=float(np.mean(covered)) if count else None,
                position_rmse_m=rmse(pairs.error[pairs.truth == j][:, positions(scene.truth.space)]) if found else None,
                id_switches=switches(cover[:, j]),
                lost=is_lost((held[:, j] != NONE)[alive], lost_scans) if count else None,
                confirmed_after_s=float(at[np.argmax(covered)] - at[0]) if found else None,
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
