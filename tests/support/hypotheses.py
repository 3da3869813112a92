"""Hypotheses of clusters written as tables, and read back as such."""

import numpy as np

from vedette.hypotheses import JointHypotheses


def one_cluster(weights, leaves):
    """One cluster of hypotheses, by their weights and the leaf (h, t) of each track in each, -1: none."""
    leaves = np.asarray(leaves)
    held = leaves >= 0
    track = np.zeros(int(leaves.max(initial=-1)) + 1, dtype=np.int64)
    column = np.broadcast_to(np.arange(leaves.shape[1]), leaves.shape)
    track[leaves[held]] = column[held]
    return JointHypotheses(
        np.zeros(len(weights), dtype=np.int64),
        np.asarray(weights, dtype=float),
        np.concatenate([[0], np.cumsum(held.sum(axis=1))]),
        leaves[held],
        np.unique(track, return_inverse=True)[1],
        np.zeros((len(track), 0), dtype=np.int64),
    )


def clusters(hypotheses):
    """The hypotheses of each cluster: a list of (weight, rows of leaves)."""
    told = [[] for _ in range(int(hypotheses.cluster.max(initial=-1)) + 1)]
    for i, (cluster, weight) in enumerate(zip(hypotheses.cluster.tolist(), hypotheses.weights.tolist(), strict=True)):
        own = hypotheses.leaves[hypotheses.starts[i] : hypotheses.starts[i + 1]]
        told[cluster].append((weight, tuple(own.tolist())))
    return told


def together(hypotheses):
    """All hypotheses as one cluster: every product of those of the clusters, a list of (weight, rows of leaves)."""
    product = [(1.0, ())]
    for held in clusters(hypotheses):
        product = [(w * v, tuple(sorted(own + more))) for w, own in product for v, more in held]
    return product
