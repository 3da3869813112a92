"""Verdicts on whole covariance matrices, axis by axis and pair by pair, and on the probabilities of a mixture's modes."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from vedette.metrics import chi_square_band
from vedette.space import Array, Mask
from vedette.testing.bands import binomial_band
from vedette_report.consistency import Verdict, run_mean_verdict
from vedette_report.whole_trackers.runs import Runs
from vedette_report.whole_trackers.verdicts import when_out

BEYOND_3 = 0.0026997960632601866
"""How often a normal number is beyond 3 standard deviations."""
MOST_BEYOND = 3.0
"""So many times that is nothing wrong where a filter is not exact: its innovations are then not quite normal."""
FEWEST = 30
"""Runs with fewer looks at near, or at far, targets say nothing of their mean."""


def whitened(error: Array, cov: Array) -> Array:
    """Return C^-1/2 u of errors (*b, n), u in stated deviations and C (*b, n, n) their stated correlations.

    The root is the symmetric one, so that each axis stays mainly its own. Axes without variance give 0.
    """
    variance = np.diagonal(cov, axis1=-2, axis2=-1)
    free = variance > 0
    spread = np.where(free, np.sqrt(np.where(free, variance, 1.0)), 1.0)
    correlation = np.where(np.eye(cov.shape[-1], dtype=bool), 1.0, cov / spread[..., :, None] / spread[..., None, :])
    values, vectors = np.linalg.eigh(correlation)
    turned = np.swapaxes(vectors, -1, -2) @ (np.where(free, error, 0.0) / spread)[..., None]
    return (vectors @ (turned / np.sqrt(np.maximum(values, 1e-12))[..., None]))[..., 0]


def _stated(cov: Array, i: int, j: int) -> Array:
    """Return the stated correlation (*b) of two axes."""
    return cov[..., i, j] / np.sqrt(cov[..., i, i] * cov[..., j, j])


def _found(u: Array, v: Array) -> float:
    power = float(np.mean(u**2) * np.mean(v**2))
    return float(np.mean(u * v)) / np.sqrt(power) if power > 0 else 0.0


def _reach(count: int, alpha: float) -> float:
    """Return how far from 0 the correlation of so many pairs of independent normal numbers of mean 0 may be: exact, as
    r sqrt((n - 1) / (1 - r^2)) is Student's t of n - 1 degrees.
    """
    from scipy.special import stdtrit

    t = float(-stdtrit(count - 1, alpha / 2))
    return t / float(np.sqrt(count - 1 + t**2))


def innovation_verdicts(played: Runs, share: float, band: tuple[float, float]) -> list[Verdict]:
    """Judge the whole covariance of each sensor's innovations: every measured axis, and every pair of them."""
    verdicts = []
    for name, looks in played.looks.items():
        axes, m = played.tracker.sensors[name].measurement.names, looks.residual.shape[-1]
        if m == 1:  # the NIS is all there is
            continue
        each = share / len(played.looks) / (m * (m + 1) // 2)
        white = whitened(looks.residual, looks.cov)
        judged = [
            _of_axis(f"innovations of {name} along {axes[i]}", white[..., i], looks.seen, each, band, played.exact)
            for i in range(m)
        ]
        for i, j in combinations(range(m), 2):
            u, v = (looks.residual[..., k] / np.sqrt(looks.cov[..., k, k]) for k in (i, j))
            stated = float(np.mean(_stated(looks.cov, i, j)[looks.seen]))
            told = _told(
                f"{axes[i]} and {axes[j]} of the innovations of {name}", _found(u[looks.seen], v[looks.seen]), stated
            )
            judged.append(_of_pair(told, white[..., i], white[..., j], looks.seen, each, band, played.exact))
        verdicts.append(_worst_of(judged, "innovation covariance"))
    return verdicts


def error_verdict(played: Runs, share: float, band: tuple[float, float]) -> Verdict | None:
    """Judge every pair of axes of the whitened errors: at each time where chi-square holds, else over the run's mean."""
    names, variance = played.tracker.state.names, np.diagonal(played.cov, axis1=-2, axis2=-1)
    free = [i for i in range(len(names)) if variance[..., i].min() > 0]
    pairs = list(combinations(free, 2))
    if not pairs:
        return None
    white, all_runs = whitened(played.error, played.cov), np.ones(played.error.shape[:2], dtype=bool)
    judged = []
    for i, j in pairs:
        u, v = (played.error[..., k] / np.sqrt(variance[..., k]) for k in (i, j))
        if not played.exact:
            told = _told(f"errors of {names[i]} and {names[j]}", _found(u, v), float(np.mean(_stated(played.cov, i, j))))
            judged.append(_of_pair(told, white[..., i], white[..., j], all_runs, share / len(pairs), band, False))
            continue
        power = np.sqrt(np.mean(white[..., i] ** 2, axis=0) * np.mean(white[..., j] ** 2, axis=0))
        figures = np.mean(white[..., i] * white[..., j], axis=0) / np.maximum(power, 1e-300)
        limit, k = _reach(len(u), share / len(pairs) / len(figures)), int(np.argmax(np.abs(figures)))
        out = np.abs(figures) > limit
        stated = float(np.mean(_stated(played.cov[:, k], i, j)))
        told = _told(f"errors of {names[i]} and {names[j]}", _found(u[:, k], v[:, k]), stated)
        when = when_out(out, played.times) if out.any() else f" at {played.times[k]:g} s"
        judged.append(_banded(told + when, float(figures[k]), limit, share))
    return _worst_of(judged, "error covariance")


def distance_verdicts(played: Runs, share: float, band: tuple[float, float]) -> list[Verdict]:
    """Judge the innovations of nearer and of farther targets apart: where a prediction lies says nothing of its error."""
    verdicts = []
    for name, looks in played.looks.items():
        m, each = looks.residual.shape[-1], share / len(played.looks) / 2
        squares = np.sum(whitened(looks.residual, looks.cov) ** 2, axis=-1, keepdims=True) / m
        near = looks.distance <= np.median(looks.distance, axis=0)
        judged = []
        for words, part in (("nearer", near & looks.seen), ("farther", ~near & looks.seen)):
            if np.count_nonzero(part.any(axis=1)) < FEWEST:
                continue
            what = f"NIS of {name}, {words} half of its targets"
            judged.append(_of_axis(what, np.sqrt(squares[..., 0]), part, each, band, played.exact, m))
        if judged:
            verdicts.append(_worst_of(judged, "NIS by distance"))
    return verdicts


def tail_verdicts(played: Runs, share: float) -> list[Verdict]:
    """Judge for each sensor how many whitened innovations are beyond 3: by the binomial's tails where chi-square holds.

    Of others, a share of up to `MOST_BEYOND` times that of normal numbers must not be contradicted by the runs' means.
    """
    verdicts = []
    for name, looks in played.looks.items():
        each = share / len(played.looks)
        beyond = np.abs(whitened(looks.residual, looks.cov)) > 3.0
        if played.exact:
            count = int(looks.seen.sum()) * beyond.shape[-1]
            low, high = binomial_band(count, BEYOND_3, each)
        else:
            rows, usual = looks.seen.any(axis=1), BEYOND_3
            mean = np.mean(beyond, axis=-1)
            values = np.sum(mean * looks.seen, axis=1)[rows] / looks.seen.sum(axis=1)[rows]
            low, high = 0.0, usual * run_mean_verdict("", values / usual, 0.0, MOST_BEYOND, each).high
        figure = float(np.mean(beyond[looks.seen]))
        text = f"innovations of {name} beyond 3 deviations: {figure:.2%}, band {low:.2%} to {high:.2%}"
        verdicts.append(Verdict("tails", figure, low, high, each, text))
    return verdicts


def modes_verdict(surprise: Array, usual: Array, share: float) -> Verdict:
    """Judge whether a mixture's probability of the true mode is lower than that by the world's own chain: (r, s) nats."""
    more = np.mean(surprise, axis=1) - np.mean(usual, axis=1)
    one = run_mean_verdict("modes", 1.0 + more, -np.inf, 1.0, share, least=-np.inf)
    assert one.error is not None
    text = (
        f"mode probabilities: the true mode's is {one.figure - 1:.3g} nats a scan short of what the world's own chain gives "
        f"(standard error {one.error:.2g}, at most {one.high - 1:.2g})"
    )
    return Verdict("modes", one.figure - 1, -np.inf, one.high - 1, share, text, one.error)


def _told(what: str, found: float, stated: float) -> str:
    return f"{what} are correlated by {found:.2g}, stated {stated:.2g}"


def _banded(text: str, figure: float, limit: float, alpha: float) -> Verdict:
    told = f"{text} (whitened {figure:.2g}, band {-limit:.2g} to {limit:.2g})"
    return Verdict("", figure, -limit, limit, alpha, told)


def _of_axis(what: str, u: Array, seen: Mask, alpha: float, band: tuple[float, float], exact: bool, dof: int = 1) -> Verdict:
    if not exact:
        rows = seen.any(axis=1)
        values = np.sum(np.where(seen, u**2, 0.0), axis=1)[rows] / seen.sum(axis=1)[rows]
        return run_mean_verdict(what, values, *band, alpha)
    low, high = chi_square_band(float(dof * seen.sum()), alpha)
    figure = float(np.mean(u[seen] ** 2))
    told = f"{what}: variance {figure:.3g}, band {low:.3g} to {high:.3g}"
    return Verdict("", figure, low, high, alpha, told)


def _of_pair(told: str, u: Array, v: Array, seen: Mask, alpha: float, band: tuple[float, float], exact: bool) -> Verdict:
    if exact:
        return _banded(told, _found(u[seen], v[seen]), _reach(int(seen.sum()), alpha), alpha)
    rows, half = seen.any(axis=1), (band[1] - band[0]) / 2
    values = np.sum(np.where(seen, u * v, 0.0), axis=1)[rows] / seen.sum(axis=1)[rows]
    one = run_mean_verdict("", 1.0 + values, 1.0 - half, 1.0 + half, alpha, least=-np.inf)
    return _banded(told, one.figure - 1, max(one.high - 1, 1 - one.low), alpha)


def _worst_of(judged: list[Verdict], name: str) -> Verdict:
    """Return the one that leaves its band most, in half widths of it."""

    def out(one: Verdict) -> float:
        return abs(2 * one.figure - one.high - one.low) / max(one.high - one.low, 1e-300)

    worst = max(judged, key=out)
    return Verdict(name, worst.figure, worst.low, worst.high, worst.alpha, worst.text, worst.error)
