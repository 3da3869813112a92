"""The target-oriented models, against their own equations."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vedette_standard.motion.known_turn import KnownTurn
from vedette_target_oriented.along_velocity import chord
from vedette_target_oriented.certain import TargetOrientedCertain
from vedette_target_oriented.consistent import TargetOriented
from vedette_target_oriented.literal import TargetOrientedLiteral

PROFILE = settings(max_examples=60)
HEADINGS = st.floats(-np.pi, np.pi)
RESETTING = (TargetOrientedLiteral, TargetOrientedCertain)


def frame(heading):
    """Forward and right as columns, over position and velocity: the paper's equation 3."""
    c, s = np.cos(heading), np.sin(heading)
    return np.array([[c, s], [s, -c]])


def turn(angle):
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def printed_noise(heading, forward, side, dt):
    """Equation 7 as printed: the plus and the missing cosine in q12 are the paper's."""
    c, s, f, a = np.cos(heading), np.sin(heading), forward**2, side**2
    Q = np.zeros((4, 4))
    Q[0, 0], Q[1, 1] = (f * c * c + a * s * s) * dt**4 / 4, (f * s * s + a * c * c) * dt**4 / 4
    Q[0, 1] = Q[1, 0] = (f + a) * s * dt**4 / 4
    Q[0, 2] = Q[2, 0] = f * c * dt**3 / 2
    Q[0, 3] = Q[3, 0] = a * s * dt**3 / 2
    Q[1, 2] = Q[2, 1] = f * s * dt**3 / 2
    Q[1, 3] = Q[3, 1] = -a * c * dt**3 / 2
    Q[2, 2], Q[3, 3] = f * dt**2, a * dt**2
    return Q


# Equations.
@pytest.mark.parametrize("kind", RESETTING)
@PROFILE
@given(HEADINGS, st.floats(0.1, 10), st.floats(0.1, 50), st.floats(0.01, 5))
def test_the_derived_noise_is_a_covariance_and_the_printed_one_is_not(kind, heading, forward, side, dt):
    """Printed and derived agree on every entry but q12, and on that where the heading is along x."""
    x = np.array([10.0, 20, 300, 5, heading, 0, 0])
    Q = kind(forward, side).noise(x, dt)
    gain = np.vstack([frame(heading) * dt**2 / 2, np.eye(2) * dt])
    derived = gain @ np.diag([forward**2, side**2]) @ gain.T
    np.testing.assert_allclose(Q[:4, :4], derived, rtol=1e-9, atol=1e-12 * np.trace(derived))
    assert not Q[4:].any()
    assert not Q[:, 4:].any()
    scale = np.sqrt(np.diag(derived))
    assert np.linalg.eigvalsh(derived / np.outer(scale, scale))[0] > -1e-12
    printed = printed_noise(heading, forward, side, dt)
    apart = np.abs(printed - derived) > 1e-9 * np.trace(derived)
    apart[0, 1] = apart[1, 0] = False
    assert not apart.any()


def test_the_printed_q12_fails_the_law_that_noise_is_a_covariance():
    headings = np.linspace(-np.pi, np.pi, 1001)
    printed = np.array([np.linalg.eigvalsh(printed_noise(h, 5.0, 10.0, 1.0))[0] for h in headings])
    assert np.mean(printed < -1e-6) > 0.98
    assert printed.min() < -25
    model = TargetOrientedLiteral(5.0, 10.0)
    x = np.zeros((1001, 7))
    x[:, 4] = headings
    assert np.linalg.eigvalsh(model.noise(x, 1.0)).min() > -1e-10


@pytest.mark.parametrize("kind", RESETTING)
def test_moving_is_equation_5(kind):
    x = np.array([10.0, 20, 300, 5, 0.7, 1, 2])
    moved = kind(2.0, 10.0).move(x, 1.5)
    np.testing.assert_allclose(moved[:2], [10, 20] + 1.5 * frame(0.7) @ [300, 5], rtol=1e-14)
    np.testing.assert_array_equal(moved[2:], x[2:])


@PROFILE
@given(HEADINGS, st.floats(5.0, 500.0), st.floats(0.05, 3.0), st.floats(-60.0, 60.0))
def test_the_consistent_model_turns_as_a_known_turn_of_that_rate(heading, speed, dt, accel):
    x = np.array([100.0, -50, speed * np.cos(heading), speed * np.sin(heading)])
    turned = KnownTurn(-accel / speed, 1.0)
    np.testing.assert_allclose(TargetOriented(3.0, 10.0, accel).move(x, dt), turned.move(x, dt), rtol=1e-9, atol=1e-9)


@PROFILE
@given(HEADINGS, st.floats(5.0, 500.0), st.floats(0.05, 3.0), st.floats(-60.0, 60.0), st.integers(0, 1000))
@pytest.mark.costly
def test_the_consistent_model_is_the_papers_frame_turned_with_its_target(heading, speed, dt, accel, seed):
    """A step in the frame along the velocity, with velocity and covariance then turned into the frame of the new one.

    In the frame the velocity (v, 0) turns by d = -a T / v; the derivative of d by the forward speed is -d / v, that by the
    side speed 0, as the speed does not change to first order there. This is the independent form; ours stays in the plane.
    """
    model = TargetOriented(3.0, 10.0, accel)
    B = frame(heading)
    both = np.block([[np.eye(2), np.zeros((2, 2))], [np.zeros((2, 2)), B]])
    root = np.random.default_rng(seed).standard_normal((4, 4))
    P = both @ (root @ root.T) @ both.T
    x = np.array([0.0, 0, speed * np.cos(heading), speed * np.sin(heading)])
    d = -accel * dt / speed
    velocity_by_velocity = turn(d) @ B
    velocity_by_velocity[:, 0] += -d * np.array([-np.sin(d + heading), np.cos(d + heading)])
    F = np.block([[np.eye(2), np.zeros((2, 2))], [np.zeros((2, 2)), velocity_by_velocity]])
    steps = 2000  # the position is the integral of the velocity, here by Simpson's rule
    t = np.linspace(0, dt, steps + 1)
    rule = np.where(np.arange(steps + 1) % 2, 4.0, 2.0) * dt / steps / 3
    rule[[0, -1]] /= 2
    for time, share in zip(t, rule, strict=True):
        part = turn(d * time / dt) @ B
        angle = d * time / dt
        part[:, 0] += -angle * np.array([-np.sin(angle + heading), np.cos(angle + heading)])
        F[:2, 2:] += share * part
    gain = np.vstack([B * dt**2 / 2, B * dt])
    in_the_frame = F @ (root @ root.T) @ F.T + gain @ np.diag([9.0, 100.0]) @ gain.T
    J = model.jacobian(x, dt)
    np.testing.assert_allclose(J @ P @ J.T + model.noise(x, dt), in_the_frame, rtol=1e-7, atol=1e-9 * np.trace(in_the_frame))


def test_a_derivative_that_holds_the_turn_fixed_is_not_the_derivative():
    """Negative control of the term that the speed's part in the turned angle makes."""
    model, x = TargetOriented(3.0, 10.0, 60.0), np.array([0.0, 0, 300, 200])
    fixed = KnownTurn(-60.0 / np.hypot(300, 200), 1.0).jacobian(x, 2.0)
    numerical = np.stack([(model.move(x + h, 2.0) - model.move(x - h, 2.0)) / 2e-3 for h in 1e-3 * np.eye(4)], axis=-1)
    np.testing.assert_allclose(model.jacobian(x, 2.0), numerical, atol=1e-6)
    assert np.abs(fixed - numerical).max() > 0.1


def test_the_chord_near_no_turn_and_where_the_series_ends():
    angles = np.concatenate([[0.0, 1e-12, -1e-9, 1e-4], np.linspace(0.4, 0.6, 21), [3.0, -7.0]])
    mean, slope = chord(angles)
    t, weights = np.polynomial.legendre.leggauss(40)
    s = (t + 1) / 2
    np.testing.assert_allclose(mean, np.exp(1j * angles[:, None] * s) @ weights / 2, atol=1e-14)
    np.testing.assert_allclose(slope, (1j * s * np.exp(1j * angles[:, None] * s)) @ weights / 2, atol=1e-14)
