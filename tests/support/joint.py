"""Joint associations by enumeration: the oracle of everything that keeps some of them."""

from itertools import product

import numpy as np


def joint_associations(scores):
    """Every way for rows of log scores (t, 1+k) to share out the returns: choices (a, t) and total scores (a,)."""
    t, columns = scores.shape
    choices = [
        choice
        for choice in product(range(columns), repeat=t)
        if len({c for c in choice if c}) == sum(c > 0 for c in choice)
        and all(np.isfinite(scores[i, c]) for i, c in enumerate(choice))
    ]
    choices = np.array(choices, dtype=np.int64).reshape(len(choices), t)
    return choices, np.array([scores[range(t), choice].sum() for choice in choices])


def marginals(scores):
    choices, totals = joint_associations(scores)
    likely, weights = np.exp(totals - totals.max()), np.zeros(scores.shape)
    for choice, share in zip(choices, likely / likely.sum(), strict=True):
        weights[range(len(choice)), choice] += share
    return weights


def drawn_scores(rng, rows, k, outside=0.3):
    scores = rng.normal(0.0, 2.0, (rows, 1 + k))
    scores[:, 1:][rng.random((rows, k)) < outside] = -np.inf
    return scores
