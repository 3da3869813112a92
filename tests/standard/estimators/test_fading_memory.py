"""The fading-memory filter against the textbook's lines, and its limits."""

import numpy as np
import pytest

import vedette
from vedette import Gaussian
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.fading_memory import FadingMemory
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.sensors.cartesian_position import CartesianPosition

MOTION = ConstantVelocity(0.3)
RNG = np.random.default_rng(0)
BELIEF = Gaussian(np.array([[1.0, 2.0, 3.0, -1.0]]), np.diag([4.0, 9.0, 1.0, 2.0])[None])


def test_without_fading_it_is_the_extended_filter():
    one, other = FadingMemory(MOTION, 1.0).predict(BELIEF, 2.0, RNG), ExtendedKalman(MOTION).predict(BELIEF, 2.0, RNG)
    np.testing.assert_array_equal(one.mean, other.mean)
    np.testing.assert_array_equal(one.cov, other.cov)


def test_a_track_is_the_textbooks():
    """P- = alpha^2 F P F' + Q at each step of 2 s, the rest as ever."""
    parts = {
        "estimator": FadingMemory(MOTION, 1.1, 2.0),
        "sensors": {"s": {"kind": "cartesian_position", "sigma": 2.0}},
        "associator": {"kind": "gnn"},
        "birth": {"kind": "given"},
        "lifecycle": {"kind": "single_target"},
        "gate": "off",
    }
    tracker = vedette.build({**parts, "birth": None})
    state = tracker.start(BELIEF, 0.0, 1)
    x, P, H = BELIEF.mean[0], BELIEF.cov[0], np.eye(2, 4)
    F, Q = MOTION.jacobian(x, 2.0), MOTION.noise(x, 2.0)
    for k in range(1, 30):
        z = np.array([3.0 * k, 2.0 - k])
        state = tracker.step(state, vedette.Scan(2.0 * k, "s", [z.tolist()]))
        x, P = F @ x, 1.1**2 * F @ P @ F.T + Q
        K = P @ H.T @ np.linalg.inv(H @ P @ H.T + 4.0 * np.eye(2))
        x, P = x + K @ (z - H @ x), P - K @ H @ P
        np.testing.assert_allclose(tracker.estimate(state).mean[0], x, rtol=1e-9)
        np.testing.assert_allclose(tracker.estimate(state).cov[0], P, rtol=1e-9)


def test_fading_does_not_depend_on_how_time_is_cut():
    still = FadingMemory(ConstantVelocity(1e-9), 1.2)
    whole = still.predict(BELIEF, 3.0, RNG)
    cut = still.predict(still.predict(BELIEF, 1.0, RNG), 2.0, RNG)
    np.testing.assert_allclose(whole.cov, cut.cov, rtol=1e-9)


def test_it_follows_a_turn_that_its_motion_does_not_know():
    """A target on a circle: the plain filter lags by more."""

    def error(estimator):
        belief = Gaussian(np.array([[100.0, 0.0, 0.0, 10.0]]), np.eye(4)[None])
        sensor, off = CartesianPosition(sigma=1.0), []
        for k in range(1, 60):
            true = 100.0 * np.array([np.cos(0.1 * k), np.sin(0.1 * k)])
            belief = estimator.predict(belief, 1.0, RNG)
            found = estimator.evaluate(belief, sensor, vedette.Detections.of([true.tolist()]), 1.0)
            belief = estimator.update(belief, found, np.array([[0.0, 1.0]]))
            off.append(np.linalg.norm(belief.mean[0, :2] - true))
        return np.mean(off[20:])

    slow = ConstantVelocity(0.01)
    assert error(FadingMemory(slow, 1.3)) < 0.2 * error(ExtendedKalman(slow))


def test_a_memory_that_grows_is_refused():
    with pytest.raises(ValueError, match=r"alpha: must be >= 1, got 0\.9"):
        FadingMemory(MOTION, 0.9)
