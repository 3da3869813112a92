"""Association of returns in the gate, and the printed covariance."""

import numpy as np

from vedette import Detections, Gaussian
from vedette_bayes_risk.associator import BayesRisk
from vedette_bayes_risk.parallel import ParallelKalmanPrinted
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.sensors.cartesian_position import CartesianPosition


# Weights and mixture.
def test_weights_follow_the_evidence_of_what_is_in_the_gate():
    scores = np.array([[[0.0, 5.0, -np.inf, -9.0]], [[0.0, -np.inf, -np.inf, -np.inf]]])
    evidence = np.log([[[1.0, 7.0, 3.0]], [[1.0, 7.0, 3.0]]])
    weights = BayesRisk().associate(scores, evidence)
    np.testing.assert_allclose(weights[0], [[0, 0.25, 0, 0.75]])
    np.testing.assert_array_equal(weights[1], [[1, 0, 0, 0]])  # nothing is left: the track coasts
    np.testing.assert_allclose(BayesRisk().associate(scores[:1], None)[0], [[0, 0.5, 0, 0.5]])
    np.testing.assert_array_equal(BayesRisk().associate(np.zeros((2, 3, 1)), None), np.ones((2, 3, 1)))


def test_the_printed_covariance_is_the_mixtures_less_the_spread_of_the_means():
    motion, sensor = ConstantVelocity(1.0), CartesianPosition(5.0)
    belief = Gaussian(np.zeros((1, 4)), np.diag([90.0, 80, 10, 10])[None])
    detections = Detections.of([[10.0, 0], [-20, 5]])
    weights = np.array([[0.2, 0.5, 0.3]])
    printed, right = ParallelKalmanPrinted(motion), Kalman(motion)
    innovation = right.evaluate(belief, sensor, detections, 0.99)
    ours = printed.update(belief, printed.evaluate(belief, sensor, detections, 0.99), weights)
    mixture = right.update(belief, innovation, weights)
    means = np.concatenate([np.zeros((1, 4)), innovation.detail.shift[0]])
    apart = means - weights[0] @ means
    np.testing.assert_allclose(ours.mean, mixture.mean, rtol=1e-12)
    np.testing.assert_allclose(mixture.cov[0] - ours.cov[0], np.einsum("i,ia,ib->ab", weights[0], apart, apart), atol=1e-9)
