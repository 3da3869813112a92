"""Figures with their Monte Carlo errors, from one value per run."""

from __future__ import annotations

import numpy as np
from attrs import frozen

from vedette.space import Array, Mask

DECISIVE = 3.0
"""Standard errors by which a figure must be clear of its bound for a verdict."""


@frozen
class Cell:
    """One figure of a table: measured, with its Monte Carlo standard error, and as published; None where there is none."""

    measured: float | None
    error: float | None = None
    published: float | None = None

    @property
    def said(self) -> str:
        """The measured figure as a sentence says it, to two digits; "unknown" if there is none."""
        return "unknown" if self.measured is None else f"{self.measured:.2g}"


def squared_distances(error: Array) -> Array:
    """Return the squared distances (*b) of errors (*b, n) whose first two axes are the position."""
    squared: Array = np.sum(error[..., :2] ** 2, axis=-1)
    return squared


def mean_cell(values: Array, published: float | None = None, scale: float = 1.0) -> Cell:
    """Return the mean of one value per run (r,) times `scale`, with its standard error; no figure without runs."""
    runs = len(values)
    if runs == 0:
        return Cell(None, None, published)
    error = float(np.std(values, ddof=1) / np.sqrt(runs)) * scale if runs > 1 else None
    return Cell(float(np.mean(values)) * scale, error, published)


def rms_cell(squares: Array, published: float | None = None) -> Cell:
    """Return the root of the mean of squared errors (r, s), one row per run; its error from the spread of run means."""
    mean = mean_cell(np.mean(squares, axis=-1))
    if mean.measured is None:
        return Cell(None, None, published)
    root = float(np.sqrt(mean.measured))
    return Cell(root, None if mean.error is None or root == 0 else 0.5 * mean.error / root, published)


def ratio_cell(over: Array, under: Array, published: float | None = None) -> Cell:
    """Return the ratio of two RMS errors on the same runs, from squared errors (r, s), (r, u); error by linearisation."""
    a, b = np.mean(over, axis=-1), np.mean(under, axis=-1)
    if len(a) == 0 or np.mean(b) == 0:
        return Cell(None, None, published)
    ratio = float(np.sqrt(np.mean(a) / np.mean(b)))
    influence = 0.5 * ratio * (a / np.mean(a) - b / np.mean(b)) if np.mean(a) > 0 else np.zeros(len(a))
    return Cell(ratio, float(np.std(influence, ddof=1) / np.sqrt(len(a))) if len(a) > 1 else None, published)


def share_cell(hits: Array | Mask, published: float | None = None, scale: float = 1.0) -> Cell:
    """Return the share of what is true among hits (r,) or (r, s), one row per run, times `scale`.

    Its error is the spread of the runs' shares, but no less than the binomial error of Agresti and Coull, The American
    Statistician 52 (1998) 119: that is not 0 where no run, or every run, is a hit.
    """
    values = np.asarray(hits, dtype=float)
    runs, count = len(values), values.size
    if count == 0:
        return Cell(None, None, published)
    shares = values if values.ndim == 1 else np.mean(values, axis=-1)
    spread = float(np.std(shares, ddof=1) / np.sqrt(runs)) if runs > 1 else 0.0
    middle = (float(np.sum(values)) + DECISIVE**2 / 2) / (count + DECISIVE**2)
    least = float(np.sqrt(middle * (1 - middle) / (count + DECISIVE**2)))
    return Cell(float(np.mean(shares)) * scale, max(spread, least) * scale, published)
