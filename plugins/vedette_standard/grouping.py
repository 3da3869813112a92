"""From points to objects: those within a link distance belong together; a group too long for one is split by k-means."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vedette import Array, kernels

Labels = NDArray[np.intp]
"""The number of the group that each point belongs to."""

ROUNDS = 50
"""Maximum iterations of k-means; groups of an object's spots need a few."""


def linked(points: Array, distance: float) -> Labels:
    """Return single-link groups of points (k, n): two share one if a chain of steps of at most `distance` joins them.
    Groups are numbered by their first points.
    """
    k = len(points)
    i, j = kernels.pairs_in_boxes(points - distance, points + distance, points, (), k * k)
    near = np.sum((points[i] - points[j]) ** 2, axis=-1) <= distance**2
    return kernels.linked_clusters(i[near], j[near], k, k)[:k]


def k_means(points: Array, weights: Array, k: int) -> tuple[Labels, Array]:
    """Return weighted k-means of (n, 2): labels, centroids (k, 2). It starts with the point farthest from the mean, then
    each time the one farthest from all chosen, so nothing is random.

    MacQueen, Some methods for classification and analysis of multivariate observations, 1967.
    """
    middle = np.average(points, axis=0, weights=weights)
    chosen = [int(np.argmax(np.sum((points - middle) ** 2, axis=1)))]
    while len(chosen) < k:
        apart = np.min(np.sum((points[:, None] - points[chosen]) ** 2, axis=2), axis=1)
        chosen.append(int(np.argmax(apart)))
    centres, labels = points[chosen], np.full(len(points), -1)
    for _ in range(ROUNDS):
        nearest = np.argmin(np.sum((points[:, None] - centres) ** 2, axis=2), axis=1)
        if np.array_equal(nearest, labels):
            break
        labels = nearest
        centres = np.stack([_mean(points, weights, labels == j, centres[j]) for j in range(k)])
    return labels, centres


def _mean(points: Array, weights: Array, members: NDArray[np.bool_], default: Array) -> Array:
    return np.average(points[members], axis=0, weights=weights[members]) if members.any() else default


def calinski_harabasz(points: Array, weights: Array, labels: Labels, centres: Array) -> float:
    """Return the spread between k groups over that within, each by its degrees of freedom: (B / (k - 1)) / (W / (n - k)).

    It is infinite where the groups are points. Calinski, Harabasz, A dendrite method for cluster analysis, 1974.
    """
    n, k = len(points), len(centres)
    middle = np.average(points, axis=0, weights=weights)
    share = weights * n / np.sum(weights)
    within = float(np.sum(share * np.sum((points - centres[labels]) ** 2, axis=1)))
    groups = np.array([np.sum(share[labels == j]) for j in range(k)])
    between = float(np.sum(groups * np.sum((centres - middle) ** 2, axis=1)))
    return np.inf if within == 0 else between / (k - 1) / (within / (n - k)) if n > k else -np.inf


def grouped(points: Array, weights: Array, link: float, longest: float) -> Labels:
    """Return single-link groups; one longer than `longest` is split into the k-means groups with the greatest index of
    Calinski and Harabasz, k from 2 to one more than the number of such lengths that fit into it.
    """
    labels = linked(points, link)
    following = int(labels.max(initial=-1)) + 1
    low, high = np.full((following, points.shape[-1]), np.inf), np.full((following, points.shape[-1]), -np.inf)
    np.minimum.at(low, labels, points)
    np.maximum.at(high, labels, points)
    for group in np.flatnonzero(np.linalg.norm(high - low, axis=-1) > longest).tolist():
        members = np.flatnonzero(labels == group)
        spots = points[members]
        length = max(float(np.max(np.linalg.norm(spots - one, axis=-1))) for one in spots)  # not all pairs at once
        if len(members) < 3 or length <= longest:
            continue
        tried = []
        for k in range(2, min(int(length / longest) + 1, len(members) - 1) + 1):
            parts, centres = k_means(points[members], weights[members], k)
            tried.append((calinski_harabasz(points[members], weights[members], parts, centres), -k, parts))
        if tried:
            parts = max(tried, key=lambda split: split[:2])[2]
            labels[members] = np.where(parts == 0, group, following + parts - 1)
            following += int(parts.max())
    return labels
