"""Statistical judgements of the laws. Each fails a correct component with probability `alpha` at most, for any seed."""

from __future__ import annotations

import numpy as np

from vedette.metrics.consistency import chi_square_band
from vedette.space import Array
from vedette.testing.comparisons import demand


def judge_standard_normal(what: str, white: Array, alpha: float, at_most: bool = False) -> None:
    """Raise Broken unless rows (r, n) look like N(0, I): mean, variance and correlation of every axis and pair.

    `at_most`: no axis may have a larger variance.
    """
    from scipy.special import ndtri

    r, n = white.shape
    if not n:
        return
    pairs = [(i, j) for i in range(n) for j in range(i) if not at_most]
    share = alpha / (2 * n + len(pairs))
    reach = float(-ndtri(share / 2))
    for i in range(n):
        mean = float(np.mean(white[:, i]))
        off = f"off by {mean:.3g} standard deviations along direction {i}, allowed {reach / np.sqrt(r):.2g}"
        demand(abs(mean) <= reach / np.sqrt(r), f"{what}: draws are {off}")
        judge_scale(f"{what}, direction {i}", white[:, i] ** 2, 1.0, share, at_most)
    for i, j in pairs:
        # Fisher's transform: atanh of a correlation is nearly normal with variance 1 / (r - 3).
        first, second = white[:, i], white[:, j]
        found = float(np.mean(first * second) / np.sqrt(np.mean(first**2) * np.mean(second**2)))
        limit = float(np.tanh(reach / np.sqrt(r - 3)))
        demand(abs(found) <= limit, f"{what}: directions {j} and {i} correlate by {found:.3g}, allowed {limit:.2g}")


def judge_scale(what: str, squares: Array, dof: float, alpha: float, at_most: bool = False) -> None:
    """Raise Broken unless independent chi-square values (r,) of `dof` degrees average to `dof`, or to that `at_most`."""
    low, high = np.multiply(chi_square_band(dof * squares.size, alpha), (not at_most, 1.0))
    figure = float(np.mean(squares)) / dof
    way = "small" if figure > 1 else "large"
    factor = figure if figure > 1 else 1 / max(figure, 1e-300)
    told = f"{what}: the covariance is {factor:.3g} times too {way} (allowed {low:.3g} to {high:.3g})"
    demand(low <= figure <= high, told)


def judge_run_means(what: str, values: Array, low: float, high: float, alpha: float) -> None:
    """Raise Broken if one value per run (r,), 1 expected, contradicts that its mean lies in [low, high]."""
    from scipy.special import stdtrit

    mean, error = float(np.mean(values)), float(np.std(values, ddof=1) / np.sqrt(len(values)))
    reach = float(-stdtrit(len(values) - 1, alpha / 2)) * error
    told = f"{what}: {mean:.3g} (standard error {error:.2g}, equivalence band {low:g} to {high:g})"
    demand(low - reach <= mean <= high + reach, told)


def binomial_band(count: int, probability: float, alpha: float) -> tuple[float, float]:
    """Return the share of successes in `count` trials below and above which each tail has at most half of `alpha`."""
    from scipy.special import bdtr

    k = np.arange(count)
    below, above = bdtr(k, count, probability), bdtr(k[::-1], count, 1.0 - probability)  # P(at most k), P(more than k)
    return np.searchsorted(below, alpha / 2) / count, np.searchsorted(-above, -alpha / 2) / count
