"""What a tracker expects of a scan is what its step goes on from: the same prediction, distances and gates."""

import numpy as np
import pytest

import vedette
from vedette import Detections, Gaussian, Scan, ScanRefused
from vedette.tracking import expected
from vedette_tools.tuning.likelihood import undetected_density

MEANS = np.array([[0.0, 0.0, 5.0, 0.0], [300.0, 0.0, 0.0, -5.0]])
PRIOR = Gaussian(MEANS, np.tile(np.diag([9.0, 9.0, 1.0, 1.0]), (2, 1, 1)))
RETURNS = [[10.0, 1.0], [302.0, -9.0], [30.0, 40.0], [900.0, 900.0]]


def tracker_of(associator="jpda", **more):
    sensor = {"kind": "cartesian_position", "sigma": 3.0, "detection_probability": 0.9, "clutter_density": 1e-4}
    config = {
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
        "sensors": {"radar": sensor},
        "associator": {"kind": associator},
        "birth": {"kind": "given", "start": {"x": [0, 5], "y": [0, 5], "vx": [0, 1], "vy": [0, 1]}},
        "lifecycle": {"kind": "existence"},
    }
    return vedette.build(config | more)


def scan(time=2.0):
    return Scan(time, "radar", Detections.of(RETURNS))


@pytest.mark.parametrize("associator", ["jpda", "n_scan", "k_best", "lmb"])
def test_the_tracks_are_those_that_the_tracker_predicts(associator):
    tracker = tracker_of(associator)
    state = tracker.step(tracker.start(PRIOR, 0.0), scan(1.0))
    it, ahead = tracker.expect(state, scan()), tracker.estimate(state, 2.0)
    np.testing.assert_array_equal(it.tracks.mean, ahead.mean)
    np.testing.assert_array_equal(it.tracks.cov, ahead.cov)
    assert it.dt == 1.0


def test_distances_are_in_units_of_s_and_beyond_the_threshold_nothing_counts():
    tracker = tracker_of()
    state = tracker.start(PRIOR, 0.0)
    it, after = tracker.expect(state, scan()), tracker.step(state, scan())
    z, S, _ = it.returns_of(it.tracks)
    residual = np.array(RETURNS) - z[:, None]
    distance = np.einsum("tki,tij,tkj->tk", residual, np.linalg.inv(S), residual)
    np.testing.assert_allclose(it.innovation.distance, distance, rtol=1e-9)
    np.testing.assert_array_equal(it.innovation.distance, after.distances)
    np.testing.assert_array_equal(after.weights[:, 1:] > 0, distance <= it.gate.threshold)
    assert 0 < np.count_nonzero(after.weights[:, 1:]) < after.distances.size


def test_a_covariance_without_noise_is_noticed(monkeypatch):
    real = expected.expected_return

    def without_noise(tracks, state, sensor, noise):
        z, S, H = real(tracks, state, sensor, noise)
        return z, S - sensor.noise(tracks.mean[..., :2]), H

    monkeypatch.setattr(expected, "expected_return", without_noise)
    with pytest.raises(AssertionError):
        test_distances_are_in_units_of_s_and_beyond_the_threshold_nothing_counts()


def test_existence_is_that_of_the_time_of_the_scan():
    tracker = tracker_of(lifecycle={"kind": "existence", "lifetime": 100.0})
    it = tracker.expect(tracker.start(PRIOR, 0.0), scan())
    assert it.existence == pytest.approx(np.exp(-2.0 / 100.0))


def test_undetected_targets_give_returns_elsewhere_as_densely_as_at_the_scans_own():
    place = {"at": {"x": [0, 500], "y": [0, 500], "vx": [0, 5], "vy": [0, 5]}, "initial": 2.0, "rate": 0.1}
    tracker = tracker_of(birth={"kind": "poisson", "appear": [place]})
    it = tracker.expect(tracker.start(time=0.0), scan())
    assert np.all(it.rate > 0)
    np.testing.assert_array_equal(undetected_density(it, it.observed), it.rate)
    assert undetected_density(tracker_of().expect(tracker_of().start(PRIOR, 0.0), scan()), it.observed) is None


def test_nothing_is_expected_of_a_scan_that_a_step_refuses():
    tracker = tracker_of()
    with pytest.raises(ScanRefused, match="time"):
        tracker.expect(tracker.start(PRIOR, 3.0), scan())
    with pytest.raises(TypeError):
        tracker.expect(tracker, scan())
