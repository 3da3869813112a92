"""The kernels in numpy: the fallback if nothing is compiled, and the oracle for what is.

Shapes: `*b` batch axes, `t` tracks (or any further batch axis), `k` returns, `n` state, `m` measured, `r` modes, `s` points.
An axis written `1|k` has one entry for all returns if they share a noise, else one each.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from vedette.kernels.results import Evaluated, Points, Step, Updated
from vedette.kernels.square_root import bounded_root, keeps_digits, pivots_exceed, square_root_update
from vedette.space import Array, Mask, Periods, wrapped
from vedette.types import Gaussian, Hypotheses, Innovation

_TINY = float(np.finfo(float).tiny)
_LEAST_EXPONENT = float(np.log(_TINY))
_LOG_2PI = float(np.log(2.0 * np.pi))
_SINGULAR = 1e-12  # an S with a smaller pivot than this part of its diagonal is updated by its root


def safe_log(p: Array) -> Array:
    """Return the logarithm of probabilities and densities, no less than that of the smallest normal number: about -708."""
    return np.log(np.maximum(p, _TINY))


def exp_or_zero(a: Array) -> Array:
    """Return exp(a), 0 where that would be subnormal: arithmetic on such numbers is many times slower."""
    return np.exp(np.where(a < _LEAST_EXPONENT, -np.inf, a))


def normal_or_zero(weights: Array) -> Array:
    """Return weights >= 0, with subnormal ones as 0."""
    return np.where(weights < _TINY, 0.0, weights)


def log_sum(a: Array, axis: int = -1) -> Array:
    """Return the logarithm of sum exp(a) over `axis`; -inf where every term is."""
    top = np.max(a, axis=axis, keepdims=True)
    top = np.where(np.isfinite(top), top, 0.0)
    with np.errstate(divide="ignore", under="ignore"):
        total: Array = np.log(np.sum(np.exp(a - top), axis=axis)) + np.squeeze(top, axis)
    return total


def symmetric(a: Array) -> Array:
    """Return the mean of `a` and its transpose, which removes asymmetry by rounding."""
    return 0.5 * (a + np.swapaxes(a, -1, -2))


def propagate(P: Array, F: Array, Q: Array) -> Array:
    """Return F P F' + Q: (*b, n, n)."""
    return symmetric(F @ P @ np.swapaxes(F, -1, -2) + Q)


def predict(x: Array, P: Array, F: Array, Q: Array) -> Gaussian:
    """Return F x (*b, n) and F P F' + Q (*b, n, n); F and Q (n, n) or (*b, n, n)."""
    return Gaussian((F @ x[..., None])[..., 0], propagate(P, F, Q))


def over_axes(block: Array | Sequence[Sequence[float]], count: int) -> Array:
    """Return a matrix (p, p) over one axis' derivatives as (p count, p count), alike for all axes: x, y, .. vx, vy, .."""
    p, axes = len(block), range(count)
    whole = np.zeros((p, count, p, count))
    whole[:, axes, :, axes] = block
    return whole.reshape(p * count, p * count)


def _invert(S: Array) -> tuple[Array, Array, Mask]:
    """Return inverse (*b, m, m) and log determinant (*b) of a positive definite S, and where it is not near singular.

    It uses LDL' for m <= 2, as LAPACK costs more.
    """
    m = S.shape[-1]
    if m == 1:
        return 1.0 / S, np.log(S[..., 0, 0]), S[..., 0, 0] > 0.0
    if m == 2:
        d1 = np.where(S[..., 0, 0] > 0.0, S[..., 0, 0], np.nan)
        slope = S[..., 1, 0] / d1
        d2 = S[..., 1, 1] - slope * S[..., 1, 0]
        sound = d2 > _SINGULAR * S[..., 1, 1]
        d2 = np.where(sound, d2, np.nan)
        inverse = np.empty_like(S)
        inverse[..., 1, 1] = 1.0 / d2
        inverse[..., 0, 1] = inverse[..., 1, 0] = -slope / d2
        inverse[..., 0, 0] = 1.0 / d1 + slope * slope / d2
        return inverse, np.log(d1) + np.log(d2), sound
    try:
        lower = np.linalg.cholesky(S)
    except np.linalg.LinAlgError:
        lower = np.linalg.cholesky(np.where(pivots_exceed(S, _SINGULAR)[..., None, None], S, np.eye(m)))
    pivots = np.diagonal(lower, axis1=-2, axis2=-1)
    sound = np.all(pivots**2 > _SINGULAR * np.diagonal(S, axis1=-2, axis2=-1), axis=-1)
    root = np.linalg.inv(lower)
    return np.swapaxes(root, -1, -2) @ root, 2.0 * np.sum(np.log(pivots), axis=-1), sound


def _each(rows: Array, matrix: Array) -> Array:
    """Multiply rows (*b, k, m) by matrix (*b, 1|k, m, p): (*b, k, p), in one product if the matrix is shared."""
    shared = matrix.shape[-3] == 1
    return np.asarray(rows @ matrix[..., 0, :, :] if shared else (rows[..., None, :] @ matrix)[..., 0, :])


def _score(nu: Array, inverse: Array, log_det: Array) -> tuple[Array, Array, Array]:
    """Return log N(nu; 0, S), squared distance and half log |S| of residuals nu (*b, k, m) with S^-1 (*b, 1|k, m, m)."""
    distance = np.sum(_each(nu, inverse) * nu, axis=-1)
    return -0.5 * (distance + log_det + nu.shape[-1] * _LOG_2PI), distance, 0.5 * log_det


def evaluate(P: Array, nu: Array, H: Array, R: Array) -> Evaluated:
    """Evaluate returns against predicted tracks, z = H x + v.

    P (*b, t, n, n), nu (*b, t, k, m), H (*b, t, m, n) or (m, n), R (*b, t, 1|k, m, m) ->
    log N(nu; 0, S) (*b, t, k), squared distance (*b, t, k), log sqrt|S| (*b, t, 1|k), the mean's shift (*b, t, k, n),
    and the posterior covariance (*b, t, 1|k, n, n): in Joseph's form, or by roots where that would lose precision.
    """
    cross = P @ np.swapaxes(H, -1, -2)
    S = symmetric(H @ cross)[..., None, :, :] + R
    inverse, log_det, sound = _invert(S)
    P, H = P[..., None, :, :], H[..., None, :, :]
    gain = cross[..., None, :, :] @ inverse
    keep = np.eye(P.shape[-1]) - gain @ H
    post = symmetric(keep @ P @ np.swapaxes(keep, -1, -2) + gain @ R @ np.swapaxes(gain, -1, -2))
    hard = ~(sound & keeps_digits(post, P))
    if hard.any():
        rows = np.swapaxes(bounded_root(_of(P, hard)), -1, -2)
        by_root = square_root_update(rows, rows @ np.swapaxes(_of(H, hard), -1, -2), _of(R, hard))
        inverse[hard], log_det[hard], post[hard] = by_root.inverse, by_root.log_det, by_root.post
        gain[hard] = np.swapaxes(by_root.gain, -1, -2)
    loglik, distance, log_volume = _score(nu, inverse, log_det)
    return Evaluated(loglik, distance, log_volume, _each(nu, np.swapaxes(gain, -1, -2)), post)


def gains(P: Array, H: Array, R: Array) -> tuple[Array, Array, Array]:
    """Return S^-1 (*b, m, m), log |S| (*b) and the gain (*b, n, m) of z = H x + v: by roots where S is near singular.

    P (*b, n, n), H (*b, m, n), R (*b, m, m), each broadcast.
    """
    H_t = np.swapaxes(H, -1, -2)

    def rows(hard: Mask) -> tuple[Array, Array]:
        root_t = np.swapaxes(bounded_root(_of(P, hard)), -1, -2)
        return root_t, root_t @ _of(H_t, hard)

    return _gains(P @ H_t, H @ P @ H_t, R, rows)


def gains_of_points(dx: Array, dz: Array, R: Array) -> tuple[Array, Array, Array]:
    """Return `gains` for points: differences dx (*b, s, n) and dz (*b, s, m) from their means, times roots of weights."""
    seen = np.swapaxes(dz, -1, -2)
    return _gains(np.swapaxes(dx, -1, -2) @ dz, seen @ dz, R, lambda hard: (_of(dx, hard), _of(dz, hard)))


def _gains(cross: Array, seen: Array, R: Array, rows: Callable[[Mask], tuple[Array, Array]]) -> tuple[Array, Array, Array]:
    inverse, log_det, sound = _invert(symmetric(seen) + R)
    gain = cross @ inverse
    if not sound.all():
        hard = ~sound
        by_root = square_root_update(*rows(hard), _of(R, hard))
        inverse[hard], log_det[hard], gain[hard] = by_root[0], by_root[1], np.swapaxes(by_root[2], -1, -2)
    return inverse, log_det, gain


def _of(matrices: Array, which: Mask) -> Array:
    """Select the matrices, broadcast over the mask, that it marks."""
    return np.asarray(np.broadcast_to(matrices, (*which.shape, *matrices.shape[-2:]))[which])


def evaluate_returns(
    P: Array, z: Array, expected: Array, H: Array, R: Array, p_detect: Array | float, p_gate: float, periods: Periods
) -> Innovation:
    """`evaluate` the returns of a scan z (*b, k, m) against tracks that expect (*b, t, m), with P_D (*b, t) and P_G.

    `expected` may have more axes, as a state has: the first m count. periods: index and period of measured axes that wrap.
    Gives log (1 - P_D P_G) and log P_D + log N(..) in (*b, t, 1+k), squared distance (*b, t, k), the largest log sqrt|S|
    (*b, t), and as detail the `Hypotheses` of `evaluate`.
    """
    nu = wrapped(z[..., None, :, :] - expected[..., :, None, : z.shape[-1]], periods)
    seen, p_detect = evaluate(P, nu, H, R), np.asarray(p_detect)
    loglik = np.empty((*seen.loglik.shape[:-1], 1 + seen.loglik.shape[-1]))
    loglik[..., 0] = safe_log(1.0 - p_detect * p_gate)
    loglik[..., 1:] = seen.loglik + safe_log(p_detect)[..., None]
    volume = np.broadcast_to(np.max(seen.log_volume, axis=-1, initial=-np.inf), loglik.shape[:-1])
    return Innovation(loglik, seen.distance, volume, seen.distance, Hypotheses(seen.shift, seen.post))


def update(x: Array, P: Array, z: Array, H: Array, R: Array) -> Updated:
    """Update by one return that is the target's, z = H x + v (*b, m): x (*b, n), P (*b, n, n), log N(z; H x, S) (*b).

    H (m, n) or (*b, m, n), R (m, m) or (*b, m, m); angles as they are.
    """
    nu = z - (H @ x[..., None])[..., 0]
    seen = evaluate(P, nu[..., None, :], H, R[..., None, :, :])
    return Updated(x + seen.shift[..., 0, :], seen.post[..., 0, :, :], seen.loglik[..., 0])


def filter_step(x: Array, P: Array, F: Array, Q: Array, z: Array, H: Array, R: Array) -> Updated:
    """`predict`, then `update`: one step of the Kalman filter."""
    ahead = predict(x, P, F, Q)
    return update(ahead.mean, ahead.cov, z, H, R)


def root(P: Array) -> Array:
    """Return L (*b, n, n), lower triangular, with L L' = P (*b, n, n): Cholesky's, but singular covariances are allowed.

    A pivot within rounding error counts as zero, and its column with it: an axis without variance gets none at all.
    """
    n = P.shape[-1]
    scale = np.diagonal(P, axis1=-2, axis2=-1)
    lower = np.zeros(P.shape)
    for j in range(n):
        column = P[..., j:, j] - (lower[..., j:, :j] @ lower[..., j, :j, None])[..., 0]
        free = column[..., 0] > 8 * n * np.finfo(float).eps * scale[..., j]
        pivot = np.sqrt(np.where(free, column[..., 0], 1.0))
        lower[..., j:, j] = np.where(free[..., None], column / pivot[..., None], 0.0)
    return lower


def reweigh_particles(log_weights: Array, likelihoods: Array, loglik: Array, weights: Array) -> Array:
    """Return log weights (*b, t, p), which sum to 1, of points that association reweights by sum_i W_i l_i(x) / l_i.

    likelihoods (*b, t, 1+k, p), loglik and association weights (*b, t, 1+k). If nothing is possible, they stay as they are.
    """
    with np.errstate(divide="ignore"):
        log_share = np.log(weights) - np.where(np.isfinite(loglik), loglik, 0.0)
    total = log_sum(likelihoods + log_share[..., None], axis=-2)
    total = log_weights + np.where(np.isfinite(np.max(total, axis=-1, keepdims=True)), total, 0.0)
    return total - log_sum(total)[..., None]


def whiten(vector: Array, cov: Array) -> Array:
    """Return L^-1 v with cov = L L': (*b, n), (*b, n, n) -> (*b, n). Axes without variance give 0.

    On matched truth the result is N(0, I). ValueError if `cov` is not positive definite on the other axes.
    """
    variance = np.diagonal(cov, axis1=-2, axis2=-1)
    if not np.all(variance >= 0):  # also False for NaN
        raise ValueError(f"cov: variances must be >= 0, got {np.min(variance):.6g}")
    free = variance > 0
    scale = np.where(free, np.sqrt(variance), 1.0)
    correlation = cov / (scale[..., :, None] * scale[..., None, :])
    correlation[..., range(cov.shape[-1]), range(cov.shape[-1])] = 1.0
    try:
        root = np.linalg.cholesky(correlation)
    except np.linalg.LinAlgError:
        raise ValueError("cov: must be positive definite on its axes of variance > 0") from None
    white: Array = np.where(free, vector, 0.0) / scale
    for j in range(cov.shape[-1]):
        known = np.sum(root[..., j, :j] * white[..., :j], axis=-1)
        white[..., j] = (white[..., j] - known) / root[..., j, j]
    return white


def sigma_points(P: Array, kappa: float) -> Points:
    """Return offsets (*b, 2n+1, n) from the mean and weights (2n+1,) that have mean 0 and covariance P (*b, n, n).

    Julier and Uhlmann's symmetric set. kappa >= 0 keeps every weight positive, so every moment taken with it is PSD.
    """
    n = P.shape[-1]
    spread = np.swapaxes(root((n + kappa) * P), -1, -2)
    offsets = np.concatenate([np.zeros((*P.shape[:-2], 1, n)), spread, -spread], axis=-2)
    weights = np.full(2 * n + 1, 0.5 / (n + kappa))
    weights[0] = kappa / (n + kappa)
    return Points(offsets, weights)


def evaluate_points(dx: Array, dz: Array, weights: Array, nu: Array, R: Array) -> Evaluated:
    """`evaluate` with points for the model: dx (*b, t, s, n) and dz (*b, t, s, m) differences from their means.

    The posterior covariance is the points' own after the gain, sum w (dx - K dz)(dx - K dz)' + K R K': PSD as they are.
    """
    weighted = np.swapaxes(dz * weights[:, None], -1, -2)
    inverse, log_det, sound = _invert(symmetric(weighted @ dz)[..., None, :, :] + R)
    gain_t = inverse @ (weighted @ dx)[..., None, :, :]
    left = dx[..., None, :, :] - dz[..., None, :, :] @ gain_t
    post = symmetric(np.swapaxes(left * weights[:, None], -1, -2) @ left + np.swapaxes(gain_t, -1, -2) @ R @ gain_t)
    if not sound.all():
        scale, hard = np.sqrt(weights)[:, None], ~sound
        rows, seen = _of((scale * dx)[..., None, :, :], hard), _of((scale * dz)[..., None, :, :], hard)
        by_root = square_root_update(rows, seen, _of(R, hard))
        inverse[hard], log_det[hard], gain_t[hard], post[hard] = by_root
    loglik, distance, log_volume = _score(nu, inverse, log_det)
    return Evaluated(loglik, distance, log_volume, _each(nu, gain_t), post)


def mixture(P: Array, shift: Array, post: Array, weights: Array) -> Step:
    """Return the moments of a track's hypotheses: a miss (weight 0, covariance P) or return i (weight i, shift i, post).

    P (*b, t, n, n), shift (*b, t, k, n), post (*b, t, 1|k, n, n), weights (*b, t, 1+k) -> shift of the mean (*b, t, n) and
    covariance (*b, t, n, n), the spread of the means included.
    """
    miss, w = weights[..., :1], weights[..., 1:]
    mean: Array = (w[..., None, :] @ shift)[..., 0, :]
    apart = shift - mean[..., None, :]
    spread = np.swapaxes(apart * w[..., None], -1, -2) @ apart + miss[..., None] * (mean[..., :, None] * mean[..., None, :])
    if post.shape[-3] == 1:
        within = np.sum(w, axis=-1)[..., None, None] * post[..., 0, :, :]
    else:
        within = np.sum(w[..., None, None] * post, axis=-3)
    return Step(mean, symmetric(miss[..., None] * P + within + spread))


def weighted_update(x: Array, P: Array, shift: Array, post: Array, weights: Array, periods: Periods) -> Gaussian:
    """Return `mixture`, with the mean x (*b, t, n) moved by its shift; periods: index and period of state axes that wrap."""
    mixed = mixture(P, shift, post, weights)
    return Gaussian(wrapped(x + mixed.shift, periods), mixed.cov)


def moments(weights: Array, xs: Array, Ps: Array) -> Gaussian:
    """Return mean (*b, q, n) and covariance (*b, q, n, n) of q Gaussian mixtures of the same r parts.

    weights (*b, q, r), xs (*b, r, n), Ps (*b, r, n, n)
    """
    n = xs.shape[-1]
    mean = weights @ xs
    apart = xs[..., None, :, :] - mean[..., None, :]
    spread = np.swapaxes(apart * weights[..., None], -1, -2) @ apart
    within = (weights @ Ps.reshape(*Ps.shape[:-2], n * n)).reshape(spread.shape)
    return Gaussian(mean, symmetric(within + spread))


def pda_update(
    xs: Array, Ps: Array, z: Array, H: Array, R: Array, p_detect: float, p_gate: float, limit: float, log_density: float
) -> Updated:
    """Update each of a target's modes by returns z (*b, k, m) of which at most one is the target's, z = H x + v.

    xs (*b, r, n), Ps (*b, r, n, n), H (m, n) or (*b, m, n), R (m, m) or (*b, m, m); angles as they are. A return counts if
    its squared distance from any mode is within `limit`. Gives the moments of each mode's hypotheses, and the log-likelihood
    of the scan (*b, r) relative to clutter of this log density.
    """
    H = H[..., None, :, :]
    nu = z[..., None, :, :] - (H @ xs[..., None])[..., None, :, 0]
    seen = evaluate(Ps, nu, H, R[..., None, None, :, :])
    scores = np.empty((*seen.loglik.shape[:-1], 1 + seen.loglik.shape[-1]))
    scores[..., 0] = safe_log(np.asarray(1.0 - p_detect * p_gate))
    inside = np.min(seen.distance, axis=-2, keepdims=True) <= limit
    scores[..., 1:] = np.where(inside, seen.loglik + safe_log(np.asarray(p_detect)) - log_density, -np.inf)
    total = log_sum(scores)
    mixed = mixture(Ps, seen.shift, seen.post, exp_or_zero(scores - total[..., None]))
    return Updated(xs + mixed.shift, mixed.cov, total)


Generators = Sequence[np.random.Generator]


def normals(rngs: Generators, shape: tuple[int, ...]) -> Array:
    """Draw standard normal numbers (r, *shape), row i from generator i. No other thread may draw from them meanwhile."""
    return _filled((len(rngs), *shape), (rng.standard_normal(shape) for rng in rngs))


def uniforms(rngs: Generators, shape: tuple[int, ...]) -> Array:
    """Draw uniform numbers in [0, 1) (r, *shape), row i from generator i. No other thread may draw from them meanwhile."""
    return _filled((len(rngs), *shape), (rng.random(shape) for rng in rngs))


def _filled(shape: tuple[int, ...], rows: Iterator[Array]) -> Array:
    """Return an array of these rows, which are not held twice."""
    whole = np.empty(shape)
    for i, row in enumerate(rows):
        whole[i] = row
    return whole
