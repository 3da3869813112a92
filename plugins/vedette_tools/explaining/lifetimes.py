"""What becomes of tracks that start at a target and of those that start at a false return, by drawing many of both."""

from __future__ import annotations

import numpy as np
from attrs import frozen
from scipy.special import gammaincinv

from vedette import Array, Lifecycle, Review
from vedette_tools.explaining.steady_state import Settled

TRACKS, LOOKS, MOST = 1000, 40, 60
"""Tracks of each sort that are drawn, the scans that each sees, and the most false returns in a gate that are drawn."""


@frozen
class Lives:
    """Shares of the tracks drawn: of targets, confirmed ever and still confirmed at the end; of false returns, confirmed."""

    confirmed: float
    kept: float
    false: float


def lives(
    lifecycle: Lifecycle, initial: float, settled: Settled, dt: float, p_gate: float, threshold: float, spread: Array
) -> Lives:
    """Draw tracks that start at one return each, with scans `dt` s apart; `spread` (s,): deviations of positions in m."""
    rng = np.random.default_rng(0)
    return Lives(*_drawn(lifecycle, initial, settled, dt, p_gate, threshold, spread, rng, real=True),
                 _drawn(lifecycle, initial, settled, dt, p_gate, threshold, spread, rng, real=False)[0])  # fmt: skip


def _drawn(
    lifecycle: Lifecycle, initial: float, settled: Settled, dt: float, p_gate: float, threshold: float, spread: Array,
    rng: np.random.Generator, *, real: bool,
) -> tuple[float, float]:  # fmt: skip
    """Return the shares that were confirmed ever, and that are confirmed at the end.

    In each scan false returns fall uniformly into the gate, and a target's, with P_D P_G, by the chi-square law within it.
    The existence is that of integrated probabilistic data association, L = 1 - P_D P_G + sum P_D N(d^2) / clutter.
    """
    m, volumes = settled.R.shape[-1], settled.gate_volumes(threshold)
    existence = np.full(TRACKS, 1.0 if lifecycle.certain else initial)
    memory, alive = lifecycle.start(existence), np.ones(TRACKS, dtype=bool)
    ever, confirmed = np.zeros(TRACKS, dtype=bool), np.zeros(TRACKS, dtype=bool)
    detects, seen = settled.detects, settled.detects * p_gate
    for i in range(LOOKS):
        at = min(i, len(volumes) - 1)
        log_peak = -0.5 * m * np.log(2 * np.pi) - 0.5 * np.linalg.slogdet(settled.S[at])[1]
        count = np.minimum(rng.poisson(min(settled.density * volumes[at], MOST / 2), TRACKS), MOST)
        many = int(np.max(count))
        distance = threshold * rng.uniform(size=(TRACKS, many)) ** (2 / m)
        distances = 2.0 * gammaincinv(m / 2, p_gate * rng.uniform(size=TRACKS))
        hits = rng.uniform(size=TRACKS) < (seen if real else 0.0)
        dense = max(settled.density, 1e-300)
        false = np.where(np.arange(many) < count[:, None], np.exp(log_peak - 0.5 * distance), 0.0).sum(axis=1)
        some = detects * (false + hits * np.exp(log_peak - 0.5 * distances)) / dense
        ratio = np.minimum(1.0 - seen + some, 1e200)
        hit = np.where(ratio > 0, np.minimum(some, 1e200) / np.maximum(ratio, 1e-300), 0.0)
        if not lifecycle.certain:
            existence = lifecycle.predict(existence, dt)
            existence = existence * ratio / np.maximum(1.0 - existence + existence * ratio, 1e-300)
        wide = np.full(TRACKS, spread[at]) if lifecycle.needs_spread else None
        memory, confirmed, lives_on = lifecycle.review(memory, Review(dt, existence, hit, np.full(TRACKS, detects), wide))
        alive = alive & lives_on
        confirmed = confirmed & alive
        ever = ever | confirmed
    return float(np.mean(ever)), float(np.mean(confirmed[ever])) if np.any(ever) else 0.0
