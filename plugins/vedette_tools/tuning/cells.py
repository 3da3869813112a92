"""Probabilities of detection in the cells of a table, no more different than the recording shows."""

from __future__ import annotations

import numpy as np
from attrs import frozen

from vedette.space import Array

PRIORS = np.append(np.geomspace(1.0, 1e3, 31), np.inf)
"""Trials that the mean of all cells counts for in each: with infinitely many all cells are alike."""
SUMMED = ((1, 2), (1,), (2,), ())
"""Axes of the counts along which cells may be one: rows and columns, rows, columns, none."""
MARGIN = 2.0
"""More cells must foretell by so much more of log-likelihood, seven times as likely: a search among tables gains some."""
LEAST = 1e-3
"""No cell's probability is nearer to 0 or 1: nothing is certain."""


@frozen(eq=False)
class Cells:
    """Probabilities (rows, columns) with standard errors; one row or column where cells along it are one.

    prior: for how many trials the mean of all cells counts in each; score: how well the stretches foretell one another.
    """

    probability: Array
    error: Array
    prior: float
    score: float

    @classmethod
    def of(cls, trials: Array, hits: Array) -> Cells:
        """Return those that foretell best, of counts (folds, rows, columns) in stretches of a recording.

        A cell's probability is (h + s m) / (n + s) of n trials and h hits, with m that of all cells: the mean of a beta
        distribution. s, and along which axes cells are one, is what best foretells each stretch from the others: within
        one, successive trials of a target are alike, and would make chance look like place.
        """
        best: Cells | None = None
        for axes in SUMMED:
            n, h = np.sum(trials, axis=axes, keepdims=True), np.sum(hits, axis=axes, keepdims=True)
            kept = -np.inf if best is None else best.score + MARGIN
            for prior in PRIORS if n[0].size > 1 else PRIORS[-1:]:
                p, _ = _posterior(np.sum(n, axis=0) - n, np.sum(h, axis=0) - h, prior)
                score = float(np.sum(h * np.log(p) + (n - h) * np.log1p(-p)))
                if score > kept:
                    kept = score
                    told = _posterior(np.sum(n, axis=0, keepdims=True), np.sum(h, axis=0, keepdims=True), prior)
                    best = cls(told[0][0], told[1][0], float(prior), score)
        assert best is not None
        return best


def _posterior(n: Array, h: Array, prior: float) -> tuple[Array, Array]:
    """Return (h + s m) / (n + s) and its standard error, for counts (f, r, c); m is over the cells of each f."""
    total, took = np.sum(n, axis=(1, 2), keepdims=True), np.sum(h, axis=(1, 2), keepdims=True)
    mean = (took + 0.5) / (total + 1.0)
    if np.isfinite(prior):
        p, known = (h + prior * mean) / (n + prior), n + prior
    else:
        p, known = np.broadcast_to(mean, h.shape), np.broadcast_to(total, h.shape)
    p = np.clip(p, LEAST, 1.0 - LEAST)
    return p, np.sqrt(p * (1.0 - p) / (known + 1.0))
