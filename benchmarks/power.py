"""How wrong a filter must be before the kit notices, and how often the kit gives a false alarm.

    python benchmarks/power.py size      p-values and false alarms on 2,000 correct problems
    python benchmarks/power.py power     detection of P, Q or R that is off by 5 to 50 %
    python benchmarks/power.py right     alarms of 300 drawn right trackers, at alpha .05 and at the default
    python benchmarks/power.py errors    how often errors that are not white are named, 100 drawn worlds of each kind

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
from vedette.testing import Errors, World, consistency
from vedette.tracking.tracker import Tracker
from vedette_report.whole_trackers.judging import FAMILIES, judge
from vedette_report.whole_trackers.runs import Runs, play, prior_of
from vedette_standard.estimators.kalman import Kalman

SCANS = 20
ALPHA = 1e-6
BAND = (0.85, 1.15)


def tracker_of(
    q: float = 1.0,
    r: float = 1.0,
    sigma_accel: float = 0.5,
    sigma: float = 5.0,
    speed: float = 12.0,
    p_detect: float = 1.0,
    clutter: float = 0.0,
) -> Tracker:
    """Return a Kalman filter whose Q is scaled by `q` and whose R is scaled by `r`."""
    seen = {"sigma": sigma * r**0.5, "detection_probability": p_detect, "clutter_density": clutter}
    return vedette.build(
        {
            "estimator": {
                "kind": "kalman",
                "motion": {"kind": "constant_velocity", "sigma_accel": sigma_accel * q**0.5},
            },
            "sensors": {"radar": {"kind": "cartesian_position", **seen}},
            "associator": {"kind": "pda"},
            "birth": {"kind": "given", "start": {"x": [0, sigma], "y": [0, sigma], "vx": [speed, 2], "vy": [0, 2]}},
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
    rows = {name: getattr(played, name)[part] for name in ("error", "cov", "mean", "truth", "drowned")}
    return evolve(played, looks=looks, **rows)


def run(tracker: Tracker, runs: int, scans: int, seed: int, world: Tracker | None = None) -> Runs:
    """Play a number of runs from a seed."""
    times = np.arange(scans + 1.0)
    return play(tracker, prior_of(world or tracker, None), times, runs, np.random.default_rng(seed), world)


def turning_of(sigma: float) -> Tracker:
    """Return a Kalman filter of two angles that drift and are measured, both starting on the wrap."""
    angles = {"axes": ["heading", "aspect"], "units": dict.fromkeys(("heading", "aspect"), "rad mod 2pi")}
    walk = {"kind": "linear", **angles, "F": [[1, 0], [0, 1]], "Q": [[sigma**2, 0], [0, sigma**2]]}
    return vedette.build(
        {
            "estimator": {"kind": "kalman", "motion": walk},
            "sensors": {"radar": {"kind": "linear", **angles, "R": [[1e-2, 0], [0, 4e-2]]}},
            "associator": {"kind": "pda"},
            "birth": {"kind": "given", "start": {"heading": [3.14, 0.2], "aspect": [-3.1, 0.1]}},
            "lifecycle": {"kind": "single_target"},
        }
    )


def right_problems() -> dict[str, list[Tracker]]:
    """Return trackers that are right, by what they are: exact ones, where chi-square holds, and those in clutter."""
    pairs = [(a, s) for a in (0.05, 0.5, 2.0, 20.0) for s in (1.0, 30.0)]
    usual, noisy = {"p_detect": 0.8, "clutter": 1e-5}, {"p_detect": 0.9, "clutter": 1e-4}
    return {
        "linear": [tracker_of(sigma_accel=a, sigma=s) for a, s in pairs],
        "no velocity": [tracker_of(sigma_accel=a, sigma=s, speed=0.0) for a, s in pairs],
        "angles that wrap": [turning_of(sigma) for sigma in (0.01, 0.1)],
        "clutter": [tracker_of(**level, speed=speed) for level in (usual, noisy) for speed in (0.0, 12.0)],
    }


def p_values(trackers: list[Tracker], problems: int, seed: int, runs: int = 40, scans: int = 12) -> dict[str, Array]:
    """Return two-sided p-values (problems,) of NIS and of NEES at the end, and of each report whether it gave an alarm."""
    each, found = problems // len(trackers), {"NIS": [], "NEES at the end": [], "alarm at .05": [], "alarm at .01": []}
    for k, tracker in enumerate(trackers):
        played = run(tracker, each * runs, scans, seed * 100 + k)
        look, n, m = played.looks["radar"], played.error.shape[-1], len(tracker.sensors["radar"].measurement)
        if played.exact:
            total = nees(look.residual, look.cov).reshape(each, -1).sum(axis=1)
            end = nees(played.error[:, -1], played.cov[:, -1]).reshape(each, -1).sum(axis=1)
            for name, values, dof in (("NIS", total, m * runs * scans), ("NEES at the end", end, n * runs)):
                below = stats.chi2.cdf(values, dof)
                found[name].append(2 * np.minimum(below, 1 - below))
        for level in (0.05, 0.01):
            alarms = [not judge(group(played, i, runs), level, BAND, 0).consistent for i in range(each)]
            found[f"alarm at {level:.2f}".replace("0.", ".")].append(np.array(alarms))
    return {name: np.concatenate(parts) for name, parts in found.items() if parts}


def size(problems: int = 2048) -> None:
    """Print how p-values and alarms of correct problems are distributed, by what the problems are."""
    kinds = right_problems()
    for seed, (kind, trackers) in enumerate(kinds.items()):
        found = p_values(trackers, problems // len(kinds), seed)
        for name, values in found.items():
            if values.dtype == bool:
                _say_size(f"{kind}: {name}", values)
                continue
            fit = stats.kstest(values, "uniform").pvalue
            print(f"{kind}: {name}, {len(values)} problems, Kolmogorov-Smirnov p = {fit:.3f}")
            for level in (0.05, 0.01):
                _say_size(f"{kind}:   size at {level}", values < level)


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


def alarms(trackers: int = 300) -> tuple[int, int, int, int]:
    """Return how many right trackers are exact, how many of these alarm at .05, and at 1e-6, and how many others do."""
    rng = np.random.default_rng(1)
    exact = at_05 = usual = others = 0
    for i in range(trackers):
        tracker = scene_of(rng)
        report = consistency(tracker, seed=i)
        exact += report.exact
        at_05 += report.exact and not consistency(tracker, seed=i, alpha=0.05).consistent
        usual += report.exact and not report.consistent
        others += not report.exact and not report.consistent
    print(
        f"{trackers} right trackers, {exact} of them exact: {at_05} alarms of these at .05, {usual} at 1e-6; {others} others"
    )
    return exact, at_05, usual, others


SAID = {
    "correlated": "are correlated in time",
    "heavy-tailed": "have heavy tails",
    "by distance": "change with the distance",
}
"""What a report says of each kind of errors."""


def errors_of(kind: str, rng: np.random.Generator) -> Errors:
    """Draw errors of a kind; white ones differ in nothing."""
    drawn = {"correlation": rng.uniform(0.4, 0.9), "wild": rng.uniform(0.03, 0.15), "growth": rng.uniform(1.0, 2.0)}
    names = {"correlated": "correlation", "heavy-tailed": "wild", "by distance": "growth"}
    return Errors(**{name: value for name, value in drawn.items() if name == names.get(kind)})


def scene_of(rng: np.random.Generator) -> Tracker:
    """Draw a right tracker, linear or with ranges and bearings, whose target departs or comes by, in 50 scans."""
    sigma, away = rng.uniform(2.0, 20.0), rng.uniform(200.0, 1500.0)
    radar = {"kind": "cartesian_position", "sigma": sigma}
    if polar := rng.random() < 0.5:
        radar = {"kind": "range_bearing", "sigma_range": sigma, "sigma_bearing": rng.uniform(0.002, 0.01)}
    speed, course = rng.uniform(8.0, 25.0), rng.uniform(-0.5, 0.5)
    start = {"x": [away, 20], "y": [away * rng.uniform(-0.5, 0.5), 20]}
    pace = {"vx": [speed * np.cos(course), 2], "vy": [speed * np.sin(course), 2]}
    motion = {"kind": "constant_velocity", "sigma_accel": rng.uniform(0.1, 1.0)}
    return vedette.build(
        {
            "estimator": {"kind": "ekf" if polar else "kalman", "motion": motion},
            "sensors": {"radar": radar | {"detection_probability": rng.uniform(0.7, 1.0)}},
            "associator": {"kind": "pda"},
            "birth": {"kind": "given", "start": start | pace},
            "lifecycle": {"kind": "single_target"},
        }
    )


def named(kind: str, worlds: int, seed: int = 0) -> tuple[int, list[str]]:
    """Return of how many drawn worlds a report names the kind of errors, and what it says of the others."""
    rng, other = np.random.default_rng((seed, sorted(["white", *SAID]).index(kind))), []
    for i in range(worlds):
        tracker = scene_of(rng)
        world = World(tracker.estimator, tracker.sensors, None, {"radar": errors_of(kind, rng)})
        report = consistency(tracker, world=world, seed=i)
        if report.consistent if kind == "white" else SAID[kind] not in report.cause:
            other.append(report.cause)
    return (worlds - len(other), other) if kind != "white" else (len(other), [])


def errors(worlds: int = 100) -> None:
    """Print of how many worlds the kind of errors is named, or nothing where they are white."""
    for kind in ("white", *SAID):
        count, other = named(kind, worlds)
        print(f"{kind}: {count} of {worlds}", *other, sep="\n  ", flush=True)


if __name__ == "__main__":
    if sys.argv[1:] == ["errors"]:
        errors()
    elif sys.argv[1:] == ["right"]:
        alarms()
    elif sys.argv[1:] == ["size"]:
        size()
    elif sys.argv[1:] == ["power"]:
        power({50: 40, 400: 40, 6000: 5})
    else:
        sys.exit(__doc__)
