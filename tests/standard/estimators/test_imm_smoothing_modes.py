"""A smoothed IMM of one mode, in clutter, and of modes of unlike states."""

import numpy as np
import pytest
from attrs import evolve, frozen
from scipy.linalg import block_diag

from support.enumeration import drawn, enumerated, smoothed_imm
from support.models import Looking, space
from support.smoothing import RADAR, TURN, estimates, states_of, tracker_of, turning
from vedette import Detections, Gaussian, MotionModel
from vedette.kernels import backward
from vedette.tracking.smoothing import smoothed
from vedette_standard.associators.pda import Pda
from vedette_standard.estimators import imm as imm_module
from vedette_standard.estimators import imm_backward
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.imm import Imm
from vedette_standard.estimators.kalman import Kalman

REAL = {
    "smooth_step": backward.smooth_step,
    "future_likelihood": imm_backward.future_likelihood,
    "pair_posterior": imm_backward.pair_posterior,
}


def check_one_mode():
    """Two returns to either side of the target in each scan: either may be its own."""
    _, scans, prior = turning(np.random.default_rng(2), 5, 8)
    aside = np.array([[12.0, 0.03], [-12.0, -0.03]])
    both = [Detections(scan.detections.z[:, :1] + aside, np.ones((5, 2), dtype=bool)) for scan in scans]
    scans = [evolve(scan, detections=seen) for scan, seen in zip(scans, both, strict=True)]
    found = []
    for estimator in (ExtendedKalman(TURN), Imm((ExtendedKalman(TURN),), transition=[[1.0]])):
        tracker = tracker_of(estimator, {"radar": RADAR}, Pda())
        states = states_of(tracker, prior, scans, -1.0)
        found.append(estimates(tracker, smoothed(tracker, states)))
    np.testing.assert_allclose(found[1][0], found[0][0], rtol=1e-8, atol=1e-7)
    np.testing.assert_allclose(found[1][1], found[0][1], rtol=1e-7, atol=1e-6)


def test_one_mode_is_that_modes_own_smoothing_in_clutter_too():
    """There the belief after an ambiguous scan is at times wider than before, and no likelihood says so."""
    check_one_mode()


def test_the_comparison_needs_the_wider_belief(monkeypatch):
    monkeypatch.setattr(
        imm_module,
        "future_likelihood",
        lambda *given: evolve(
            REAL["future_likelihood"](*given), growth=np.ones_like(REAL["future_likelihood"](*given).growth)
        ),
    )
    with pytest.raises(AssertionError):
        check_one_mode()


@frozen
class OneAxisVelocity(MotionModel):
    """Position and velocity on a line."""

    q: float
    kind = "test_line_velocity"
    linear = True
    state = space("x", 2)

    def jacobian(self, x, dt):
        return np.array([[1.0, dt], [0.0, 1.0]])

    def move(self, x, dt):
        return x @ self.jacobian(x, dt).T

    def noise(self, x, dt):
        return self.q * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])


@frozen
class OneAxisAcceleration(MotionModel):
    """The same with an acceleration, a random walk."""

    q: float
    kind = "test_line_acceleration"
    linear = True
    state = space("x", 3)

    def jacobian(self, x, dt):
        return np.array([[1.0, dt, dt**2 / 2], [0.0, 1.0, dt], [0.0, 0.0, 1.0]])

    def move(self, x, dt):
        return x @ self.jacobian(x, dt).T

    def noise(self, x, dt):
        g = np.array([[dt**2 / 2], [dt], [1.0]])
        return self.q * g @ g.T + 1e-6 * dt * np.eye(3)


@frozen
class Whole(MotionModel):
    """A model without the last axis, over all axes: that one is drawn anew, as `absent` says."""

    part: MotionModel
    deviation: float
    kind = "test_whole"
    linear = True
    state = space("x", 3)

    def jacobian(self, x, dt):
        return block_diag(self.part.jacobian(x, dt), 0.0)

    def move(self, x, dt):
        return x @ self.jacobian(x, dt).T

    def noise(self, x, dt):
        return block_diag(self.part.noise(x, dt), self.deviation**2)


def check_unlike(dts, distance_below, wrong_below):
    cv, ca, deviation = OneAxisVelocity(0.01), OneAxisAcceleration(0.2), 0.8
    transition = np.array([[0.9, 0.1], [0.2, 0.8]])
    sensor = Looking(np.array([[1.0, 0.0, 0.0]]), 0.25 * np.eye(1), p=0.5)
    prior = Gaussian(np.zeros((1, 3)), np.diag([4.0, 4.0, deviation**2])[None])
    models = (Whole(cv, deviation), ca)
    _, zs = drawn(models, transition, sensor, prior, dts, 100, 3)
    imm = Imm((Kalman(cv), Kalman(ca)), transition=transition, absent={"x2": (0.0, deviation)})
    imm_sensor = Looking(np.array([[1.0]]), sensor.R, p=0.5)
    _, mean, _, prob = smoothed_imm(imm, imm_sensor, prior, dts, zs)
    exact_mean, exact_cov, exact_prob = enumerated(models, transition, sensor, prior, dts, zs)
    # A mode that lacks the axis has it as `absent` in the mixture, so only the shared axes are compared.
    apart, own = (mean - exact_mean)[..., :2], exact_cov[..., :2, :2]
    distance = np.mean(np.sum(apart * np.linalg.solve(own, apart[..., None])[..., 0], -1)) / 2
    assert distance < distance_below
    assert np.mean(np.abs(prob - exact_prob)) < wrong_below


def test_modes_of_unlike_states_equal_enumeration_with_the_absent_axis_drawn_anew():
    check_unlike([1.3], 1e-16, 1e-9)
    check_unlike([1.0, 0.7, 1.0, 1.5, 1.0, 0.5], 0.01, 0.03)
