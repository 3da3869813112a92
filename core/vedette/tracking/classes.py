"""Classes by which returns name their objects, as a camera's detector does: many objects share one, some are confused."""

from __future__ import annotations

import numpy as np

from vedette.space import Array, Indices, Mask

_SUM = 1e-6


def confusion_fault(table: Array) -> str | None:
    """Return what is wrong with a matrix of confusion, None if nothing is."""
    if len(table) < 2 or table.shape[0] != table.shape[1]:
        return f"must be square, a row and a column for each of two classes or more, got {table.shape[0]} x {table.shape[1]}"
    if np.any(table < 0) or np.any(np.abs(np.sum(table, axis=1) - 1.0) > _SUM):
        return "must hold probabilities, each row with the sum 1"
    return None


def shares_fault(shares: Array, classes: int) -> str | None:
    """Return what is wrong with the shares of so many classes, None if nothing is."""
    if len(shares) in (0, classes) and np.all(shares >= 0) and (not len(shares) or abs(np.sum(shares) - 1.0) <= _SUM):
        return None
    return f"must be {classes} probabilities with the sum 1, one for each row of `confusion`, got {shares.tolist()}"


def class_evidence(shares: Array, codes: Indices, confusion: Array, false: Array) -> Array:
    """Return log p(code | track) / p(code | no target) (*b, t, k), 0 for returns that name none.

    shares (*b, t, c): probabilities of the track's classes; codes (*b, k) or (*b, t, k); false (c,): of what is no target.
    """
    known = _known(codes, confusion)
    of_track = shares @ confusion
    seen = np.where(known, codes, 0)
    if seen.ndim < of_track.ndim:
        seen, known = seen[..., None, :], known[..., None, :]
    seen = np.broadcast_to(seen, (*of_track.shape[:-1], seen.shape[-1]))
    other = false if len(false) else np.full(len(confusion), 1.0 / len(confusion))
    with np.errstate(divide="ignore"):
        ratio: Array = np.where(known, np.log(np.take_along_axis(of_track, seen, -1)) - np.log(other[seen]), 0.0)
    return ratio


def given_classes(shares: Array, weights: Array, codes: Indices, confusion: Array) -> Array:
    """Return the classes (*b, t, c) of tracks after a scan, by weights (*b, t, 1+k) and the codes (*b, t, k) of returns.

    They are those given each return, weighted, as the classes and all else of a track are taken to be independent.
    """
    known = _known(codes, confusion)
    likely = shares[..., None, :] * confusion.T[np.where(known, codes, 0)]
    total = np.sum(likely, axis=-1, keepdims=True)
    given = np.where(known[..., None] & (total > 0), likely / np.where(total > 0, total, 1.0), shares[..., None, :])
    of_returns = weights[..., 1:]
    left = np.maximum(1.0 - np.sum(of_returns, axis=-1, keepdims=True), 0.0)
    return left * shares + np.sum(of_returns[..., None] * given, axis=-2)


def _known(codes: Indices, confusion: Array) -> Mask:
    """Return whether codes are classes of the matrix."""
    return (codes >= 0) & (codes < len(confusion))
