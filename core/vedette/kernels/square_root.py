"""The update of a covariance by its root, for cases in which any other form would lose its digits."""

from __future__ import annotations

import numpy as np

from vedette.kernels.results import ByRoot
from vedette.space import Array, Mask

_ROUNDING = 1e-15  # a variance's part that rounding leaves in doubt
_LOST = 1e-10  # the least part of a variance that an update by other forms may leave of it


def bounded_root(P: Array) -> Array:
    """Return L (*b, n, n), lower triangular, with L L' = P (*b, n, n), with no pivot below the rounding error.

    A pivot less than that fraction of its variance is raised to it, and what it says of other axes, which is rounding, is
    bounded by what is left of their variances: so P may be singular, or indefinite by rounding.
    """
    L = np.zeros_like(P)
    variances = np.diagonal(P, axis1=-2, axis2=-1)
    for j in range(P.shape[-1]):
        column = P[..., j:, j] - (L[..., j:, :j] @ L[..., j, :j, None])[..., 0]
        variance = P[..., j, j, None]
        raised = column[..., :1] < _ROUNDING * variance
        column[..., :1] = np.maximum(column[..., :1], _ROUNDING * variance)
        known = variance <= 0
        entries = np.where(known, 0.0, column / np.sqrt(np.where(known, 1.0, column[..., :1])))
        if raised.any():
            left = variances[..., j:] - np.sum(L[..., j:, :j] ** 2, axis=-1)
            most = np.sqrt(np.maximum(left, _ROUNDING * np.maximum(variances[..., j:], 0.0)))
            entries = np.where(raised, np.clip(entries, -most, most), entries)
        L[..., j:, j] = entries
    return L


def pivots_exceed(A: Array, least: float) -> Mask:
    """Return whether all pivots of A (*b, n, n), of its LDL', are at least this fraction of its diagonal: (*b)."""
    L, D = np.zeros_like(A), np.zeros(A.shape[:-1])
    good = np.ones(A.shape[:-2], bool)
    for j in range(A.shape[-1]):
        column = A[..., j:, j] - ((L[..., j:, :j] * D[..., None, :j]) @ L[..., j, :j, None])[..., 0]
        D[..., j] = column[..., 0]
        good &= column[..., 0] >= least * A[..., j, j]
        L[..., j:, j] = column / np.where(D[..., j] > 0, D[..., j], np.inf)[..., None]
    return good


def keeps_digits(post: Array, P: Array) -> Mask:
    """Return whether post (*b, n, n) is positive definite, and its variances not too small against P to keep digits."""
    variances = np.diagonal(post, axis1=-2, axis2=-1)
    kept: Mask = np.all(variances >= _LOST * np.diagonal(P, axis1=-2, axis2=-1), axis=-1)
    try:
        np.linalg.cholesky(post + (variances == 0.0)[..., None] * np.eye(post.shape[-1]))  # what is known exactly may be so
    except np.linalg.LinAlgError:
        kept &= pivots_exceed(post, 1e-13)
    return kept


def triangular(A: Array) -> Array:
    """Return upper triangular U (*b, q, q) with U' U = A' A, of A (*b, p, q), by Householder's reflections.

    The row with the largest entry of each column comes first, or large rows would drown the small ones.
    """
    p, q = A.shape[-2:]
    A = np.concatenate([A, np.zeros((*A.shape[:-2], max(q - p, 0), q))], axis=-2)
    for j in range(q):
        below = A[..., j:, j:]
        first = np.argmax(np.abs(below[..., 0]), axis=-1)[..., None, None]
        swapped = np.take_along_axis(below, first, axis=-2)
        np.put_along_axis(below, first, below[..., :1, :].copy(), axis=-2)
        below[..., :1, :] = swapped
        normal = below[..., 0].copy()
        end = -np.copysign(np.linalg.norm(normal, axis=-1), normal[..., 0])
        normal[..., 0] -= end
        over = end * normal[..., 0]
        step = (normal[..., None, :] @ below) / np.where(over == 0.0, 1.0, over)[..., None, None]
        below += normal[..., :, None] * step
        below[..., 1:, 0] = 0.0
    return A[..., :q, :]


def square_root_update(prior: Array, measured: Array, R: Array) -> ByRoot:
    """Return S^-1 (*b, m, m), log |S| (*b), the gain transposed (*b, m, n) and the posterior covariance (*b, n, n).

    P = prior' prior (*b, s, n), H P = measured' prior (*b, s, m), S = measured' measured + R (*b, m, m). All come of one
    orthogonal triangularisation of [R^1/2', 0; measured, prior] (Kaminski, Bryson and Schmidt, IEEE TAC 16, 1971).
    """
    m, n = R.shape[-1], prior.shape[-1]
    noise = np.swapaxes(bounded_root(R), -1, -2)
    above = np.concatenate([noise, np.zeros((*noise.shape[:-1], n))], axis=-1)
    upper = triangular(np.concatenate([above, np.concatenate([measured, prior], axis=-1)], axis=-2))
    pivots = np.diagonal(upper, axis1=-2, axis2=-1)[..., :m]
    root = np.zeros_like(R)  # the inverse of the root of S
    for j in range(m):
        root[..., j, j] = 1.0 / np.where(pivots[..., j] == 0.0, np.nan, pivots[..., j])
        root[..., :j, j] = -(root[..., :j, :j] @ upper[..., :j, j, None])[..., 0] * root[..., j, j, None]
    rest = upper[..., m:, m:]
    post = np.swapaxes(rest, -1, -2) @ rest
    log_det = 2.0 * np.sum(np.log(np.abs(pivots)), axis=-1)
    gain = root @ upper[..., :m, m:]
    return ByRoot(root @ np.swapaxes(root, -1, -2), log_det, gain, 0.5 * (post + np.swapaxes(post, -1, -2)))


def lower_triangular(wide: Array) -> Array:
    """Return the lower triangular L (*b, n, n) with L L' = A A' for A (*b, n, p), p >= n."""
    return np.swapaxes(np.linalg.qr(np.swapaxes(wide, -1, -2), mode="r"), -1, -2).copy()
