"""Targets that a sensor cannot tell apart: two rows that may give one return, and what it says of each of them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from attrs import frozen

from vedette import Array, Detections, Indices, Mask, Space
from vedette.tracking import Expected

LIKELY = 1e-3
"""Two rows are close if both exist and merge by more than this probability."""

SURE = 1e-9
"""No two rows are taken to merge more surely than 1 less this."""


@frozen(eq=False)
class Close:
    """Pairs (p, 2) of rows that may give one return, and the k returns.

    joint (p, k): the log scores of one return for both; apart: of some pairs and returns, the log of the probability
    (p, k, k) that they were resolved, if each gave one of its own. z (p, 2, k, m) and noise (p, 2, 1, m, m): what a return
    for both says of each, as a return of its own; columns (p, 2): the place of these k among those of each row, as it meets
    them.
    """

    pairs: Indices
    joint: Array
    apart: Callable[[Indices, Indices], Array]
    z: Array
    noise: Array
    columns: Indices | None = None


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
    reach = -2.0 * np.log(LIKELY) * (variance[:, None] + variance)
    i, j = np.nonzero(np.triu(np.all(space.difference(h[None], h[:, None]) ** 2 <= reach, axis=-1), 1))
    d, wide = space.difference(h[j], h[i]), C[i] + S[i] + S[j]
    log_merge = _log_merge(C[i], wide, d)
    near = (log_merge + np.log(np.maximum(e[i] * e[j], 1e-300)) > np.log(LIKELY)) & observed.valid.any()
    if together is not None and near.any():
        near[near] = together(np.stack([i[near], j[near]], axis=-1))
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
    seen = space.difference(observed.z[None], h[i][:, None])
    joint = log_merge[:, None] + _log_normal(seen - middle[:, None], cov[:, None]) - log_density
    with np.errstate(divide="ignore"):
        joint += np.log(e[i] * e[j] * detects[i] * detects[j])[:, None]
    joint = np.where(observed.valid, joint, -np.inf)
    if observed.evidence is not None:
        joint = joint + observed.evidence
    told = [
        _told(S[other], R[own], C, sign * d, space.difference(observed.z[None], h[own][:, None]))
        for own, other, sign in ((i, j, 1.0), (j, i, -1.0))
    ]
    z = np.stack([space.displace(h[own][:, None], one[0]) for own, one in zip((i, j), told, strict=True)], axis=1)
    noise = np.stack([one[1] for one in told], axis=1)

    def apart(some: Indices, returns: Indices) -> Array:
        return _apart(S, R, C[some], h, observed.z[returns], pairs[some], space)

    return Close(pairs, joint, apart, z, noise[:, :, None])


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
    """Return what one return for both says of h(x) of one row: the step (p, k, m) from its mean, and covariance (p, m, m).

    S: of the other row, d (p, m): from this one to it; seen (p, k, m): from this one to each return. Given h, the other is
    N(h + W (d - (h - mean)), V) and the return (h + other) / 2 + noise; that they merged is a return of the other's mean.
    """
    near = np.linalg.inv(C + S)
    W, V = C @ near, C - C @ near @ C
    A = np.eye(C.shape[-1]) - 0.5 * W
    weight = np.swapaxes(A, -1, -2) @ np.linalg.inv(R + 0.25 * V)
    noise = np.linalg.inv(near + weight @ A)
    noise = 0.5 * (noise + np.swapaxes(noise, -1, -2))
    beyond = seen - 0.5 * (W @ d[..., None])[..., 0][:, None]
    step = (near @ d[..., None])[..., 0][:, None] + (weight[:, None] @ beyond[..., None])[..., 0]
    return (noise[:, None] @ step[..., None])[..., 0], noise


def _apart(S: Array, R: Array, C: Array, h: Array, z: Array, pairs: Indices, space: Space) -> Array:
    """Return the log of the probability (p, k, k) that rows which took returns of their own were resolved."""
    gain = S @ np.linalg.inv(S + R)
    cov = S - gain @ S
    i, j = pairs.T
    there, here = ((gain[at][:, None] @ space.difference(z[None], h[at][:, None])[..., None])[..., 0] for at in (j, i))
    d = space.difference(h[j], h[i])[:, None, None] + there[:, None] - here[:, :, None]
    merged = _log_merge(C, C + cov[i] + cov[j], np.moveaxis(d, 0, -2))
    apart: Array = np.log1p(-np.minimum(np.exp(np.moveaxis(merged, -1, 0)), 1.0 - SURE))
    return apart
