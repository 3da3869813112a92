"""Laws of estimators that take long: covariances that last, and errors that are as large as they say."""

from __future__ import annotations

from typing import Any

import numpy as np
from attrs import evolve

from vedette.filters import predicted
from vedette.metrics.consistency import nees
from vedette.roles import Estimator
from vedette.space import Space
from vedette.testing.bands import judge_run_means, judge_scale
from vedette.testing.comparisons import Misuse, closed_by, closed_if, covariance, demand, finite
from vedette.testing.law import Law
from vedette.testing.laws import estimator_cases as cases
from vedette.testing.laws.estimator_cases import Scene
from vedette.testing.sensors import Watch
from vedette.testing.states import without_variance
from vedette.testing.truth import draw_moded, modes_of, motion_of
from vedette.types import Detections, Gaussian

EQUIVALENCE = (0.85, 1.15)
"""Where an estimator that is not exact may have its mean NEES and NIS, as a share of what is expected."""

NEARLY_ALL = 1.0 - 1e-12
"""The probability that a target's return is in its gate."""

MOMENT, RETURNS = 1e-6, ((2.0, -1.0), (0.25, 1.0))
"""A time step in s, and returns: their variance as a share of a belief's, and on which side they are."""


def covariances_survive_a_long_run(estimator: Estimator[Any], drawn: Scene) -> None:
    """Covariances stay symmetric and positive definite through thousands of ill-conditioned steps.

    Noises of the measurement are 1e-6 to 1e6 times what the motion adds, and the prior is 1e6 times the larger.
    """
    rng, state = drawn.rng(), estimator.state
    observes = Space(drawn.watch.observes.axes[:1])
    cases.started(estimator, drawn, rng)
    i, n = state.locate(observes)[0], len(state)
    mean = np.broadcast_to(drawn.prior.mean[0, :1], (13, 1, n))
    tight = Gaussian(mean, np.broadcast_to(1e-12 * np.eye(n), (13, 1, n, n)))
    sure = estimator.start(without_variance(tight, state, estimator.zero_variance), state, rng)
    added = estimator.moments(predicted(estimator, sure, 1.0, rng)).cov
    noise = np.logspace(-6, 6, 13) * np.median(added[..., i, i])
    wide = np.maximum(noise[:, None, None, None], added) * 1e6
    cov = np.eye(n) * np.diagonal(wide, axis1=-2, axis2=-1)[..., None, :]
    belief = estimator.start(without_variance(Gaussian(mean, cov), state, estimator.zero_variance), state, rng)
    watch = Watch(observes, np.eye(1))
    R, valid = noise[:, None, None, None], np.ones((13, 1), dtype=bool)
    for step in range(drawn.steps):
        belief = predicted(estimator, belief, 1.0, rng)
        centre = estimator.moments(belief).mean[..., i : i + 1]
        demand(centre.shape == (13, 1, 1), f"mean after {step} steps: must have batch (13, 1), got {centre.shape[:-1]}")
        # Every third scan a second, almost equal look follows at once: nothing is left to learn, the subtraction is all.
        for _ in range(2 if step % 3 == 0 else 1):
            belief = cases.after_scan(estimator, belief, watch, Detections(centre, valid, noise=R), p_gate=NEARLY_ALL)
        if step % 97 == 0 or step < 30:
            _still_covariance(estimator, belief, step)
    _still_covariance(estimator, belief, drawn.steps)


def _still_covariance(estimator: Estimator[Any], belief: Any, step: int) -> None:
    cov = estimator.moments(belief).cov
    free = estimator.state.locate(cases.free_axes(estimator))
    finite(f"covariance after {step} steps", cov)
    variance = np.diagonal(cov, axis1=-2, axis2=-1)[..., free]
    demand(np.all(variance > 0), f"covariance after {step} steps: a variance is {variance.min():.3g}, must be > 0")
    covariance(f"covariance after {step} steps", cov[..., free, :][..., free], definite=False)


def nees_and_nis_fit_matched_truth(estimator: Estimator[Any], drawn: Scene) -> None:
    """On truth drawn from its own models, errors are as large as the covariance says, and so are innovations.

    Chi-square where it is exact and its motion linear; else the mean, one value a run, lies in a band of 15 %; or below it,
    if the estimator is `conservative`.
    """
    rng, state, runs = drawn.rng(), estimator.state, drawn.runs
    scans = 12 if estimator.traits.draws else 36  # what adapts takes its time, what draws takes ours
    motion = motion_of(estimator)
    mean, cov = drawn.prior.mean[0, 0], drawn.prior.cov[0, 0]
    cases.started(estimator, drawn, rng)
    if modes_of(estimator):
        cases.holdable(estimator, drawn.prior)
    interval = 2.0 if motion is not None and motion.linear else 0.2  # long enough for what the motion adds to count
    times = interval * np.arange(scans + 1)
    prior = Gaussian(mean, 0.04 * cov)
    with closed_by(Misuse, "{}"):
        truth, _ = draw_moded(estimator, prior, times, rng, runs)
    n, m = len(state) - len(estimator.zero_variance), len(drawn.watch.R)
    where = state.locate(drawn.watch.observes)
    watch = evolve(drawn.watch, R=0.04 * drawn.watch.R, probability=1.0)
    root = np.linalg.cholesky(watch.R)
    many = Gaussian(np.broadcast_to(prior.mean, (runs, 1, len(state))), np.broadcast_to(prior.cov, (runs, 1, *cov.shape)))
    belief = estimator.start(many, state, rng)
    errors, shocks = [], []
    for scan in range(1, scans + 1):
        belief = predicted(estimator, belief, float(times[scan] - times[scan - 1]), rng)
        z = watch.measure(truth[:, scan, where]) + rng.standard_normal((runs, m)) @ root.T
        detections = Detections(watch.measurement.canonical(z)[:, None], np.ones((runs, 1), dtype=bool))
        innovation = estimator.evaluate(belief, watch, detections, NEARLY_ALL)
        shocks.append(innovation.nis[:, 0, 0])
        belief = estimator.update(belief, innovation, cases.sure(innovation.loglik, 1))
        found = estimator.moments(belief)
        errors.append(nees(state.difference(truth[:, scan], found.mean[:, 0]), found.cov[:, 0]))
    if estimator.traits.exact_when_linear and motion is not None and motion.linear:
        judge_scale("NIS", np.array(shocks).ravel(), m, drawn.alpha / 2)
        for values in (errors[0], errors[-1]):
            judge_scale("NEES", values, n, drawn.alpha / 4)
    else:
        low, high = (0.0 if estimator.traits.conservative else EQUIVALENCE[0]), EQUIVALENCE[1]
        judge_run_means("NIS", np.mean(shocks, axis=0) / m, low, high, drawn.alpha / 2)
        judge_run_means("NEES", np.mean(errors, axis=0) / n, low, high, drawn.alpha / 2)


def _one_axis(estimator: Estimator[Any], drawn: Scene) -> tuple[Any, Watch, Gaussian, float, int]:
    """Many beliefs a moment after they began alike, a sensor of an axis as sharp as they are, their moments, 1.5 of their
    deviations and which axis it is.
    """
    closed_if(not estimator.traits.draws, "it does not draw: other laws are sharper")
    rng, state = drawn.rng(), estimator.state
    cases.started(estimator, drawn, rng)
    mean, cov = drawn.prior.mean[0, 0], drawn.prior.cov[0, 0]
    observes = Space(drawn.watch.observes.axes[:1])
    i = state.locate(observes)[0]
    watch = Watch(observes, cov[i : i + 1, i : i + 1], 1.0)
    shape = (drawn.runs, 1, len(state))
    belief = estimator.start(Gaussian(np.broadcast_to(mean, shape), np.broadcast_to(cov, (*shape, len(state)))), state, rng)
    belief = predicted(estimator, belief, MOMENT, rng)
    return belief, watch, estimator.moments(belief), 1.5 * float(np.sqrt(cov[i, i])), i


def a_return_counts_once(estimator: Estimator[Any], drawn: Scene) -> None:
    """If it draws: two returns, the second the sharper, move and shrink it as they do a Gaussian, in the mean over draws."""
    belief, watch, before, step, i = _one_axis(estimator, drawn)
    state, rng, variance = estimator.state, drawn.rng(), drawn.prior.cov[0, 0, i, i]
    known, centre = np.array([1.0, 0.0]), watch.measure(drawn.prior.mean[0, 0, i : i + 1])
    for share, off in RETURNS:
        z = np.broadcast_to(watch.measurement.canonical(centre + off * step), (drawn.runs, 1, 1))
        belief = predicted(estimator, belief, MOMENT, rng)
        detections, sharper = Detections(z, np.ones((drawn.runs, 1), dtype=bool)), evolve(watch, R=share * watch.R)
        belief = cases.after_scan(estimator, belief, sharper, detections, p_gate=NEARLY_ALL)
        known += np.array([1.0, off]) / share
    for when in ("", ", a moment later"):
        after = estimator.moments(belief)
        moved = state.difference(after.mean, before.mean)[:, 0, i] / (step * known[1] / known[0])
        judge_run_means(f"mean, moved{when}", moved, *EQUIVALENCE, drawn.alpha / 4)
        judge_run_means(f"variance{when}", after.cov[:, 0, i, i] / (variance / known[0]), *EQUIVALENCE, drawn.alpha / 4)
        for _ in range(0 if when else 6):
            belief = cases.forget(estimator, belief, drawn, rng)


def soft_weights_mix_what_is_drawn(estimator: Estimator[Any], drawn: Scene) -> None:
    """If it draws: two returns of equal weight, one on either side, leave the variance of their mixture, on average."""
    belief, watch, before, step, i = _one_axis(estimator, drawn)
    z = watch.measurement.canonical(watch.measure(before.mean[:, 0, i : i + 1])[:, None] + step * np.array([[1.0], [-1.0]]))
    innovation = estimator.evaluate(belief, watch, Detections(z, np.ones(z.shape[:2], dtype=bool)), NEARLY_ALL)
    halves = (cases.sure(innovation.loglik, 1) + cases.sure(innovation.loglik, 2)) / 2
    after = estimator.moments(estimator.update(belief, innovation, halves))
    wanted = drawn.prior.cov[0, 0, i, i] / 2 + step**2 / 4
    judge_run_means("variance", after.cov[:, 0, i, i] / wanted, *EQUIVALENCE, drawn.alpha)


LAWS = (
    Law(covariances_survive_a_long_run, needs="not traits.draws", effort="long"),
    *(Law(law, effort="statistical") for law in (a_return_counts_once, soft_weights_mix_what_is_drawn)),
    Law(nees_and_nis_fit_matched_truth, effort="statistical"),
)
