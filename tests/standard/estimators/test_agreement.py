"""Iterated, cubature, square-root and Gaussian-sum filters are equal where they must be."""

import numpy as np
import pytest
from attrs import evolve

from support.boats import prior
from vedette import Detections, kernels
from vedette_standard.estimators.cubature import CubatureKalman
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.imm import Imm
from vedette_standard.estimators.iterated import IteratedExtendedKalman
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.estimators.square_root import SquareRootKalman
from vedette_standard.estimators.unscented import UnscentedKalman
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.range_bearing import RangeBearing

RNG = np.random.default_rng(0)
"""Asked for by the signature; these filters draw nothing."""
CV = ConstantVelocity(0.5)
KINDS = [
    ExtendedKalman(CV),
    UnscentedKalman(CV),
    UnscentedKalman(CV, 0.3),
    CubatureKalman(CV),
    SquareRootKalman(CV),
    *(IteratedExtendedKalman(CV, passes) for passes in (1, 2, 7)),
]


def walk(estimator, sensor, at_start, weights=None, scans=6):
    """Moments and log likelihoods over some scans of three returns, softly associated."""
    rng = np.random.default_rng(5)
    belief = estimator.start(at_start, estimator.state, RNG)
    told = []
    for _ in range(scans):
        belief = estimator.predict(belief, 1.5, RNG)
        where = CV.state.locate(sensor.observes)
        z = sensor.measure(at_start.mean[:1, where] + 10 * rng.normal(size=(3, len(where))))
        innovation = estimator.evaluate(belief, sensor, Detections.of(z), 0.99)
        w = rng.random(innovation.loglik.shape)
        belief = estimator.update(belief, innovation, w / w.sum(axis=-1, keepdims=True))
        moments = estimator.moments(belief)
        told.append((moments.mean, moments.cov, innovation.loglik, innovation.distance, innovation.log_volume))
    return [np.stack(part) for part in zip(*told, strict=True)]


@pytest.mark.parametrize("estimator", KINDS, ids=lambda e: f"{e.kind}{getattr(e, 'passes', '')}")
def test_all_are_the_kalman_filter_on_a_linear_problem(estimator):
    at_start = prior(4, 2)
    sensor = CartesianPosition(5.0, 0.9)
    exact = walk(Kalman(CV), sensor, at_start)
    deviation = np.sqrt(np.diagonal(exact[1], axis1=-2, axis2=-1))
    found = walk(estimator, sensor, at_start)
    np.testing.assert_allclose((found[0] - exact[0]) / deviation, 0, atol=1e-9)
    np.testing.assert_allclose((found[1] - exact[1]) / (deviation[..., :, None] * deviation[..., None, :]), 0, atol=1e-9)
    for one, other in zip(found[2:], exact[2:], strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9)


def test_the_comparison_bites(monkeypatch):
    estimator, update = IteratedExtendedKalman(CV), kernels.weighted_update
    at_start, sensor = prior(4, 2), CartesianPosition(5.0, 0.9)
    exact = walk(Kalman(CV), sensor, at_start)[0]
    monkeypatch.setattr(kernels, "weighted_update", lambda x, P, shift, *rest: update(x, P, (1 + 1e-7) * shift, *rest))
    with pytest.raises(AssertionError):
        np.testing.assert_allclose(walk(estimator, sensor, at_start)[0], exact, rtol=0, atol=1e-9)


# In mixtures.
@pytest.mark.parametrize("mode", [IteratedExtendedKalman, CubatureKalman, SquareRootKalman], ids=lambda kind: kind.kind)
def test_an_imm_over_any_of_them_is_the_imm_over_kalman_filters(mode):
    models = (ConstantVelocity(0.1), ConstantVelocity(2.0))
    chain = np.array([[0.95, 0.05], [0.1, 0.9]])
    at_start, sensor = prior(4, 2), CartesianPosition(5.0, 0.9)
    exact, found = (walk(Imm(tuple(kind(m) for m in models), chain), sensor, at_start) for kind in (Kalman, mode))
    for one, other in zip(found, exact, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("estimator", KINDS[3:6], ids=lambda e: e.kind)
def test_the_detection_probability_enters_every_column(estimator):
    at_start, sensor = prior(4, 2), RangeBearing(10.0, 0.01, detection_probability=0.9)
    belief = estimator.start(at_start, CV.state, RNG)
    detections = Detections.of(sensor.measure(at_start.mean[:, :2]))
    likely = estimator.evaluate(belief, sensor, detections, 0.99).loglik
    rarely = estimator.evaluate(belief, evolve(sensor, detection_probability=0.3), detections, 0.99).loglik
    np.testing.assert_allclose(likely[:, 0], np.log(1 - 0.9 * 0.99), rtol=1e-12)
    np.testing.assert_allclose(likely[:, 1:] - rarely[:, 1:], np.log(3.0), rtol=1e-12)
