"""Figures with their Monte Carlo errors, from one value per run."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from attrs import frozen

from vedette.space import Array, Mask
from vedette_report.consistency import standard_error

DECISIVE = 3.0
"""Standard errors by which a figure must be clear of its bound for a verdict."""

TRIM = 0.05
"""Share of runs that a trimmed figure leaves out at each end; customary, and chosen before any figure was seen."""


@frozen
class Cell:
    """One figure of a table: measured, with its Monte Carlo standard error, and as published; None where there is none.

    `trimmed`: the same figure and its error without the `TRIM` of runs that pull it most to either side. On heavy tails a
    mean's own error is not to be relied on: a verdict needs both. None where runs are too few, or no tail can be heavy.
    """

    measured: float | None
    error: float | None = None
    published: float | None = None
    trimmed: tuple[float, float] | None = None

    @property
    def said(self) -> str:
        """The measured figure as a sentence says it, to two digits; "unknown" if there is none."""
        return "unknown" if self.measured is None else f"{self.measured:.2g}"


def squared_distances(error: Array) -> Array:
    """Return the squared distances (*b) of errors (*b, n) whose first two axes are the position."""
    return np.sum(error[..., :2] ** 2, axis=-1)


def mean_cell(values: Array, published: float | None = None, scale: float = 1.0) -> Cell:
    """Return the mean of one value per run (r,) times `scale`, with its standard error; no figure without runs."""
    if len(values) == 0:
        return Cell(None, None, published)
    error = None if (spread := standard_error(values)) is None else spread * scale
    kept, rest = _trimmed(values)
    trimmed = None if rest is None else (float(np.mean(values[kept])) * scale, rest * scale)
    return Cell(float(np.mean(values)) * scale, error, published, trimmed)


def rms_cell(squares: Array, published: float | None = None) -> Cell:
    """Return the root of the mean of squared errors (r, s), one row per run; its error from the spread of run means."""
    mean = mean_cell(np.mean(squares, axis=-1))
    if mean.measured is None:
        return Cell(None, None, published)

    def root(value: float, error: float | None) -> tuple[float, float | None]:
        return math.sqrt(value), None if error is None or value == 0 else 0.5 * error / math.sqrt(value)

    trimmed = None if mean.trimmed is None else root(*mean.trimmed)
    return Cell(*root(mean.measured, mean.error), published, None if trimmed is None or trimmed[1] is None else trimmed)  # type: ignore[arg-type]


def ratio_cell(over: Array, under: Array, published: float | None = None, power: float = 0.5) -> Cell:
    """Return the ratio of two RMS errors on the same runs, from squared errors (r, s), (r, u); error by linearisation.

    `power` 1: the ratio of the means themselves.
    """
    a, b = np.mean(over, axis=-1), np.mean(under, axis=-1)
    if len(a) == 0 or np.mean(b) == 0:
        return Cell(None, None, published)

    def ratio(kept: Any) -> tuple[float, Array]:
        top, below = np.mean(a[kept]), np.mean(b[kept])
        value = float((top / below) ** power)
        return value, power * value * (a / top - b / below) if top > 0 else np.zeros(len(a))

    value, influence = ratio(np.arange(len(a)))
    kept, _ = _trimmed(influence)
    inner, pull = ratio(kept)
    rest = _trimmed(pull)[1]
    return Cell(value, standard_error(influence), published, None if rest is None else (inner, rest))


def _trimmed(values: Array) -> tuple[Any, float | None]:
    """Return which of values (r,) a trimmed mean keeps, and its error; all and None where there are too few.

    The error is that of Tukey and McLaughlin, Sankhya A 25 (1963) 331: the spread of the winsorised values over 1 - 2 TRIM.
    """
    runs = len(values)
    cut = int(TRIM * runs)
    order = np.argsort(values, kind="stable")
    if cut == 0:
        return order, None
    kept = order[cut : runs - cut]
    held = np.clip(values, values[kept[0]], values[kept[-1]])
    return kept, standard_error(held) / (1 - 2 * TRIM)


def share_cell(hits: Array | Mask, published: float | None = None, scale: float = 1.0) -> Cell:
    """Return the share of what is true among hits (r,) or (r, s), one row per run, times `scale`.

    Its error is the spread of the runs' shares, but no less than the binomial error of Agresti and Coull, The American
    Statistician 52 (1998) 119: that is not 0 where no run, or every run, is a hit.
    """
    values = np.asarray(hits, dtype=float)
    count = values.size
    if count == 0:
        return Cell(None, None, published)
    shares = values if values.ndim == 1 else np.mean(values, axis=-1)
    spread = standard_error(shares) or 0.0
    middle = (float(np.sum(values)) + DECISIVE**2 / 2) / (count + DECISIVE**2)
    least = float(np.sqrt(middle * (1 - middle) / (count + DECISIVE**2)))
    return Cell(float(np.mean(shares)) * scale, max(spread, least) * scale, published)


def less_often_cell(one: Mask, other: Mask, scale: float = 1.0) -> Cell:
    """Return how much larger the share of hits is in `one` (r,) than in `other` on the same runs, times `scale`.

    Its error is that of the runs in which they differ, counted as half of `DECISIVE`^2 more: it is not 0 where none does.
    """
    apart = one.astype(float) - other
    runs = len(apart)
    if runs == 0:
        return Cell(None)
    differ = float(np.sum(apart**2)) + DECISIVE**2 / 2
    mean = float(np.mean(apart))
    return Cell(mean * scale, math.sqrt(max(differ / runs - mean**2, 0.0) / runs) * scale)
