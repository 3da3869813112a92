"""How wrong a filter must be before the kit notices, and how often the kit gives a false alarm.

    python benchmarks/power.py size      p-values and false alarms on 2,000 correct problems
    python benchmarks/power.py power     detection of P, Q or R that is off by 5 to 50 %

docs/conformance.md shows what it printed.
"""

from __future__ import annotations

import sys

import attrs
import numpy as np
from attrs import evolve, frozen
from scipy import stats
from scipy.linalg import solve_discrete_lyapunov

import vedette
from vedette import Array, Gaussian
from vedette.metrics.consistency import chi_square_band, nees
from vedette.testing.montecarlo import Runs, play, prior_of
from vedette.testing.trackers import FAMILIES, judge
from vedette.tracking.tracker import Tracker
from vedette_standard.estimators.kalman import Kalman

SCANS = 20
ALPHA = 1e-6
BAND = (0.85, 1.15)


def tracker_of(q: float = 1.0, r: float = 1.0, sigma_accel: float = 0.5, sigma: float = 5.0) -> Tracker:
    """Return a Kalman filter whose Q is scaled by `q` and whose R is scaled by `r`."""
    return vedette.build(
        {
            "estimator": {
                "kind": "kalman",
                "motion": {"kind": "constant_velocity", "sigma_accel": sigma_accel * q**0.5},
            },
            "sensors": {"radar": {"kind": "cartesian_position", "sigma": sigma * r**0.5}},
            "associator": {"kind": "pda"},
            "birth": {"kind": "given", "start": {"x": [0, sigma], "y": [0, sigma], "vx": [12, 2], "vy": [0, 2]}},
            "lifecycle": {"kind": "single_target"},
        }
    )


@frozen
class Scaled(Kalman):
    """Reports its covariance times a factor."""

    kind = "benchmark_scaled"
    factor: float = attrs.field(default=1.0)

    def moments(self, belief: Gaussian) -> Gaussian:
        return Gaussian(belief.mean, self.factor * belief.cov)


def group(played: Runs, i: int, size: int) -> Runs:
    """Return the i-th group of `size` runs."""
    part = slice(i * size, (i + 1) * size)
    looks = {name: one.of(part) for name, one in played.looks.items()}
    error, cov, mean, drowned = played.error[part], played.cov[part], played.mean[part], played.drowned[part]
    return evolve(played, error=error, cov=cov, mean=mean, looks=looks, drowned=drowned)


def run(tracker: Tracker, runs: int, scans: int, seed: int, world: Tracker | None = None) -> Runs:
    """Play a number of runs from a seed."""
    times = np.arange(scans + 1.0)
    return play(tracker, prior_of(world or tracker, None), times, runs, np.random.default_rng(seed), world)


def p_values(problems: int, runs: int = 40, scans: int = 12, seed: int = 0) -> tuple[Array, Array, Array]:
    """Return p-values of NIS (problems,) and of NEES at the end (problems,), two-sided, and familywise alarms at 5 %."""
    kinds, each = [(a, s) for a in (0.05, 0.5, 2.0, 20.0) for s in (1.0, 30.0)], problems // 8
    nis, last, alarms = [], [], []
    for k, (sigma_accel, sigma) in enumerate(kinds):
        played = run(tracker_of(sigma_accel=sigma_accel, sigma=sigma), each * runs, scans, seed * 100 + k)
        look = played.looks["radar"]
        total = nees(look.residual, look.cov).reshape(each, -1).sum(axis=1)
        end = nees(played.error[:, -1], played.cov[:, -1]).reshape(each, -1).sum(axis=1)
        for values, dof, found in ((total, 2 * runs * scans, nis), (end, 4 * runs, last)):
            below = stats.chi2.cdf(values, dof)
            found.append(2 * np.minimum(below, 1 - below))
        alarms += [not judge(group(played, i, runs), 0.05, BAND, 0).consistent for i in range(each)]
    return np.concatenate(nis), np.concatenate(last), np.array(alarms)


def size(problems: int = 2000) -> None:
    """Print how p-values and alarms of correct problems are distributed."""
    nis, last, alarms = p_values(problems)
    for name, p in (("NIS", nis), ("NEES at the end", last)):
        print(f"{name}: {len(p)} right problems, Kolmogorov-Smirnov p = {stats.kstest(p, 'uniform').pvalue:.3f}")
        for level in (0.05, 0.01):
            _say_size(f"  size at {level}", p < level)
    _say_size("one report at alpha 0.05, all its verdicts", alarms)


def _say_size(name: str, hits: Array) -> None:
    interval = stats.binomtest(int(hits.sum()), len(hits)).proportion_ci(0.95, method="exact")
    print(f"{name}: {hits.mean():.4f}, 95 % interval {interval.low:.4f} to {interval.high:.4f}")


def nis_ratio(wrong: Tracker, right: Tracker) -> float:
    """Return E[NIS] / m of the stationary wrong filter in the right world, exactly, from its innovation covariance."""
    x = np.zeros(4)
    F, H = wrong.estimator.motion.jacobian(x, 1.0), np.eye(2, 4)
    Q, R = wrong.estimator.motion.noise(x, 1.0), wrong.sensors["radar"].noise(x[:2])
    P = np.eye(4) * 100.0
    for _ in range(500):
        S = H @ P @ H.T + R
        K = P @ H.T @ np.linalg.inv(S)
        P = F @ (P - K @ H @ P) @ F.T + Q
    closed, gain = F - F @ K @ H, F @ K
    true = solve_discrete_lyapunov(
        closed, right.estimator.motion.noise(x, 1.0) + gain @ right.sensors["radar"].noise(x[:2]) @ gain.T
    )
    return float(np.trace(np.linalg.solve(S, H @ true @ H.T + right.sensors["radar"].noise(x[:2]))) / 2)


def chance(ratio: float, dof: float, alpha: float) -> float:
    """Return the probability that a chi-square mean of expectation `ratio` leaves the band of one of expectation 1."""
    low, high = chi_square_band(dof, alpha)
    return float(stats.chi2.cdf(low * dof / ratio, dof) + stats.chi2.sf(high * dof / ratio, dof))


def power(plan: dict[int, int]) -> None:
    """Print detection rates: `plan` maps runs per report to the number of reports."""
    share = ALPHA / FAMILIES
    print(
        f"Detection rate of a report at alpha {ALPHA:g}, {SCANS} scans; theory: its strongest verdict of NIS or NEES alone"
    )
    print("| wrong | by |" + "".join(f" {n} runs | theory |" for n in plan))
    print("| --- | --- |" + " --- | --- |" * len(plan))
    right = tracker_of()
    for what in ("P", "Q", "R"):
        for percent in (5, 10, 20, 50):
            factor = 1 / (1 + percent / 100)
            wrong = tracker_of(**{what.lower(): factor}) if what != "P" else right
            if what == "P":
                wrong = evolve(right, estimator=Scaled(right.estimator.motion, factor=factor))
            cells = []
            for runs, reports in plan.items():
                played = run(wrong, runs * reports, SCANS, 17, right)
                seen = [not judge(group(played, i, runs), ALPHA, BAND, 0).consistent for i in range(reports)]
                theory = (
                    chance(1 / factor, 4 * runs, share / SCANS)
                    if what == "P"
                    else chance(nis_ratio(wrong, right), 2 * runs * SCANS, share)
                )
                cells.append(f" {np.mean(seen):.2f} | {theory:.2f} |")
            print(f"| {what} | {percent} % |" + "".join(cells), flush=True)


if __name__ == "__main__":
    if sys.argv[1:] == ["size"]:
        size()
    elif sys.argv[1:] == ["power"]:
        power({50: 40, 400: 40, 6000: 5})
    else:
        sys.exit(__doc__)
