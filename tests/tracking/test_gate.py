"""The gate makes scores: thresholds, volumes, clutter and existence, each against its formula."""

import math

import numpy as np
import pytest

from vedette import Detections, Gate, Innovation
from vedette_standard.sensors.cartesian_position import CartesianPosition


def innovation(loglik, distance, log_volume):
    return Innovation(np.array(loglik), np.array(distance), np.array(log_volume), np.array(distance), None)


def test_threshold_is_the_chi_square_quantile():
    # For 2 axes the chi-square distribution is exponential: the quantile has a closed form.
    assert Gate(0.99).threshold(2) == pytest.approx(-2 * math.log(0.01), rel=1e-12)
    # For 1 axis it is a squared normal: 99.73 % lie within three standard deviations.
    assert Gate(math.erf(3 / math.sqrt(2))).threshold(1) == pytest.approx(9.0, rel=1e-9)


@pytest.mark.parametrize(
    ("axes", "volume"), [(1, lambda r: 2 * r), (2, lambda r: math.pi * r**2), (3, lambda r: 4 / 3 * math.pi * r**3)]
)
def test_sample_density_is_count_over_volume(axes, volume):
    gate, sensor = Gate(0.9, "nonparametric"), SensorOf(axes)
    threshold, seen = gate.threshold(axes), Detections.of(np.zeros((4, axes)))
    distances = threshold * np.array([[0.2, 0.4, 0.99, 1.01]])
    scores = gate.scores(
        innovation([[-1.0, -2.0, -2.0, -2.0, -2.0]], distances, [0.7]), sensor, seen, np.ones(1), gate.for_sensor(sensor)
    )
    density = 3 / (volume(math.sqrt(threshold)) * math.exp(0.7))
    np.testing.assert_allclose(scores, [[-1.0, *[-2.0 - math.log(density)] * 3, -np.inf]])


class SensorOf:
    """Only what the gate asks of a sensor here: how many axes it measures."""

    def __init__(self, axes):
        self.measurement = range(axes)


def test_invalid_and_far_returns_are_forbidden_and_evidence_is_added():
    detections = Detections(np.zeros((3, 2)), np.array([True, False, True]), evidence=np.array([1.5, 1.5, 1.5]))
    gate, sensor = Gate(0.99), CartesianPosition(1.0, clutter_density=0.25)
    found = innovation([[-1.0, -2.0, -2.0, -2.0]], [[1.0, 1.0, 99.0]], [0.0])
    scores = gate.scores(found, sensor, detections, np.ones(1), gate.for_sensor(sensor))
    np.testing.assert_allclose(scores, [[-1.0, -2.0 - math.log(0.25) + 1.5, -np.inf, -np.inf]])


@pytest.mark.parametrize("existence", [1.0, 0.3, 0.0])
def test_existence_enters_as_bayes_says(existence):
    miss, return_ = -1.2, 0.8
    gate, sensor, seen = Gate(0.99), CartesianPosition(1.0, clutter_density=1.0), Detections.of([[0.0, 0.0]])
    found = innovation([[miss, return_]], [[0.5]], [0.0])
    scores = gate.scores(found, sensor, seen, np.array([existence]), gate.for_sensor(sensor))
    expected = [1 - existence + existence * math.exp(miss), existence * math.exp(return_)]
    np.testing.assert_allclose(np.exp(scores[0]), expected, atol=1e-300)


def test_no_clutter_at_all_stays_finite():
    sensor = CartesianPosition(1.0, detection_probability=1.0, clutter_density=0.0)
    gate, seen = Gate(0.99), Detections.of([[0.0, 0.0]])
    scores = gate.scores(innovation([[-4.6, -2.0]], [[0.5]], [0.0]), sensor, seen, np.ones(1), gate.for_sensor(sensor))
    assert np.isfinite(scores).all()
    assert scores[0, 1] > scores[0, 0] + 100
