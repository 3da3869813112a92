"""Distances between a set of true objects and a set of estimates, per scan.

Both take the distance of every truth to every estimate, (j, t) in m, or of near pairs alone: any base distance serves.

>>> apart = distances(np.array([[0.0, 0.0], [50.0, 0.0]]), np.array([[3.0, 4.0]]))
>>> gospa(apart, cutoff=20.0)
Gospa(value=15.0, localisation=25.0, missed=200.0, false=0.0)
"""

from __future__ import annotations

import numpy as np
from attrs import frozen

from vedette.metrics.near_pairs import Near, near, one_to_one
from vedette.space import Array


@frozen
class Gospa:
    """`value` in m, and its parts in m^order: value^order = localisation + missed + false."""

    value: float
    localisation: float
    missed: float
    false: float


def distances(truth: Array, estimates: Array) -> Array:
    """Return the Euclidean distance of every true object to every estimate: (j, d), (t, d) -> (j, t)."""
    square = np.zeros((len(truth), len(estimates)))
    for axis in range(truth.shape[-1]):
        square += (truth[:, None, axis] - estimates[None, :, axis]) ** 2
    return np.sqrt(square)


def gospa(distance: Array | Near, cutoff: float, order: float = 2.0) -> Gospa:
    """Return the generalised OSPA with alpha = 2, of `distance` (j, t) in m: the least over pairings of

    ( sum over pairs d^p + c^p / 2 (missed truths + false estimates) )^(1/p).

    Not divided by the number of objects: each miss and each false estimate costs c / 2^(1/p) by itself.
    Rahmathullah, Garcia-Fernandez, Svensson, Generalized Optimal Sub-Pattern Assignment Metric, Fusion 2017.
    """
    truths, estimates = distance.shape
    apart, pairs = _pair(distance, cutoff, order)
    missed, false = 0.5 * (truths - pairs), 0.5 * (estimates - pairs)
    power = cutoff**order
    return Gospa(cutoff * (apart + missed + false) ** (1 / order), power * apart, power * missed, power * false)


def ospa(distance: Array | Near, cutoff: float, order: float = 2.0) -> float:
    """Return the optimal sub-pattern assignment distance in m, of `distance` (j, t) in m; 0 if both sets are empty.

    With n = max(j, t): ( (the least sum over pairs of min(d, c)^p + c^p |j - t|) / n )^(1/p).
    Schuhmacher, Vo, Vo, A Consistent Metric for Performance Evaluation of Multi-Object Filters, IEEE Trans. SP 56, 2008.
    """
    objects = max(distance.shape)
    if objects == 0:
        return 0.0
    apart, pairs = _pair(distance, cutoff, order)
    return float(cutoff * ((apart + objects - pairs) / objects) ** (1 / order))


def _pair(distance: Array | Near, cutoff: float, order: float) -> tuple[float, int]:
    """Return the sum of (d / c)^p over the pairs nearer than c of the best pairing, and their number.

    A pair at c costs as much as leaving both out, so only nearer pairs matter.
    """
    if not (cutoff > 0 and order >= 1):
        raise ValueError(f"cutoff: must be > 0 m, and order >= 1, got {cutoff:g} and {order:g}")
    pairs = near(distance, cutoff)
    cost = (pairs.distance / cutoff) ** order
    paid = cost[one_to_one(pairs.truth, pairs.track, cost, 1.0)]
    return float(np.sum(paid)), len(paid)
