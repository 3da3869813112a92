"""What the paper has not, on matched truth: R given k, and detection without a base."""

import numpy as np
import pytest

import vedette
from vedette import Detections, Gaussian, Scan
from vedette.metrics import nees
from vedette.sampling import draw_gaussian, draw_states
from vedette.tracking import preprocessed
from vedette_bayes_risk.configs import SENSORS, SIGMA, Choice
from vedette_standard.motion.constant_velocity_piecewise import ConstantVelocityPiecewise
from vedette_study.lockstep import run_together

CHOICE = Choice(reach=2.5)
"""A threshold so near that a low count is common."""


def followed(config, runs=200, scans=60, q=6.0):
    """NEES over its expectation and mean square position error of each run; the truth is the filter's own model."""
    rng, motion = np.random.default_rng(11), ConstantVelocityPiecewise(q)
    prior = Gaussian(np.array([0.0, 0, 100, 100]), np.diag([SIGMA**2, SIGMA**2, 100.0, 100.0]))
    x0 = draw_gaussian(prior.mean, prior.cov, rng, (runs,))
    truth = draw_states(motion, x0, np.arange(scans + 1.0), rng)[:, 1:]
    valid, seen = np.ones((runs, 1), dtype=bool), []
    for i in range(scans):
        for name in SENSORS:
            z = truth[:, [i], :2] + SIGMA * rng.standard_normal((runs, 1, 2))
            seen.append(Scan(1.0 + i, name, Detections(z, valid)))
    built = vedette.load(config | {"source": None})
    given = Gaussian(np.broadcast_to(prior.mean, (runs, 1, 4)), np.broadcast_to(prior.cov, (runs, 1, 4, 4)))
    found = run_together(built.tracker, given, 0.0, preprocessed(iter(seen), built.preprocessors))
    last = np.flatnonzero(np.append(np.diff(found.times) > 0, True))
    kept = np.searchsorted(np.arange(1.0, scans + 1), found.times[last])
    error = found.mean[:, last] - truth[:, kept]
    return np.mean(nees(error, found.cov[:, last]), axis=1) / 4, np.mean(np.sum(error[..., :2] ** 2, axis=-1), axis=1)


@pytest.mark.statistical(alpha=1e-6)
@pytest.mark.costly
def test_with_r_given_k_the_filter_is_consistent_and_with_sigma_over_k_too_sure():
    """NEES / 4 1.00 +- .01 against 1.25; the RMS error is 4.5 m for 5.1 m."""
    (own, error), (printed, larger) = (
        followed(CHOICE.proposed(kind, "kalman")) for kind in ("bayes_risk_by_count", "bayes_risk_detection")
    )
    assert abs(own.mean() - 1.0) < 5 * own.std() / np.sqrt(len(own)) + 0.02
    assert printed.mean() > 1.15
    assert error.mean() < 0.9 * larger.mean()


@pytest.mark.statistical(alpha=1e-6)
def test_without_a_base_the_filter_is_consistent_and_errs_less():
    """At the study's threshold of 4 sigma."""
    own, error = followed(Choice().proposed("clustered_detection", "kalman", "pda"), runs=100)
    _, based = followed(Choice().proposed("bayes_risk_detection", "kalman"), runs=100)
    assert abs(own.mean() - 1.0) < 5 * own.std() / np.sqrt(len(own)) + 0.02
    assert error.mean() < based.mean()
