"""What tracks used of the scans that they lived through."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from attrs import frozen

from vedette import Array, Gaussian, ImagingSensor, Indices, Result, Tracker
from vedette.tracking import Expected, State
from vedette_report.consistency import autocorrelation

Entry = tuple[str, float, float, float, float, Array, Array, Array]
"""What a track used of a scan: sensor, time in s, NIS, hit, its declared chance, innovation (m,), its covariance (m, m),
and the share of it that has each component (m,).
"""

ALMOST_SURE = 0.99
"""So probably detected, a target's innovations are of one return: a mean of several would be smaller."""

LAGS = 10
"""Number of scans over which innovations are correlated."""


@frozen(eq=False)
class Innovations:
    """What a track used of each scan that it lived through.

    nis (s,) weighted squared distances, hit (s,) the probability of having been detected and `declared` (s,) what it was to
    be, axes (s,) that were measured; `correlation` (l,) of the innovations of its most used sensor at lag 1 ..., from
    `pairs` (l,) of numbers: none if they are fewer than three scans. `sizes`: of each sensor and measured axis, the sum of
    its squared innovations over their variances, and of how many: where it was surely detected. `sensors` (s,): whose scan.
    `gated`: whether a gate may shut returns out.
    """

    times: Array
    nis: Array
    hit: Array
    declared: Array
    axes: Array
    correlation: Array
    pairs: Array
    sizes: Mapping[tuple[str, str], Array]
    sensors: tuple[str, ...]
    gated: bool = True


def entries_of(tracker: Tracker, result: Result) -> dict[int, list[Entry]]:
    """Return by track id what it used of each scan of returns after the one in which it began."""
    rows: dict[int, list[Entry]] = {}
    for before, state, scan in zip(result.states, result.states[1:], result.scans[1:], strict=False):
        if isinstance(tracker.sensors[scan.sensor], ImagingSensor) or not len(before.ids):
            continue
        it = tracker.expect(before, scan)
        predicted = it.tracks
        at = {track: row for row, track in enumerate(before.ids.tolist())}
        for row, track in enumerate(state.ids.tolist()):
            if track in at:
                then, ahead = it, predicted
                if scan.detections.time is not None and state.hit[row] > 0:
                    then = it.at(int(_returns(state, row)[np.argmax(state.weights[row, 1:])]))
                    ahead = then.tracks
                prior = Gaussian(ahead.mean[at[track]], ahead.cov[at[track]])
                pooled, S, declared, known = _used(then, prior, state, row)
                nis, hit = float(state.nis[row]), float(state.hit[row])
                entry = (scan.sensor, scan.time, nis, hit, declared, pooled, S, known)
                rows.setdefault(track, []).append(entry)
    return rows


def _returns(state: State, row: int) -> Indices:
    """Return which return each of a track's columns is of."""
    return np.arange(state.weights.shape[-1] - 1) if state.returns is None else state.returns[row]


def _used(it: Expected, prior: Gaussian, state: State, row: int) -> tuple[Array, Array, float, Array]:
    """Return the weighted sum of a track's innovations (m,), the covariance of one (m, m), its chance to be detected, and
    how much of the weight has each component (m,).
    """
    weights = state.weights[row, 1:]
    used = np.flatnonzero(weights)
    used_returns = _returns(state, row)[used]
    sensor, seen = it.sensor, it.scan.detections
    noise = seen.noise[used_returns[np.argmax(weights[used])]] if len(used_returns) and seen.noise is not None else None
    expected, S, _ = it.returns_of(prior, noise)
    residual = sensor.measurement.difference(seen.z[used_returns], expected)
    known: Array = np.ones(residual.shape[-1])
    if seen.missing is not None:
        known = known - weights[used] @ seen.missing[used_returns] / max(float(np.sum(weights)), 1e-300)
        residual = np.where(seen.missing[used_returns], 0.0, residual)
    declared = float(sensor.detects(prior.mean[it.plan.state.locate(sensor.observes)])) * it.plan.p_gate
    return np.sum(weights[used][:, None] * residual, axis=0), S, declared, known


def gathered(measured: Mapping[str, Sequence[str]], p_gate: float, entries: Sequence[Entry]) -> Innovations:
    """Return what a track used, by sensors that measure axes of these names, behind a gate of a probability."""
    names = [entry[0] for entry in entries]
    most = max(set(names), key=lambda name: (sum(e[3] > 0 for e in entries if e[0] == name), name))
    alike = [entry for entry in entries if entry[0] == most]
    lags, valid = min(LAGS, len(alike) - 1), np.array([entry[3] > 0 for entry in alike])
    correlation: Array = np.zeros(0)
    pairs: Array = np.zeros(0)
    if lags > 0 and valid.sum() >= 3:
        correlation, pairs = autocorrelation(np.array([e[5] for e in alike]), np.array([e[6] for e in alike]), lags, valid)
    times, nis, hit, declared = (np.array([entry[i] for entry in entries], dtype=float) for i in range(1, 5))
    axes = np.array([np.sum(entry[7]) for entry in entries])
    sizes = {}
    for name in dict.fromkeys(names):
        sure = [entry for entry in entries if entry[0] == name and entry[3] > ALMOST_SURE]
        squares = np.array([entry[5] ** 2 / np.diagonal(entry[6]) for entry in sure]).T
        counts = np.array([entry[7] for entry in sure]).T
        for axis, each, count in zip(measured[name], squares, counts, strict=False):
            sizes[name, axis] = np.array([np.sum(each), np.sum(count)])
    return Innovations(times, nis, hit, declared, axes, correlation, pairs, sizes, tuple(names), p_gate < 1.0)
