"""The laws of motion models, on every one of the standard plugin; and mutants that each law must catch."""

from __future__ import annotations

import re
from collections.abc import Callable
from decimal import Decimal, localcontext
from fractions import Fraction
from math import factorial

import attrs
import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from vedette import MotionModel, kernels
from vedette_standard.motion.constant_acceleration import ConstantAcceleration
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.coordinated_turn import CoordinatedTurn
from vedette_standard.motion.known_turn import KnownTurn
from vedette_standard.motion.singer import Singer

PROFILE = settings(max_examples=40, deadline=None, derandomize=True)


def powers_of_ten(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high).map(lambda exponent: 10.0**exponent)


SIGMAS = powers_of_ten(-3, 2)
MODELS = {
    ConstantVelocity: st.builds(ConstantVelocity, SIGMAS),
    ConstantAcceleration: st.builds(ConstantAcceleration, SIGMAS),
    Singer: st.builds(Singer, powers_of_ten(-2, 8), SIGMAS),
    KnownTurn: st.builds(KnownTurn, st.floats(-1, 1), SIGMAS),
    CoordinatedTurn: st.builds(CoordinatedTurn, SIGMAS, SIGMAS),
}
STEPS = powers_of_ten(-3, 1.8)
SCALES = np.array([1e4, 1e4, 100, 100])
EXTRA = {"ax": 10.0, "turn_rate": 1.0}


def states(model: MotionModel) -> st.SearchStrategy[np.ndarray]:
    """(*b, n) of plausible size, for a few kinds of batch axes."""
    names, n = model.state.names, len(model.state)
    scale = np.concatenate([SCALES, [EXTRA["ax"]] * 2 if "ax" in names else [EXTRA["turn_rate"]] * (n - 4)])
    shapes = st.sampled_from([(), (1,), (3,), (2, 3), (0,)])
    return shapes.flatmap(lambda b: hnp.arrays(float, (*b, n), elements=st.floats(-1, 1))).map(lambda x: x * scale)


# The laws: each takes a model, states (*b, n) and a time step.


def a_zero_step_changes_nothing(model, x, dt):
    np.testing.assert_array_equal(model.move(x, 0.0), x)
    np.testing.assert_array_equal(model.jacobian(x, 0.0), np.broadcast_to(np.eye(x.shape[-1]), model.jacobian(x, 0.0).shape))
    assert not model.noise(x, 0.0).any()


def noise_is_a_covariance(model, x, dt):
    Q = model.noise(x, dt)
    np.testing.assert_array_equal(Q, np.swapaxes(Q, -1, -2))
    spread = np.sqrt(np.diagonal(Q, axis1=-2, axis2=-1))
    assert np.all(spread > 0)
    assert np.all(np.linalg.eigvalsh(Q / (spread[..., :, None] * spread[..., None, :])) > -1e-13)


def jacobian_is_the_derivative(model, x, dt):
    slope = kernels.numerical_jacobian(lambda y: model.move(y, dt), x, model.state.difference)
    np.testing.assert_allclose(
        np.broadcast_to(model.jacobian(x, dt), slope.shape), slope, rtol=0, atol=2e-6 * np.max(np.abs(slope), initial=1.0)
    )


def a_batch_is_a_loop(model, x, dt):
    n = x.shape[-1]
    batch = (
        model.move(x, dt),
        np.broadcast_to(model.jacobian(x, dt), (*x.shape, n)),
        np.broadcast_to(model.noise(x, dt), (*x.shape, n)),
    )
    assert batch[0].shape == x.shape
    for i in np.ndindex(x.shape[:-1]):
        single = model.move(x[i], dt), model.jacobian(x[i], dt), model.noise(x[i], dt)
        for together, alone in zip(batch, single, strict=True):
            np.testing.assert_allclose(together[i], alone, rtol=1e-12, atol=1e-12 * np.max(np.abs(alone)))


def nothing_is_written_or_kept(model, x, dt):
    before = x.copy()
    first = [method(x, dt).copy() for method in (model.move, model.jacobian, model.noise)]
    for method, result in zip((model.move, model.jacobian, model.noise), first, strict=True):
        np.testing.assert_array_equal(method(x, dt), result)
    np.testing.assert_array_equal(x, before)


def two_steps_make_one(model, x, dt):
    for part in (0.01, 0.37, 0.5):
        a, b = part * dt, dt - part * dt
        F_a, F_b, F = model.jacobian(x, a), model.jacobian(x, b), model.jacobian(x, a + b)
        Q = model.noise(x, a + b)
        unit = np.sqrt(np.diagonal(Q))
        assert_close_in(1 / unit, 1 / unit, F_b @ model.noise(x, a) @ F_b.T + model.noise(x, b), Q, 1e-12)
        assert_close_in(dt ** orders(model), dt ** -orders(model), F_b @ F_a, F, 1e-12)


def moments_are_exact(model, x, dt):
    """Against the matrix exponential of the continuous model, in units in which the step is 1."""
    F, Q = discretised(*CONTINUOUS[model.kind](model), dt, orders(model))
    unit = np.sqrt(np.diagonal(Q))
    assert_close_in(1 / unit, 1 / unit, model.noise(x, dt), Q, 1e-11)
    assert_close_in(dt ** orders(model), dt ** -orders(model), model.jacobian(x, dt), F, 1e-11)
    np.testing.assert_allclose(model.move(x, dt), x @ F.T, rtol=0, atol=1e-11 * np.max(np.abs(x) @ np.abs(F).T, initial=0))


def assert_close_in(rows, columns, actual, expected, tolerance):
    """Whether two matrices agree to an absolute tolerance once rows and columns are scaled."""
    np.testing.assert_array_less(np.abs(rows[:, None] * (actual - expected) * columns), tolerance)


def orders(model):
    """How often each axis of the state was differentiated by time."""
    return np.array([0.0, 0, 1, 1, 2, 2][: len(model.state)])


# The oracle: x' = A x + w with spectral density W, discretised by Van Loan's method over a step short enough that nothing
# grows in it, and doubled up to the whole.


def shift(n):
    return np.eye(n, k=2)


def white(n, q):
    return np.diag([0.0] * (n - 2) + [q, q])


def continuous_turn(model):
    A = shift(4)
    A[2, 3], A[3, 2] = -model.turn_rate, model.turn_rate
    return A, white(4, model.sigma_accel**2)


def continuous_singer(model):
    A = shift(6)
    A[4, 4] = A[5, 5] = -1 / model.tau
    return A, white(6, 2 * model.sigma_accel**2 / model.tau)


CONTINUOUS = {
    ConstantVelocity.kind: lambda model: (shift(4), white(4, model.sigma_accel**2)),
    ConstantAcceleration.kind: lambda model: (shift(6), white(6, model.sigma_jerk**2)),
    Singer.kind: continuous_singer,
    KnownTurn.kind: continuous_turn,
}


def discretised(A, W, dt, order):
    n, unit = len(A), dt**order
    A = dt * unit[:, None] * A / unit
    W = dt * unit[:, None] * W * unit
    size = np.max(W)
    halvings = max(0, int(np.ceil(np.log2(np.max(np.abs(A))))))
    block = scipy.linalg.expm(np.block([[-A, W / size], [np.zeros((n, n)), A.T]]) / 2**halvings)
    F = block[n:, n:].T
    Q = F @ block[:n, n:]
    for _ in range(halvings):
        F, Q = F @ F, F @ Q @ F.T + Q
    return F * unit / unit[:, None], size * Q / unit / unit[:, None]


LAWS = [
    a_zero_step_changes_nothing,
    noise_is_a_covariance,
    jacobian_is_the_derivative,
    a_batch_is_a_loop,
    nothing_is_written_or_kept,
    two_steps_make_one,
    moments_are_exact,
]


def applies(law: Callable[..., None], model: type[MotionModel]) -> bool:
    return {two_steps_make_one: model.divisible, moments_are_exact: model.linear}.get(law, True)


@pytest.mark.parametrize(("law", "model"), [(law, model) for law in LAWS for model in MODELS if applies(law, model)])
@PROFILE
@given(data=st.data())
def test_law(law, model, data):
    one = data.draw(MODELS[model])
    law(one, data.draw(states(one)), data.draw(STEPS))


def test_which_models_are_divisible_and_linear():
    exact = {ConstantVelocity, ConstantAcceleration, Singer, KnownTurn}
    assert {model for model in MODELS if model.divisible} == exact
    assert {model for model in MODELS if model.linear} == exact


# Mutants.


def mutant(original: MotionModel, **changed: Callable[[MotionModel, np.ndarray, float], np.ndarray]) -> MotionModel:
    """A model of the same kind with some methods replaced by functions of the original, x and dt."""

    def method(name):
        change = changed.get(name)
        return lambda self, x, dt: change(original, x, dt) if change else getattr(original, name)(x, dt)

    body = {name: method(name) for name in ("move", "jacobian", "noise")}
    cls = type("Mutant", (MotionModel,), body | {"kind": original.kind, "state": original.state})
    model = cls()
    vars(model).update({name: getattr(original, name) for name in attrs.fields_dict(type(original))})
    return model


def write_in_place(model, x, dt):
    x[..., :2] += dt * x[..., 2:4]
    return x


def without(rows, columns):
    """The Jacobian with a block left out."""

    def change(model, x, dt):
        F = model.jacobian(x, dt).copy()
        F[..., rows, columns] = 0.0
        return F

    return change


def sign_of_turn_rate_column(model, x, dt):
    F = model.jacobian(x, dt).copy()
    F[..., :2, 4] *= -1
    return F


def scaled(row, column, factor):
    """The noise with one entry, and its mirror, scaled."""

    def change(model, x, dt):
        Q = model.noise(x, dt).copy()
        Q[row, column] *= factor
        if row != column:
            Q[column, row] *= factor
        return Q

    return change


def lopsided(model, x, dt):
    Q = model.noise(x, dt).copy()
    Q[0, 2] *= 1 + 1e-9
    return Q


def held_acceleration(model, x, dt):
    """Noise of an acceleration that is held within the step and drawn anew for the next."""
    gain = np.kron(np.array([[dt**2 / 2], [dt]]), np.eye(2))
    return model.sigma_accel**2 * gain @ gain.T


def remembering():
    calls = []

    def change(model, x, dt):
        calls.append(dt)
        return model.noise(x, dt) * len(calls)

    return change


CV, CA, SINGER, TURN, COORDINATED = (
    ConstantVelocity(0.5),
    ConstantAcceleration(0.1),
    Singer(20.0, 1.0),
    KnownTurn(0.2, 0.5),
    CoordinatedTurn(0.5, 0.02),
)
MUTANTS = [
    (a_zero_step_changes_nothing, CV, {"move": lambda m, x, dt: m.move(x, dt + 0.01)}),
    (a_zero_step_changes_nothing, CV, {"noise": lambda m, x, dt: m.noise(x, dt + 0.01)}),
    (noise_is_a_covariance, CV, {"noise": scaled(0, 0, 0.5)}),
    (noise_is_a_covariance, CA, {"noise": scaled(0, 4, 1.5)}),
    (noise_is_a_covariance, CV, {"noise": lopsided}),
    (jacobian_is_the_derivative, COORDINATED, {"jacobian": sign_of_turn_rate_column}),
    (jacobian_is_the_derivative, COORDINATED, {"jacobian": without([0, 1, 2, 3], 4)}),
    (jacobian_is_the_derivative, CA, {"jacobian": without([0, 1], [4, 5])}),
    (jacobian_is_the_derivative, SINGER, {"move": lambda m, x, dt: CA.move(x, dt)}),
    (a_batch_is_a_loop, COORDINATED, {"jacobian": lambda m, x, dt: m.jacobian(x[..., :1, :] if x.ndim > 1 else x, dt)}),
    (a_batch_is_a_loop, CV, {"move": lambda m, x, dt: m.move(x - x.mean(axis=0), dt) if x.ndim > 1 else m.move(x, dt)}),
    (nothing_is_written_or_kept, CV, {"move": write_in_place}),
    (nothing_is_written_or_kept, CV, {"noise": remembering()}),
    (two_steps_make_one, CV, {"noise": held_acceleration}),
    (two_steps_make_one, CV, {"noise": lambda m, x, dt: m.noise(x, dt) * dt}),
    (two_steps_make_one, TURN, {"noise": lambda m, x, dt: CV.noise(x, dt)}),
    (two_steps_make_one, SINGER, {"noise": lambda m, x, dt: CA.noise(x, dt)}),
    (two_steps_make_one, SINGER, {"jacobian": lambda m, x, dt: CA.jacobian(x, dt)}),
    (moments_are_exact, SINGER, {"noise": scaled(0, 0, 1 + 1e-9)}),
    (moments_are_exact, CA, {"noise": scaled(0, 2, -1)}),
    (moments_are_exact, TURN, {"noise": scaled(0, 3, -1)}),
    (moments_are_exact, TURN, {"jacobian": lambda m, x, dt: KnownTurn(-0.2, 0.5).jacobian(x, dt)}),
    (moments_are_exact, TURN, {"move": lambda m, x, dt: CV.move(x, dt)}),
]


@pytest.mark.parametrize(("law", "original", "changed"), MUTANTS, ids=lambda value: getattr(value, "__name__", None))
def test_law_bites(law, original, changed):
    x = np.arange(1.0, 1 + 3 * len(original.state)).reshape(3, -1)
    law(original, x.copy(), 2.5)
    with pytest.raises(AssertionError):
        law(mutant(original, **changed), x, 2.5)


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
        (lambda: ConstantVelocity(-3), "sigma_accel: must be > 0, got -3 m/s^2"),
        (lambda: ConstantAcceleration(0), "sigma_jerk: must be > 0, got 0 m/s^3"),
        (lambda: Singer(0, 1), "tau: must be > 0, got 0 s"),
        (lambda: Singer(float("nan"), 1), "tau: must be a finite number"),
        (lambda: KnownTurn("3 kn", 1), "turn_rate: must be in rad/s or deg/s, got '3 kn'"),
        (lambda: CoordinatedTurn(1, -0.1), "sigma_turn_rate: must be > 0, got -0.1 rad/s^2"),
    ],
)
def test_a_wrong_parameter_is_named_with_what_would_be_right(make, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        make()
