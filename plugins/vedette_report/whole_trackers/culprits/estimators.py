"""What is wrong of the estimator itself: innovations that it reports, and points of which it has too few."""

from __future__ import annotations

import numpy as np
from attrs import evolve

from vedette import Array, Gaussian, Tracker, VedetteError
from vedette.metrics import free_axes, nees
from vedette_report.consistency import standard_error
from vedette_report.whole_trackers.runs import Runs, play
from vedette_report.whole_trackers.verdicts import REPORTED, normalised_innovations, reported_innovations
from vedette_report.whole_trackers.world import World

OTHERS = 0.1
"""What the logarithms of two NIS differ by if they are of other covariances: right IMM and UKF stay below 0.01."""
MORE = 4
"""So many times the points leave half of what the NEES of a run is off, or less, where 200 to 400 points are too few."""


def own_innovations(played: Runs, wrong: set[str]) -> str:
    """Say of which sensor the estimator reports other innovations than its prediction and R give, and which do not fit."""
    for name, reported in reported_innovations(played).items():
        own, made = float(np.nanmean(reported)), float(np.nanmean(normalised_innovations(played.looks[name])))
        bad = [f"NIS of {name}{of}" in wrong for of in (REPORTED, "")]
        if not any(bad) or abs(np.log(own / made)) < OTHERS:
            continue
        whose = {
            (True, False): "what `evaluate` reports is wrong",
            (False, True): f"what it reports fits, R of {name} or its prediction does not",
            (True, True): f"`evaluate` takes another R or prediction than are stated, mend it before Q and R of {name}",
        }[bad[0], bad[1]]
        said = f"{own:.3g} as `evaluate` reports it, {made:.3g} by its prediction and the sensor's R"
        return f"the innovation covariance of the estimator: the NIS of {name} is {said}: {whose}"
    return ""


def too_few_points(played: Runs, tracker: Tracker, world: World, prior: Gaussian, times: Array, runs: int, seed: int) -> str:
    """Say that an estimator has too few points, if most of what its NEES is off is gone with `MORE` times as many."""
    points, off = getattr(tracker.estimator, "particles", None), _log_nees(played)
    if not isinstance(points, int) or np.mean(off) <= 0:
        return ""
    try:
        several = evolve(tracker, estimator=evolve(tracker.estimator, particles=MORE * points))  # type: ignore[misc]
        more = play(several, prior, times, runs, np.random.default_rng(seed), world)
    except VedetteError:  # so many are not allowed
        return ""
    gone = off - _log_nees(more)
    if np.mean(gone) < max(0.5 * np.mean(off), 4 * standard_error(gone)):
        return ""
    size = float(np.exp(np.mean(gone)))
    return f"too few points: the NEES of a run is {size:.2g} times smaller with {MORE * points}; judge Q and R with so many"


def _log_nees(played: Runs) -> Array:
    """Return the logarithm of each run's mean NEES over what is expected (r,)."""
    free = free_axes(played.cov[:, 0])[:, None]
    return np.asarray(np.log(np.mean(nees(played.error, played.cov) / free, axis=1)))
