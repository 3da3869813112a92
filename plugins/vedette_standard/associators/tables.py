"""The marginals of the best joint associations by tables of log scores, and what these leave out."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from vedette import Array, Mask
from vedette.hypotheses import LOST, LeafScores, best_marginals


def left_out(scores: Array, m: int) -> Mask:
    """Return the tracks of clusters whose associations beyond the `m` best are too probable: (*b, t, 1+k) -> (*b, t)."""
    if np.max(np.prod(1.0 + np.isfinite(scores[..., 1:]).sum(axis=-1), axis=-1), initial=0.0) <= m:
        return np.zeros(scores.shape[:-1], dtype=bool)
    return best_marginals_of_table(scores, m)[1] > LOST


def best_marginals_of_table(
    scores: Array, most: int, of: Callable[[LeafScores, int], tuple[Array, Array, Array]] = best_marginals
) -> tuple[Array, Array]:
    """Return the same by tables of log scores (*b, t, 1+k): weights (*b, t, 1+k) and what is lost (*b, t).

    `of`: what makes them of one run's, as `best_marginals` does.
    """
    weights, lost = np.zeros(scores.shape), np.zeros(scores.shape[:-1])
    for run in np.ndindex(scores.shape[:-2]):
        pairs = LeafScores.of(scores[run])
        weights[(*run, slice(None), 0)], shares, lost[run] = of(pairs, most)
        weights[run][pairs.leaf, 1 + pairs.returns] = shares
    return weights, lost
