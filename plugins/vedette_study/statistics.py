"""Means over runs with their standard errors, of figures, of differences between points, and against time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from attrs import frozen

from vedette import Array, ConfigError
from vedette_report.consistency import standard_error
from vedette_study.chunk import Chunk, study_figures


@frozen
class Mean:
    """A mean over `runs` that have the figure, and its standard error; None if there are too few."""

    value: float | None
    error: float | None
    runs: int


def mean(name: str, values: Array) -> Mean:
    """Return the mean of one figure (r,): NaN is a run without it. For figures that sum as roots it is the root."""
    values = values[np.isfinite(values)]
    n = len(values)
    if n == 0:
        return Mean(None, None, 0)
    middle = float(np.mean(values))
    error = standard_error(values)
    if not study_figures()[name].squared:
        return Mean(middle, error, n)
    root = float(np.sqrt(middle))
    return Mean(root, error if error is None or root == 0 else 0.5 * error / root, n)


def difference(name: str, a: Array, b: Array) -> Mean:
    """Return figure a minus figure b (r,), run by run: both have the same truth and returns, so most of the noise cancels.

    For figures that sum as roots it is the difference of the roots, linearised: its terms are a / 2 rms(a) - b / 2 rms(b).
    """
    both = np.isfinite(a) & np.isfinite(b)
    a, b, n = a[both], b[both], int(np.count_nonzero(both))
    if n == 0:
        return Mean(None, None, 0)
    if study_figures()[name].squared:
        over, under = np.sqrt(np.mean(a)), np.sqrt(np.mean(b))
        terms = a / (2 * over or 1.0) - b / (2 * under or 1.0)
        value = float(over - under)
    else:
        terms = a - b
        value = float(np.mean(terms))
    return Mean(value, standard_error(terms), n)


def gathered(chunks: Sequence[Sequence[Chunk]], name: str, point: int) -> Array:
    """Gather one figure of all runs at a point (r,)."""
    return np.concatenate([chunk[point].figures[name] for chunk in chunks])


def precise(chunks: Sequence[Sequence[Chunk]], wanted: Mapping[str, float]) -> bool:
    """Return whether every wanted figure is known well enough at every point that has it; False if none is wanted.

    ConfigError for a figure that no point has: runs that go together have fewer figures than those that go one by one.
    """
    if not wanted or not chunks:
        return False
    for name, error in wanted.items():
        if not any(name in chunk.figures for chunk in chunks[0]):
            there = ", ".join(dict.fromkeys(name for chunk in chunks[0] for name in chunk.figures))
            raise ConfigError.at(f"precision.{name}", f"no point of this study has that figure; they have {there}")
        for point, chunk in enumerate(chunks[0]):
            if name in chunk.figures:
                known = mean(name, gathered(chunks, name, point))
                if known.error is None or known.error > error:
                    return False
    return True


def ratios(sums: Array, runs: int) -> tuple[Array, Array]:
    """Return the ratio v / e and its standard error, from sums over runs (*b, 5, s) as in Chunk: both (*b, s).

    With residuals u = v - R e, whose mean is 0, the error is the root of sum u^2 / (N - 1) N, over the mean of e.
    """
    v, v2, e, e2, ve = np.moveaxis(sums, -2, 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = v / e
        left = np.maximum(v2 - 2 * ratio * ve + ratio**2 * e2, 0.0)
        error = np.sqrt(left * runs / max(runs - 1, 1)) / e if runs > 1 else np.full(ratio.shape, np.nan)
    nothing = ~(e > 0)
    return np.where(nothing, np.nan, ratio), np.where(nothing, np.nan, error)
