"""The smoother of an ensemble: what it makes of drawn points is as surely known as it says."""

from __future__ import annotations

import numpy as np
import pytest
from attrs import frozen

import vedette
from vedette_standard import ConstantVelocity, EnsembleKalman, Kalman

QUIET = ConstantVelocity(0.05)
"""Little noise a step: by moments of other draws, smoothed covariances were 1.9 to 3.5 times too large."""


def tracker_of(estimator):
    parts = {
        "estimator": estimator,
        "sensors": {"radar": {"kind": "cartesian_position", "sigma": 10.0}},
        "associator": {"kind": "pda"},
        "birth": {"kind": "given", "start": {"x": [0, 20], "y": [0, 20], "vx": [0, 2], "vy": [0, 2]}},
        "lifecycle": {"kind": "single_target"},
    }
    return vedette.build(parts)


def smoothed(estimator):
    tracker, rng = tracker_of(estimator), np.random.default_rng(4)
    states = [tracker.start(seed=2)]
    for k in range(30):
        seen = vedette.Detections.of(rng.normal(0.0, 10.0, (1, 2)))
        states.append(tracker.step(states[-1], vedette.Scan(2.0 * k, "radar", seen)))
    return vedette.smooth(tracker, states[1:])[0]


def test_smoothed_covariances_of_an_ensemble_are_the_kalman_smoothers():
    exact, drawn = (smoothed(estimator).cov[:25] for estimator in (Kalman(QUIET), EnsembleKalman(QUIET, members=1000)))
    ratio = np.diagonal(drawn, axis1=1, axis2=2) / np.diagonal(exact, axis1=1, axis2=2)
    assert np.all(np.abs(np.mean(ratio, axis=0) - 1.0) < 0.25)


@frozen
class Drawing(vedette.filters.OverMotion):
    """States a cross covariance, and draws."""

    kind = "drawing"
    declares = vedette.Traits(draws=True)
    motion: vedette.MotionModel = vedette.fields.part("how it moves")

    start = EnsembleKalman.start
    predict = EnsembleKalman.predict
    evaluate = EnsembleKalman.evaluate
    update = EnsembleKalman.update
    moments = EnsembleKalman.moments
    cross_covariance = EnsembleKalman.cross_covariance
    _moments = EnsembleKalman._moments
    members = 30


def test_one_that_draws_without_moments_ahead_is_refused():
    with pytest.raises(vedette.ConfigError, match=r"estimator: .*`ahead`"):
        vedette.tracking.check_smoothing(tracker_of(Drawing(QUIET)))
