"""Whether a filter's covariance fits its errors: verdicts in words.

Pure functions of arrays. `r` runs, `s` scans, `n` state axes, `m` measured axes, `*b` any batch axes. A verdict's figure is
scaled so that 1 (a covariance's scale) or 0 (a mean, a correlation) is expected; its `alpha` is the false-alarm probability
of that one test. docs/metrics.md says which figure may be asserted when.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from attrs import frozen

from vedette import Array, Mask, kernels
from vedette.metrics import chi_square_band

BETS = np.array([0.03, 0.1, 0.3, 0.7])
"""Shares to bet: the wider the tail, the less wins most; more of them give 0.01 more of a mean of 1 (200 runs of an IMM)."""
SOUGHT = 2.0
"""A covariance so many times too small or too large is what is to be excluded where something is called consistent."""


@frozen
class Verdict:
    """A figure against the band [low, high], which that of a correct filter leaves with probability `alpha` at most.

    `error` is the figure's standard error where runs give one; `text` states the conclusion in words. If it is inside, it is
    `shown` where what is sought is excluded, and not only not found.
    """

    name: str
    figure: float
    low: float
    high: float
    alpha: float
    text: str
    error: float | None = None
    shown: bool = True

    @property
    def inside(self) -> bool:
        """Whether the figure lies in its band."""
        return self.low <= self.figure <= self.high


@frozen
class Estimate:
    """A mean over runs and its standard error, None if there is one run only."""

    value: float
    error: float | None


def autocorrelation(innovation: Array, cov: Array, lags: int, valid: Mask | None = None) -> tuple[Array, Array]:
    """Return the autocorrelation (lags,) at lag 1 ... of innovations (*b, s, m), and the number (lags,) of products in each.

    rho_l = sum u_k'u_{k+l} / sqrt(sum u_k'u_k sum u_{k+l}'u_{k+l}), u whitened by `cov` (*b, s, m, m), over the pairs of
    scans that both have a return (`valid` (*b, s)). White innovations: mean 0, variance 1 / number, whatever their scale.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 5.4.2.
    """
    u = kernels.whiten(innovation, cov)
    if not 0 < lags < u.shape[-2]:
        raise ValueError(f"lags: must be > 0 and < {u.shape[-2]}, the number of scans, got {lags}")
    known = np.ones(u.shape[:-1], dtype=bool) if valid is None else np.broadcast_to(valid, u.shape[:-1])
    if bad := np.count_nonzero(known & ~np.all(np.isfinite(u), axis=-1)):
        raise ValueError(f"innovation: must be finite where `valid` says that there is a return, got {bad} that are not")
    rho, count = np.empty(lags), np.empty(lags)
    for lag in range(1, lags + 1):
        pair = (known[..., :-lag] & known[..., lag:])[..., None]
        first, second = np.where(pair, u[..., :-lag, :], 0.0), np.where(pair, u[..., lag:, :], 0.0)
        count[lag - 1] = np.count_nonzero(pair) * u.shape[-1]
        power = np.sqrt(np.sum(first**2) * np.sum(second**2))
        rho[lag - 1] = np.sum(first * second) / power if power > 0 else 0.0
    return rho, count


def normalised_error(error: Array, cov: Array) -> Array:
    """Return each axis' error over its standard deviation: (*b, n), (*b, n, n) -> (*b, n), 0 on axes without variance."""
    variance = np.diagonal(cov, axis1=-2, axis2=-1)
    return np.where(variance > 0, error, 0.0) / np.sqrt(np.where(variance > 0, variance, 1.0))


def standard_error(values: Array) -> Any:
    """Return the standard error of the mean of values (r, ..), the runs independent: (..), None of fewer than two runs."""
    if len(values) < 2:
        return None
    error = np.std(values, axis=0, ddof=1) / np.sqrt(len(values))
    return error if error.ndim else float(error)


def mean_over_runs(values: Array) -> Estimate:
    """Return the mean of one value per run (r,), the runs independent, with its standard error."""
    runs = np.asarray(values, dtype=float)
    if runs.ndim != 1 or not len(runs) or not np.all(np.isfinite(runs)):
        raise ValueError(f"values: must be one finite number a run, got shape {runs.shape} with {_bad(runs)} not finite")
    return Estimate(float(np.mean(runs)), standard_error(runs))


def chi_square_verdict(name: str, values: Array, dof: Array | float, alpha: float) -> Verdict:
    """Judge the average of independent chi-square values over their degrees of freedom `dof` (one number, or one each).

    For the NEES of a linear-Gaussian filter at one time over runs, or its NIS over runs and scans; not for NEES pooled over
    time, whose values are dependent.
    """
    values = np.asarray(values, dtype=float)
    if not values.size or not np.all(np.isfinite(values)):
        raise ValueError(f"values: must be finite numbers, got {values.size} with {_bad(values)} not finite")
    if np.any(values < 0):
        raise ValueError(f"values: must be >= 0, as squares are, got {np.min(values):.3g}")
    total = float(np.sum(np.broadcast_to(dof, values.shape)))
    low, high = chi_square_band(total, alpha)
    figure = float(np.sum(values)) / total
    return Verdict(name, figure, low, high, alpha, f"{name}: {_scale(figure, low, high)}")


def least_mean(values: Array, alpha: float) -> float:
    """Return what the mean of numbers (r,) that are never negative is at least: too much with probability alpha at most.

    Whatever their tail: who bets a share b of what he has on each being above m, with (x / m - 1) to win, does not gain on
    average if their mean is m, and multiplies his money by 1 / alpha with probability alpha at most (Markov).
    Waudby-Smith, Ramdas, Estimating Means of Bounded Random Variables by Betting, J. Royal Statistical Society B 86, 2024.
    """
    from scipy.optimize import brentq
    from scipy.special import logsumexp

    if np.min(values) < 0:
        raise ValueError(f"values: must be 0 at least, got {np.min(values):.3g}")

    def gained(m: float) -> float:
        money = np.sum(np.log1p(BETS * (values[:, None] / m - 1.0)), axis=0)
        return float(logsumexp(money) - np.log(len(BETS)) + np.log(alpha))

    mean = float(np.mean(values))
    lowest = 1e-6 * mean
    return float(brentq(gained, lowest, mean)) if mean > 0 and gained(lowest) > 0 else 0.0


def run_mean_verdict(name: str, values: Array, low: float, high: float, alpha: float, least: float = 0.0) -> Verdict:
    """Judge whether one value per run (r,), scaled to 1, contradicts that its mean lies in the equivalence band [low, high].

    The band is widened by Student's quantile of the standard error, so a filter whose mean is in it alarms with
    probability alpha at most (the mean over runs is taken as normal: use 100 runs or more where alpha is small). It ends
    at `least`, below which no value can be: 0 for a NEES, a NIS or a square. Of these it is widened upwards by no more than
    the mean is above `least_mean`: a few runs that are far off must not excuse the others. They are `shown` where a mean
    `SOUGHT` times too large or too small is excluded.
    """
    if not low <= high:
        raise ValueError(f"low: must be <= high, got {low:g} and {high:g}")
    bounded = least == 0.0
    mean, reach = _mean_and_reach(values, alpha * (2 / 3 if bounded else 1))
    surely = max(mean.value - reach, least_mean(values, alpha / 3) if bounded else -np.inf)
    below, above = max(low - reach, least), high + mean.value - surely
    tail = f" below and {mean.value - surely:.2g} above" * (mean.value - surely < 0.9 * reach)
    made = f"({low:g} to {high:g} and {reach:.2g}{tail} for chance, standard error {mean.error:.2g})"
    text = f"{name}: {_scale(mean.value, below, above)} {made}"
    if mean.value > above and tail:
        text += f", at least {surely:.2g} times whatever the tail"
    shown = not bounded or (surely > 1 / SOUGHT and mean.value + reach < SOUGHT)
    return Verdict(name, mean.value, below, above, alpha, text, mean.error, shown)


def whiteness_verdict(innovation: Array, cov: Array, lags: int, alpha: float, valid: Mask | None = None) -> Verdict:
    """Judge the autocorrelation of innovations that stands out most, at lag 1 ... lags; shapes as in `autocorrelation`."""
    from scipy.special import ndtri

    rho, count = autocorrelation(innovation, cov, lags, valid)
    if not count.all():
        raise ValueError(f"valid: no two scans {1 + int(np.argmin(count))} apart both have a return")
    worst = int(np.argmax(np.abs(rho) * np.sqrt(count)))
    reach = float(-ndtri(alpha / lags / 2) / np.sqrt(count[worst]))
    figure = float(rho[worst])
    kind = "are white" if abs(figure) <= reach else "are not white"
    text = f"innovations {kind}: correlation {figure:.3g} at lag {worst + 1}, band {-reach:.2g} to {reach:.2g}"
    return Verdict("whiteness", figure, -reach, reach, alpha, text)


def bias_verdict(error: Array, cov: Array, axes: tuple[str, ...], alpha: float) -> Verdict:
    """Judge the mean error, in standard deviations, of the axis where it stands out most; error (r, n), cov (r, n, n).

    Judged by Student's t with the errors' own spread, so a covariance of the wrong size alone raises no alarm here.
    """
    if len(axes) != error.shape[-1]:
        raise ValueError(f"axes: must name the {error.shape[-1]} axes of the error, got {', '.join(axes)}")
    free = np.flatnonzero(np.any(np.diagonal(cov, axis1=-2, axis2=-1) > 0, axis=tuple(range(cov.ndim - 2))))
    if not len(free):
        raise ValueError("cov: no axis has variance")
    relative = normalised_error(error, cov)[:, free]
    means, reach = zip(*(_mean_and_reach(column, alpha / len(free)) for column in relative.T), strict=True)
    worst = int(np.argmax([abs(mean.value) / max(limit, 1e-300) for mean, limit in zip(means, reach, strict=True)]))
    mean, limit = means[worst], reach[worst]
    kind = "unbiased" if abs(mean.value) <= limit else "biased"
    size = f"{mean.value:.3g} standard deviations (standard error {mean.error:.2g})"
    text = f"{kind}: the mean error of {axes[free[worst]]} is {size}"
    return Verdict("bias", mean.value, -limit, limit, alpha, text, mean.error)


def _bad(values: Array) -> int:
    return int(np.count_nonzero(~np.isfinite(values)))


def _mean_and_reach(values: Array, alpha: float) -> tuple[Estimate, float]:
    """Return the mean over runs, and how far the true one may be from it, two-sided."""
    from scipy.special import stdtrit

    mean = mean_over_runs(values)
    if mean.error is None:
        raise ValueError("values: needs at least 2 runs, got 1")
    return mean, float(-stdtrit(len(values) - 1, alpha / 2)) * mean.error


def _scale(figure: float, low: float, high: float) -> str:
    """Say in words what a squared error of `figure` times its covariance means for the covariance."""
    within = f"{figure:.3g}, band {low:.3g} to {high:.3g}"
    if low <= figure <= high:
        return within
    off = f"{figure:.2g} times too small" if figure > 1 else f"{1 / max(figure, 1e-300):.2g} times too large"
    return f"{within}: the covariance is {off}"
