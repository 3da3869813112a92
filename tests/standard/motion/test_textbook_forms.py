"""Singer's noise, turns and parameters against their textbook forms."""

import re
from collections.abc import Callable
from decimal import Decimal, localcontext
from fractions import Fraction
from math import factorial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from support.laws_of_motion import PROFILE, STEPS
from vedette_standard.motion.constant_acceleration import ConstantAcceleration
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.coordinated_turn import CoordinatedTurn
from vedette_standard.motion.known_turn import KnownTurn
from vedette_standard.motion.singer import Singer


# Single models.
def textbook_singer_noise(tau: float, dt: float) -> np.ndarray:
    """Singer's own closed form over one axis for unit variance, in 200 digits."""
    with localcontext() as context:
        context.prec = 200
        a, T = 1 / Decimal(tau), Decimal(dt)
        u = a * T
        e, e2 = (-u).exp(), (-2 * u).exp()
        q11 = (1 - e2 + 2 * u + 2 * u**3 / 3 - 2 * u**2 - 4 * u * e) / (2 * a**5)
        q12 = (e2 + 1 - 2 * e + 2 * u * e - 2 * u + u**2) / (2 * a**4)
        q13 = (1 - e2 - 2 * u * e) / (2 * a**3)
        q22 = (4 * e - 3 - e2 + 2 * u) / (2 * a**3)
        q23 = (e2 + 1 - 2 * e) / (2 * a**2)
        q33 = (1 - e2) / (2 * a)
        return np.array([[float(2 * a * q) for q in row] for row in [(q11, q12, q13), (q12, q22, q23), (q13, q23, q33)]])


@pytest.mark.parametrize("ratio", [1e-15, 1e-9, 1e-4, 0.1, 0.5, 1 - 1e-15, 1.0, 1 + 1e-15, 1.7, 10.0, 300.0, 1e6])
def test_singer_equals_its_textbook_form_in_high_precision(ratio):
    noise = Singer(3.0, 1.0).noise(np.zeros(6), 3.0 * ratio)
    np.testing.assert_allclose(noise[::2, ::2], textbook_singer_noise(3.0, 3.0 * ratio), rtol=5e-14)
    np.testing.assert_array_equal(noise[1::2, 1::2], noise[::2, ::2])
    assert not noise[::2, 1::2].any()


def test_singer_lies_between_constant_velocity_and_constant_acceleration():
    x, dt = np.zeros(6), 2.0
    forever = Singer(1e12, 1e6)
    np.testing.assert_allclose(forever.noise(x, dt), ConstantAcceleration(np.sqrt(2.0)).noise(x, dt), rtol=1e-11)
    np.testing.assert_allclose(forever.jacobian(x, dt), ConstantAcceleration(1.0).jacobian(x, dt), rtol=1e-11)
    brief = Singer(1e-8, 1.0)
    velocity = ConstantVelocity(np.sqrt(2e-8))
    np.testing.assert_allclose(brief.noise(x, dt)[:4, :4], velocity.noise(x[:4], dt), rtol=1e-7)
    np.testing.assert_allclose(brief.jacobian(x, dt)[:4, :4], velocity.jacobian(x[:4], dt), rtol=1e-7)


ANGLES = [0.0, 1e-300, 1e-9, 1e-4, 0.1, 0.5 - 1e-15, 0.5, 0.5 + 1e-15, 1.0, 3.0]
"""Turned angles in rad, both sides of where the series ends among them."""


def taylor(angle: float, coefficient: Callable[[int], Fraction]) -> float:
    """Sum of coefficient(k) (-1)^k angle^(2k), exactly."""
    square = Fraction(angle) ** 2 if angle > 1e-100 else Fraction(0)
    return float(sum(coefficient(k) * (-square) ** k for k in range(25)))


@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("sign", [1, -1])
def test_turns_equal_their_taylor_series(angle, sign):
    dt = 2.0
    even = taylor(angle, lambda k: Fraction(1, factorial(2 * k + 2)))
    odd = taylor(angle, lambda k: Fraction(1, factorial(2 * k + 3)))
    along = taylor(angle, lambda k: Fraction(1, factorial(2 * k + 1)))
    noise = KnownTurn(sign * angle / dt, 1.0).noise(np.zeros(4), dt)
    expected = [2 * dt**3 * odd, dt**2 * even, sign * angle * dt**2 * odd, -sign * angle * dt**2 * odd, dt]
    np.testing.assert_allclose(noise[[0, 0, 0, 1, 2], [0, 2, 3, 2, 2]], expected, rtol=2e-14)

    rate_slope = CoordinatedTurn(1.0, 1.0).jacobian(np.array([0.0, 0.0, 1.0, 0.0, sign * angle / dt]), dt)
    along_slope = -sign * angle * taylor(angle, lambda k: Fraction(2 * k + 2, factorial(2 * k + 3)))
    across_slope = taylor(angle, lambda k: Fraction(2 * k + 1, factorial(2 * k + 2)))
    np.testing.assert_allclose(rate_slope[:2, 4], [dt**2 * along_slope, dt**2 * across_slope], rtol=2e-14)
    np.testing.assert_allclose(rate_slope[:2, 2], [dt * along, sign * angle * dt * even], rtol=2e-14)


@PROFILE
@given(st.floats(-1, 1), STEPS, hnp.arrays(float, (3, 4), elements=st.floats(-100, 100)))
def test_a_turn_of_estimated_rate_moves_as_one_of_that_rate(turn_rate, dt, x):
    known = KnownTurn(turn_rate, 1.0)
    estimated = CoordinatedTurn(1.0, 1.0)
    full = np.concatenate([x, np.full((3, 1), turn_rate)], axis=1)
    reach = 1e-12 * (1 + dt) * np.max(np.abs(x), initial=1)
    np.testing.assert_allclose(estimated.move(full, dt)[:, :4], known.move(x, dt), rtol=0, atol=reach)
    np.testing.assert_array_equal(estimated.move(full, dt)[:, 4], turn_rate)
    np.testing.assert_allclose(estimated.jacobian(full, dt)[:, :4, :4] - known.jacobian(x, dt), 0, atol=1e-12 * (1 + dt))


def test_a_turn_without_rate_is_constant_velocity():
    x, dt = np.array([3.0, -4.0, 5.0, 6.0]), 2.5
    straight = ConstantVelocity(0.3)
    for rate in (0.0, 1e-13, -1e-13):
        turn = KnownTurn(rate, 0.3)
        np.testing.assert_allclose(turn.move(x, dt), straight.move(x, dt), rtol=0, atol=1e-11)
        np.testing.assert_allclose(turn.noise(x, dt), straight.noise(x, dt), rtol=0, atol=1e-12)
    estimated = CoordinatedTurn(0.3, 0.1)
    np.testing.assert_array_equal(estimated.move(np.append(x, 0.0), dt)[:4], straight.move(x, dt))
    noise = estimated.noise(np.append(x, 0.0), dt)
    np.testing.assert_array_equal(noise[:4, :4], straight.noise(x, dt))
    np.testing.assert_allclose(noise[4], [0, 0, 0, 0, 0.1**2 * dt])


def test_a_quarter_turn_to_the_left():
    """From heading +x at 10 m/s, pi/2 at pi/20 rad/s leads round a circle of radius v/w to heading +y."""
    radius = 10 / (np.pi / 20)
    moved = CoordinatedTurn(1.0, 1.0).move(np.array([0.0, 0.0, 10.0, 0.0, np.pi / 20]), 10.0)
    np.testing.assert_allclose(moved, [radius, radius, 0.0, 10.0, np.pi / 20], atol=1e-13 * radius)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ConstantVelocity(-3), "sigma_accel: must be > 0, got -3 m/s^1.5"),
        (lambda: ConstantAcceleration(0), "sigma_jerk: must be > 0, got 0 m/s^2.5"),
        (lambda: Singer(0, 1), "tau: must be > 0, got 0 s"),
        (lambda: Singer(float("nan"), 1), "tau: must be a finite number"),
        (lambda: KnownTurn("3 kn", 1), "turn_rate: must be in rad/s or deg/s, got '3 kn'"),
        (lambda: CoordinatedTurn(1, -0.1), "sigma_turn_rate: must be > 0, got -0.1 rad/s^1.5"),
    ],
)
def test_a_wrong_parameter_is_named_with_what_would_be_right(make, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        make()
