"""Targets that a sensor cannot tell apart: two rows that may give one return, and what it says of each of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from attrs import frozen

from vedette import Array, Detections, Indices, Mask, Space, kernels
from vedette.tracking import Expected, Part, take

LIKELY = 1e-3
"""Two rows are close if both exist and merge by more than this probability."""

SURE = 1e-9
"""No two rows are taken to merge more surely than 1 less this."""


@frozen(eq=False)
class Close:
    """Pairs (p, 2) of rows that may give one return, and the k returns.

    joint (p, k): the log scores of one return for both, -inf where it is too far away; apart: of some pairs (s,) and returns
    (w,) or (s, w), the log of the probability (s, w, w) that they were resolved, if each gave one of its own. pair and
    returns (q,): which pair may give which return; z (q, 2, m) and noise (q, 2, m, m): what that says of each row, as a
    return of its own. columns (p, 2, k): the place of these among the returns that the row meets, -1: none; alone: how many
    of those are returns of it alone; met_z (r, w, m) and met_noise (r, w, m, m): all that it meets.
    """

    pairs: Indices
    joint: Array
    apart: Callable[[Indices, Indices], Array]
    pair: Indices
    returns: Indices
    z: Array
    noise: Array
    columns: Indices | None = None
    alone: int = 0
    met_z: Array | None = None
    met_noise: Array | None = None

    def column(self, pair: Indices | int, side: Indices | int, returns: Indices) -> Indices:
        """Return the place of a return for both among those that one of a pair meets."""
        assert self.columns is not None
        places: Indices = self.columns[pair, side, returns]
        return places

    def updated(
        self, it: Expected, part: Part, at: Indices, choice: Indices, merged: Indices | None, leaves: Indices
    ) -> Any:
        """Return the belief of `leaves` that continue rows `at` of the part, by what each took: `choice` (l, 1), alone or as
        the column `merged` of the row, both from 1.

        The one return is met again: of all that a row met, moments of the belief would be copied for each leaf.
        """
        assert self.met_z is not None
        assert self.met_noise is not None
        column = np.argmax(part.returns[at, : self.alone] == choice - 1, axis=1) if self.alone else np.zeros_like(at)
        if merged is not None:
            column = np.where(merged[leaves] > 0, merged[leaves] - 1, column)
        belief, hit = take(part.belief, at, 0), choice > 0
        seen = Detections(self.met_z[at, column][:, None], hit, None, self.met_noise[at, column][:, None])
        innovation = it.plan.estimator.evaluate(belief, it.sensor, seen, it.plan.p_gate)
        sure = np.concatenate([~hit, hit], axis=1)[:, None].astype(float)
        return it.plan.estimator.update(belief, innovation, sure)


def close_rows(
    it: Expected, observed: Detections, log_density: Array, together: Callable[[Indices], Mask] | None = None
) -> Close | None:
    """Return the pairs of rows that may give one of the returns; None where there is none. log_density (k,): of clutter.

    together: which pairs (p, 2) of rows can be of two targets at once; None: all.
    """
    sensor, state, e = it.sensor, it.plan.state, it.existence
    x = it.plan.estimator.moments(it.belief)
    where = state.locate(sensor.observes)
    C = sensor.unresolved(x.mean[..., where])
    if C is None or len(e) < 2 or not len(observed.z):
        return None
    h, S, _ = it.returns_of(x, np.zeros((m := len(sensor.measurement), m)))
    C = np.broadcast_to(C, S.shape)
    space, variance = sensor.measurement, np.einsum("...ii->...i", S) + 0.5 * np.einsum("...ii->...i", C)
    i, j = _within(h, np.sqrt(-2.0 * np.log(LIKELY) * variance), space)
    if together is not None:
        some = together(np.stack([i, j], axis=-1))
        i, j = i[some], j[some]
    d, wide = space.difference(h[j], h[i]), C[i] + S[i] + S[j]
    log_merge = _log_merge(C[i], wide, d)
    near = (log_merge + np.log(np.maximum(e[i] * e[j], 1e-300)) > np.log(LIKELY)) & observed.valid.any()
    if not near.any():
        return None
    i, j, d, wide, C, log_merge = i[near], j[near], d[near], wide[near], C[i[near]], log_merge[near]
    pairs = np.stack([i, j], axis=-1)
    R = np.broadcast_to(sensor.mean_noise(x.mean[..., where], x.cov[..., where, :][..., where]), S.shape)
    detects = np.broadcast_to(sensor.detects(x.mean[..., where]), e.shape)

    # The middle, given that both are in one cell: c = h_i + d / 2, its covariance with d is (S_j - S_i) / 2.
    half = 0.5 * (S[j] - S[i]) @ np.linalg.inv(wide)
    middle = 0.5 * d - (half @ d[..., None])[..., 0]
    cov = 0.25 * (S[i] + S[j]) - half @ (0.5 * (S[j] - S[i])) + R[i]
    pair, returns = _around(space.displace(h[i], middle), cov, observed, it.gate.threshold, space)
    seen = space.difference(observed.z[returns], h[i][pair])
    with np.errstate(divide="ignore"):
        both = log_merge + np.log(e[i] * e[j] * detects[i] * detects[j])
    score = both[pair] + _log_normal(seen - middle[pair], cov[pair]) - log_density[returns]
    if observed.evidence is not None:
        score = score + observed.evidence[returns]
    joint = np.full((len(pairs), len(observed.z)), -np.inf)
    joint[pair, returns] = score
    z, noise = np.empty((len(pair), 2, m)), np.empty((len(pair), 2, m, m))
    for side, (own, other, sign) in enumerate(((i, j, 1.0), (j, i, -1.0))):
        seen = space.difference(observed.z[returns], h[own][pair])
        step, noise[:, side] = _told(S[other][pair], R[own][pair], C[pair], sign * d[pair], seen)
        z[:, side] = space.displace(h[own][pair], step)

    def apart(some: Indices, of: Indices) -> Array:
        return _apart(S, R, C[some], h, observed.z[np.broadcast_to(of, (len(some), of.shape[-1]))], pairs[some], space)

    return Close(pairs, joint, apart, pair, returns, z, noise)


def _within(h: Array, reach: Array, space: Space) -> tuple[Indices, Indices]:
    """Return the pairs (p,), (p,) of rows that differ on each axis by no more than their `reach` (t, m) allows, added up."""
    t, common = len(h), 4.0 * np.median(reach, axis=0)
    wide = np.any(reach > common, axis=1)
    # Those that are wide find all others, which need then not be as wide as to find them.
    half = reach + np.where(wide[:, None], np.max(reach, axis=0), common)
    first, second = kernels.pairs_in_boxes(h - half, h + half, h, space.periods, t * t)
    i, j = np.divmod(np.unique(np.minimum(first, second) * t + np.maximum(first, second)), t)
    near = (i < j) & np.all(space.difference(h[i], h[j]) ** 2 <= reach[i] ** 2 + reach[j] ** 2, axis=-1)
    return i[near], j[near]


def _around(middle: Array, cov: Array, observed: Detections, threshold: float, space: Space) -> tuple[Indices, Indices]:
    """Return the pairs (q,), (q,) of a middle (p, m) and a return about it, twice as far as the gate goes."""
    p, k = len(middle), len(observed.z)
    if not np.isfinite(threshold):
        pair, returns = np.divmod(np.arange(p * k), k)
    else:
        half = 2.0 * np.sqrt(threshold * np.einsum("...ii->...i", cov))
        pair, returns = kernels.pairs_in_boxes(middle - half, middle + half, observed.z, space.periods, p * k)
    counts = np.broadcast_to(observed.valid, k)[returns]
    return pair[counts], returns[counts]


def _log_merge(C: Array, wide: Array, d: Array) -> Array:
    """Return the log of the mean of exp(-d' C^-1 d / 2) over N(d, wide - C), (*b, m, m) and (*b, m)."""
    half = 0.5 * (np.linalg.slogdet(C)[1] - np.linalg.slogdet(wide)[1])
    log: Array = half - 0.5 * np.sum(d * np.linalg.solve(wide, d[..., None])[..., 0], axis=-1)
    return log


def _log_normal(d: Array, cov: Array) -> Array:
    """Return log N(d; 0, cov): (*b, m), (*b, m, m) -> (*b)."""
    square = np.sum(d * np.linalg.solve(np.broadcast_to(cov, (*d.shape, d.shape[-1])), d[..., None])[..., 0], axis=-1)
    log: Array = -0.5 * (square + np.linalg.slogdet(cov)[1] + d.shape[-1] * np.log(2 * np.pi))
    return log


def _told(S: Array, R: Array, C: Array, d: Array, seen: Array) -> tuple[Array, Array]:
    """Return what one return for both says of h(x) of one row: the step (q, m) from its mean, and covariance (q, m, m).

    S: of the other row, d (q, m): from this one to it; seen (q, m): from this one to the return. Given h, the other is
    N(h + W (d - (h - mean)), V) and the return (h + other) / 2 + noise; that they merged is a return of the other's mean.
    """
    near = np.linalg.inv(C + S)
    W, V = C @ near, C - C @ near @ C
    A = np.eye(C.shape[-1]) - 0.5 * W
    weight = np.swapaxes(A, -1, -2) @ np.linalg.inv(R + 0.25 * V)
    noise = np.linalg.inv(near + weight @ A)
    noise = 0.5 * (noise + np.swapaxes(noise, -1, -2))
    beyond = seen - 0.5 * (W @ d[..., None])[..., 0]
    step = (near @ d[..., None])[..., 0] + (weight @ beyond[..., None])[..., 0]
    return (noise @ step[..., None])[..., 0], noise


def _apart(S: Array, R: Array, C: Array, h: Array, z: Array, pairs: Indices, space: Space) -> Array:
    """Return the log of the probability (p, w, w) that rows which took returns z (p, w, m) of their own were resolved."""
    i, j = pairs.T
    steps, left = [], []
    for at in (i, j):
        gain = S[at] @ np.linalg.inv(S[at] + R[at])
        left.append(S[at] - gain @ S[at])
        steps.append(space.difference(z, h[at][:, None]) @ np.swapaxes(gain, -1, -2))
    d = space.difference(h[j], h[i])[:, None, None] + steps[1][:, None] - steps[0][:, :, None]
    wide = C + left[0] + left[1]
    factor = 0.5 * (np.linalg.slogdet(C)[1] - np.linalg.slogdet(wide)[1])[:, None, None]
    square = np.einsum("pabi,pij,pabj->pab", d, np.linalg.inv(wide), d)
    apart: Array = np.log1p(-np.minimum(np.exp(factor - 0.5 * square), 1.0 - SURE))
    return apart
