"""Each verdict on the runs of a tracker on matched truth: its errors, innovations, hits and false returns."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from attrs import evolve

from vedette.metrics import chi_square_band, nees
from vedette.space import Array, Mask
from vedette.testing import Misuse
from vedette.testing.bands import binomial_band
from vedette_report.consistency import Verdict, bias_verdict, chi_square_verdict, run_mean_verdict, whiteness_verdict
from vedette_report.whole_trackers.runs import Looks, Runs

LAGS = 5
REPORTED = " as the estimator reports it"
MOST_LOST = 0.05
"""The largest fraction of runs that may lose their target in clutter."""


def lost_runs(played: Runs) -> Mask:
    """Return the runs (r,) that drowned, or whose target was outside the gate in each of the last scans."""
    gone = np.ones(len(played.error), dtype=bool)
    for looks in played.looks.values():
        squared = nees(looks.residual[:, -LAGS:], looks.cov[:, -LAGS:])
        gone &= np.all(squared > played.tracker.gate.threshold(looks.residual.shape[-1]), axis=1)
    return gone | played.drowned


def lost_verdict(count: int, total: int, share: float) -> Verdict:
    """Judge whether so many lost runs contradict that at most `MOST_LOST` are, by the binomial's exact tail."""
    from scipy.special import bdtrc

    most = max(k for k in range(total + 1) if k == 0 or bdtrc(k - 1, total, MOST_LOST) >= share)
    text = f"lost tracks: {count} of {total}, left out of the other figures; {MOST_LOST:.0%} may be, by chance up to {most}"
    return Verdict("lost", count / total, 0.0, most / total, share, text)


def without(played: Runs, lost: Mask) -> Runs:
    keep = ~lost
    kept = {name: getattr(played, name)[keep] for name in ("error", "cov", "mean", "truth", "drowned")}
    return evolve(played, looks={name: one.of(keep) for name, one in played.looks.items()}, **kept)


def when_out(outside: Mask, times: Array) -> str:
    """Say since when, or when, something is out of its band."""
    inside = np.flatnonzero(~outside)
    since = 0 if not len(inside) else int(inside[-1]) + 1
    if since < len(times):
        return f" from {times[since]:g} s on" if since else " throughout"
    return f" at {times[int(np.argmax(outside))]:g} s"


def _size(figure: float) -> str:
    return f"{figure:.2g} times too small" if figure > 1 else f"{1 / max(figure, 1e-300):.2g} times too large"


def _worst(figures: Array, low: float, high: float) -> int:
    """Return which of the figures leaves the band most, in ratios."""
    return int(np.argmax(np.maximum(figures / high, low / np.maximum(figures, 1e-300))))


def nees_verdict(played: Runs, values: Array, free: Array, share: float, band: tuple[float, float]) -> Verdict:
    if not played.exact:
        return run_mean_verdict("NEES, mean over a run", values.mean(axis=1), *band, share)
    low, high = chi_square_band(float(free.sum()), share / len(played.times))
    mean = values.mean(axis=0)
    worst = _worst(mean, low, high)
    text = f"NEES at {played.times[worst]:g} s: {mean[worst]:.3g}, band {low:.3g} to {high:.3g}"
    outside = (mean < low) | (mean > high)
    if outside.any():
        text += f": the covariance is {_size(mean[worst])}{when_out(outside, played.times)}"
    return Verdict("NEES by time", float(mean[worst]), low, high, share, text)


def normalised_innovations(looks: Looks) -> Array:
    """Return the target's squared innovation over its expectation (r, s), NaN where it was not detected."""
    return np.where(looks.seen, nees(looks.residual, looks.cov) / looks.residual.shape[-1], np.nan)


def reported_innovations(played: Runs) -> dict[str, Array]:
    """Return the same as the estimator itself reports it, of each sensor for which that is something else."""
    found = {}
    for name, looks in played.looks.items():
        own = np.where(looks.seen, looks.own / looks.residual.shape[-1], np.nan)
        if not np.allclose(own, normalised_innovations(looks), rtol=1e-6, equal_nan=True):
            found[name] = own
    return found


def nis_verdicts(
    played: Runs, nis: Mapping[str, Array], share: float, band: tuple[float, float], whose: str = ""
) -> list[Verdict]:
    verdicts = []
    for name, values in nis.items():
        title, each, m = f"NIS of {name}{whose}", share / len(nis), played.looks[name].residual.shape[-1]
        if not np.isfinite(values).any():
            raise Misuse(f"sensors.{name}: never saw the target; the prior starts it out of view")
        if played.exact:
            verdicts.append(chi_square_verdict(title, m * values[np.isfinite(values)], float(m), each))
        else:
            seen = values[np.isfinite(values).any(axis=1)]
            verdicts.append(run_mean_verdict(title, np.nanmean(seen, axis=1), *band, each))
    return verdicts


def whiteness_verdicts(played: Runs, share: float) -> list[Verdict]:
    """Judge exact filters' innovations white; of others, each by the one before, within 0.1 per run on average.

    Given all returns so far, a target's next innovation has mean 0. In clutter the one before is no function of these
    returns, for nobody knows which is the target's: what the tracker used of them, `pooled`, is.
    """
    verdicts = []
    for name, looks in played.looks.items():
        each = share / len(played.looks)
        if played.exact:
            verdicts.append(whiteness_verdict(looks.residual, looks.cov, LAGS, each, looks.seen))
            continue
        spread = np.sqrt(np.diagonal(looks.cov, axis1=-2, axis2=-1))
        before, after = (looks.pooled / spread)[:, :-1], (looks.residual / spread)[:, 1:]
        pair = looks.seen[:, 1:] & np.any(before != 0, axis=-1)
        count = np.maximum(pair.sum(axis=1), 1)
        power = np.sqrt(np.mean(before[pair] ** 2) * np.mean(after[pair] ** 2)) if pair.any() else 1.0
        products = np.where(pair, np.mean(before * after, axis=-1), 0.0).sum(axis=1) / count / power
        one = run_mean_verdict(name, 1.0 + products, 0.9, 1.1, each, least=-np.inf)
        text = (
            f"whiteness of {name}: correlation {one.figure - 1:.3g} at lag 1, band {one.low - 1:.2g} to {one.high - 1:.2g}"
        )
        verdicts.append(Verdict("whiteness", one.figure - 1, one.low - 1, one.high - 1, each, text, one.error))
    return verdicts


def bias_of(played: Runs, share: float) -> Verdict:
    """Return the bias that stands out most of all times."""
    each = share / len(played.times)
    names = played.tracker.state.names
    all_times = [bias_verdict(played.error[:, k], played.cov[:, k], names, each) for k in range(len(played.times))]
    worst = int(np.argmax([abs(verdict.figure) / verdict.high for verdict in all_times]))
    found = all_times[worst]
    outside = np.array([not verdict.inside for verdict in all_times])
    when = when_out(outside, played.times) if outside.any() else f" at {played.times[worst]:g} s"
    return Verdict("bias", found.figure, found.low, found.high, share, found.text + when, found.error)


def calibration(played: Runs) -> tuple[tuple[str, ...], Array]:
    """Return squared errors over variances (d, r, s) along each free axis, and along and across the estimated velocity.

    The estimate is uncorrelated with its error, so a direction derived from it is as good as a fixed one. An estimate that
    stands still, as before the first return, has no direction: then it is that of x.
    """
    space, variance = played.tracker.state, np.diagonal(played.cov, axis1=-2, axis2=-1)
    free = [i for i in range(len(space)) if variance[..., i].min() > 0]
    names = [space.names[i] for i in free]
    squares = [played.error[..., i] ** 2 / variance[..., i] for i in free]
    if all(name in names for name in ("x", "y", "vx", "vy")):
        place, pace = ([space.names.index(name) for name in pair] for pair in (("x", "y"), ("vx", "vy")))
        v = played.mean[..., pace]
        speed = np.linalg.norm(v, axis=-1, keepdims=True)
        ahead = np.where(speed > 0, v / np.where(speed > 0, speed, 1.0), [1.0, 0.0])
        P = played.cov[..., place, :][..., place]
        for name, u in (("along-track", ahead), ("cross-track", ahead[..., ::-1] * [-1.0, 1.0])):
            names.append(name)
            error = np.sum(u * played.error[..., place], axis=-1)
            squares.append(error**2 / np.einsum("...i,...ij,...j->...", u, P, u))
    return tuple(names), np.stack(squares)


def calibration_verdict(
    played: Runs, directions: tuple[str, ...], squares: Array, share: float, band: tuple[float, float]
) -> Verdict:
    if not played.exact:
        each = [
            run_mean_verdict(f"covariance along {name}", square.mean(axis=1), *band, share / len(directions))
            for name, square in zip(directions, squares, strict=True)
        ]
        worst = max(each, key=lambda verdict: max(verdict.figure / verdict.high, verdict.low / max(verdict.figure, 1e-300)))
        return evolve(worst, shown=True)  # NEES says whether that is shown
    low, high = chi_square_band(squares.shape[1], share / squares.shape[2] / len(directions))
    mean = squares.mean(axis=1)
    # Report the direction that is out of its band longest; if none is, the one nearest to it.
    outside = (mean < low) | (mean > high)
    nearest = int(np.unravel_index(_worst(mean, low, high), mean.shape)[0])
    d = int(np.argmax(outside.sum(axis=1))) if outside.any() else nearest
    k = _worst(mean[d], low, high)
    if outside.any():
        typical = float(np.exp(np.mean(np.log(mean[d, outside[d]]))))
        text = f"covariance is {_size(typical)} along {directions[d]}{when_out(outside[d], played.times)}"
    else:
        text = f"covariance by direction: at most {mean[d, k]:.3g}, along {directions[d]}"
    text += f" (band {low:.3g} to {high:.3g})"
    return Verdict("calibration", float(mean[d, k]), low, high, share, text)


def hits_verdicts(played: Runs, share: float) -> list[Verdict]:
    """Judge for each sensor how often it detected the target, by the binomial's exact tails.

    Where the probability depends on the state the sum's tails lie within those of its mean.
    Hoeffding, On the Distribution of the Number of Successes in Independent Trials, Annals of Math. Statistics 27, 1956.
    """
    verdicts = []
    for name, looks in played.looks.items():
        count, declared, each = looks.seen.size, float(looks.declared.mean()), share / len(played.looks)
        low, high = binomial_band(count, declared, each)
        figure = float(looks.seen.mean())
        text = f"hits of {name}: {figure:.3g} a look, declared {declared:.3g}, band {low:.3g} to {high:.3g}"
        if not low <= figure <= high:
            text += f": the detection probability is too {'small' if figure > high else 'large'}"
        verdicts.append(Verdict("hits", figure, low, high, each, text))
    return verdicts


def returns_verdicts(played: Runs, share: float) -> list[Verdict]:
    """Judge for each sensor with clutter how many false returns came, by the binomial's exact tails.

    Clutter is thinned from candidates, each of which is one with the density there over a bound: so it is counted.
    """
    verdicts = []
    for name, looks in played.looks.items():
        count, expected, each = int(looks.candidates.sum()), float(looks.expected.sum()), share / len(played.looks)
        if not count:
            continue
        false = float(looks.false.sum())
        low, high = binomial_band(count, expected / count, each)
        scale = count / expected if expected else 1.0
        figure, low, high = scale * false / count, scale * low, scale * high
        text = f"false returns of {name}: {false:.0f}, {expected:.0f} by its clutter density, band {low:.3g} to {high:.3g}"
        if not low <= figure <= high:
            size = f"{figure:.3g} times too small" if figure > high else f"{1 / max(figure, 1e-300):.3g} times too large"
            text += f": the density is {size}" if expected else ": it declares none"
        verdicts.append(Verdict("false returns", figure, low, high, each, text))
    return verdicts
