"""The further motion models against integration, the matrix exponential and each other. The kit holds their laws."""

import re

import numpy as np
import pytest
from scipy.integrate import quad_vec, solve_ivp
from scipy.linalg import block_diag, expm

from vedette import kernels
from vedette_standard.motion.constant_acceleration import ConstantAcceleration
from vedette_standard.motion.constant_acceleration_piecewise import ConstantAccelerationPiecewise
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.constant_velocity_piecewise import ConstantVelocityPiecewise
from vedette_standard.motion.coordinated_turn import CoordinatedTurn
from vedette_standard.motion.coordinated_turn_3d import CoordinatedTurn3d
from vedette_standard.motion.curvilinear import Curvilinear
from vedette_standard.motion.gauss_markov import GaussMarkov
from vedette_standard.motion.ornstein_uhlenbeck import OrnsteinUhlenbeck
from vedette_standard.motion.product import Product
from vedette_standard.motion.random_walk import RandomWalk
from vedette_standard.motion.singer import Singer
from vedette_standard.motion.wiener_acceleration_piecewise import WienerAccelerationPiecewise

# Linear models with memory: F = exp(A T), Q = integral of exp(A s) W exp(A s)' over the step, per axis.


def discretised(A, W, dt):
    A, W = np.array(A, float), np.array(W, float)
    Q = quad_vec(lambda s: expm(A * s) @ W @ expm(A * s).T, 0, dt, epsabs=1e-14, epsrel=1e-12)[0]
    return expm(A * dt), Q


def same_discretisation(model, A, W, dt, axes=2):
    F, Q = discretised(A, W, dt)
    x = np.zeros(len(model.state))
    np.testing.assert_allclose(model.jacobian(x, dt), np.kron(F, np.eye(axes)), rtol=1e-10, atol=1e-13)
    scale = np.sqrt(np.diag(Q))
    found = model.noise(x, dt) / np.kron(np.outer(scale, scale), np.ones((axes, axes)))
    np.testing.assert_allclose(found, np.kron(Q / np.outer(scale, scale), np.eye(axes)), rtol=0, atol=1e-9)


CONTINUOUS = [
    (OrnsteinUhlenbeck(20.0, 3.0), [[0, 1], [0, -1 / 20]], [[0, 0], [0, 2 * 9 / 20]]),
    (OrnsteinUhlenbeck(0.5, 3.0), [[0, 1], [0, -2]], [[0, 0], [0, 36]]),
    (RandomWalk(0.7), [[0]], [[0.49]]),
    (GaussMarkov(("b", "c"), 0.3, 8.0), [[-1 / 8]], [[2 * 0.09 / 8]]),
]


@pytest.mark.parametrize("dt", [0.01, 1.0, 7.0])
@pytest.mark.parametrize(("model", "A", "W"), CONTINUOUS, ids=lambda value: getattr(value, "kind", None))
def test_models_with_memory_are_exactly_discretised(model, A, W, dt):
    same_discretisation(model, A, W, dt)


def test_the_comparison_bites():
    _, A, W = CONTINUOUS[0]
    for wrong in (OrnsteinUhlenbeck(20.01, 3.0), OrnsteinUhlenbeck(20.0, 3.001), ConstantVelocity(3 * 0.1**0.5)):
        with pytest.raises(AssertionError):
            same_discretisation(wrong, A, W, 7.0)


def test_a_forgotten_velocity_lies_between_standing_and_constant_velocity():
    x, dt = np.zeros(4), 3.0
    forever = OrnsteinUhlenbeck(1e10, 1e5 / np.sqrt(2) * 0.5)
    np.testing.assert_allclose(forever.noise(x, dt), ConstantVelocity(0.5).noise(x, dt), rtol=1e-8)
    brief = OrnsteinUhlenbeck(1e-8, 1e4)
    np.testing.assert_allclose(brief.noise(x, dt)[:2, :2], RandomWalk(np.sqrt(2)).noise(x[:2], dt), rtol=1e-7)


# Any number of axes.

WIDE = [
    lambda axes: ConstantVelocity(0.5, axes=axes),
    lambda axes: ConstantAcceleration(0.1, axes=axes),
    lambda axes: Singer(20.0, 1.0, axes=axes),
    lambda axes: OrnsteinUhlenbeck(20.0, 3.0, axes=axes),
    lambda axes: ConstantVelocityPiecewise(0.5, axes=axes),
    lambda axes: ConstantAccelerationPiecewise(0.5, axes=axes),
    lambda axes: WienerAccelerationPiecewise(0.5, axes=axes),
]


@pytest.mark.parametrize("make", WIDE)
def test_every_axis_moves_as_one_alone(make):
    space, line = make(("x", "y", "z")), make(("x",))
    names = ["x", "y", "z", "vx", "vy", "vz", "ax", "ay", "az"]
    assert space.state.names == tuple(names[: len(space.state)])
    x = np.random.default_rng(1).normal(size=(4, len(space.state)))
    for i in range(3):
        np.testing.assert_allclose(space.move(x, 1.5)[:, i::3], line.move(x[:, i::3], 1.5), rtol=1e-13)
        np.testing.assert_array_equal(space.noise(x, 1.5)[i::3, i::3], line.noise(x[:, i::3], 1.5))
        for j in {0, 1, 2} - {i}:
            assert not space.noise(x, 1.5)[i::3, j::3].any()
            assert not space.jacobian(x, 1.5)[i::3, j::3].any()


@pytest.mark.parametrize("axes", [(), ("x", "x"), ("x", "")])
@pytest.mark.parametrize("make", [WIDE[0], lambda axes: RandomWalk(1.0, axes), lambda axes: GaussMarkov(axes, 1.0, 1.0)])
def test_axes_must_be_named_once(make, axes):
    with pytest.raises(ValueError, match=re.escape(f"axes: must name at least one axis, each once, got {list(axes)}")):
        make(axes)


# Noise that is held through a step: x' = F x + G w with one w a step.


def held(model, dt, runs=400_000):
    """The covariance over one axis of an input that is constant through the step, by integrating it."""
    p = model.derivatives
    rng = np.random.default_rng(3)
    if isinstance(model, WienerAccelerationPiecewise):
        x = np.zeros((runs, p))
        x[:, 2] = 0.5 * rng.standard_normal(runs)
        return np.cov((x @ model.transition(dt).T).T, bias=True)
    A = np.eye(p + 1, k=1)  # the input as one more derivative that stays
    last = expm(A * dt)[:p, p]
    return np.cov(np.outer(last, 0.5 * rng.standard_normal(runs)), bias=True)


@pytest.mark.parametrize("make", WIDE[4:])
def test_noise_held_through_a_step(make):
    """The sample variance of 4e5 draws is right to 1.2 % at five standard errors."""
    model = make(("x",))
    Q = model.covariance(2.5)
    np.testing.assert_allclose(Q, held(model, 2.5), rtol=0.012)
    assert np.linalg.matrix_rank(Q) == 1
    assert not model.divisible


@pytest.mark.parametrize("make", WIDE[4:])
def test_held_noise_does_not_divide(make):
    model = make(("x",))
    F, half, whole = model.transition(1.0), model.covariance(1.0), model.covariance(2.0)
    assert not np.allclose(F @ half @ F.T + half, whole, rtol=0.1)


def test_discretisations_agree_where_they_should():
    """Held and white noise give the velocity the same variance over one step of T if q T = sigma^2 T^2."""
    dt = 2.0
    white, piecewise = ConstantVelocity(0.3 * np.sqrt(dt)), ConstantVelocityPiecewise(0.3)
    assert white.covariance(dt)[1, 1] == pytest.approx(piecewise.covariance(dt)[1, 1])
    assert white.covariance(dt)[0, 0] / piecewise.covariance(dt)[0, 0] == pytest.approx(4 / 3)


# Products.


def test_a_product_moves_each_part_by_itself():
    parts = (CoordinatedTurn(0.5, 0.02), ConstantVelocity(0.1, axes=("z",)), RandomWalk(0.01, ("bias",), "rad"))
    model = Product(parts)
    assert model.state.names == ("x", "y", "vx", "vy", "turn_rate", "z", "vz", "bias")
    x = np.random.default_rng(2).normal(size=(2, 3, 8))
    own = [slice(0, 5), slice(5, 7), slice(7, 8)]
    np.testing.assert_array_equal(
        model.move(x, 2.0), np.concatenate([p.move(x[..., s], 2.0) for p, s in zip(parts, own, strict=True)], axis=-1)
    )
    for i in np.ndindex(2, 3):
        blocks = [p.jacobian(x[i][s], 2.0) for p, s in zip(parts, own, strict=True)]
        np.testing.assert_array_equal(model.jacobian(x, 2.0)[i], block_diag(*blocks))
    np.testing.assert_array_equal(
        model.noise(x, 2.0), block_diag(*(p.noise(x[..., s], 2.0) for p, s in zip(parts, own, strict=True)))
    )
    assert not model.linear
    assert not model.divisible
    linear = Product(parts[1:])
    assert linear.linear
    assert linear.divisible


def test_equal_parts_are_one_model():
    line = [ConstantVelocity(0.5, axes=(axis,)) for axis in "xyz"]
    product, space = Product(tuple(line)), ConstantVelocity(0.5, axes=("x", "y", "z"))
    where = product.state.locate(space.state)
    x = np.zeros(6)
    np.testing.assert_array_equal(product.noise(x, 2.0)[np.ix_(where, where)], space.noise(x, 2.0))
    np.testing.assert_array_equal(product.jacobian(x, 2.0)[np.ix_(where, where)], space.jacobian(x, 2.0))


@pytest.mark.parametrize(
    ("models", "message"),
    [
        ((), "models: must hold at least one model"),
        (
            (ConstantVelocity(0.5), RandomWalk(1.0, ("y",))),
            "models[1]: must own other axes than the models before it, got y",
        ),
    ],
)
def test_products_that_cannot_be(models, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        Product(models)


# Turns in space.


def integrated(derivative, x, dt):
    return solve_ivp(lambda t, y: derivative(y), (0, dt), x, method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1]


def turning(x):
    return np.concatenate([x[3:6], np.cross(x[6:], x[3:6]), np.zeros(3)])


def turns_about_its_vector(model, scale):
    rng = np.random.default_rng(4)
    for _ in range(5):
        x = rng.normal(size=9) * [100, 100, 100, 10, 10, 10, scale, scale, scale]
        np.testing.assert_allclose(model.move(x, 2.0), integrated(turning, x, 2.0), rtol=1e-9, atol=1e-9)
        slope = kernels.numerical_jacobian(lambda y: model.move(y, 2.0), x, model.state.difference)
        np.testing.assert_allclose(model.jacobian(x, 2.0), slope, rtol=0, atol=1e-8 * np.max(np.abs(slope)))


SPACE = CoordinatedTurn3d(0.5, 0.01)


@pytest.mark.parametrize("scale", [0.0, 1e-7, 0.01, 0.2, 0.29, 1.0])
def test_a_turn_in_space_is_that_of_its_differential_equation(scale):
    turns_about_its_vector(SPACE, scale)


class Mutant:
    """The turn in space with one share wrong."""

    state = SPACE.state

    def __init__(self, entry):
        self.entry = entry

    def move(self, x, dt):
        moved = SPACE.move(x, dt)
        moved[..., self.entry] += 1e-6 * x[..., 3]
        return moved

    def jacobian(self, x, dt):
        F = SPACE.jacobian(x, dt).copy()
        F[..., 0, 7] *= 1 + 1e-3 * (self.entry is None)
        return F


def test_the_law_of_turns_in_space_bites():
    for entry in (0, 4):
        with pytest.raises(AssertionError):
            turns_about_its_vector(Mutant(entry), 0.2)


@pytest.mark.parametrize("rate", [0.0, 0.03, -0.7])
def test_a_turn_about_the_vertical_is_the_turn_in_the_plane(rate):
    x = np.array([10.0, 20, 30, 5, -3, 2, 0, 0, rate])
    plane = CoordinatedTurn(0.5, 0.01)
    flat = [0, 1, 3, 4, 8]
    np.testing.assert_allclose(SPACE.move(x, 3.0)[flat], plane.move(x[flat], 3.0), rtol=1e-13)
    np.testing.assert_allclose(
        SPACE.jacobian(x, 3.0)[np.ix_(flat, flat)], plane.jacobian(x[flat], 3.0), rtol=1e-9, atol=1e-12
    )
    np.testing.assert_array_equal(SPACE.noise(x, 3.0)[np.ix_(flat, flat)], plane.noise(x[flat], 3.0))
    assert SPACE.move(x, 3.0)[2] == pytest.approx(36.0)


# Curved paths.


def along_and_across(x):
    course = x[2:4] / np.hypot(*x[2:4])
    left = np.array([-course[1], course[0]])
    return np.concatenate([x[2:4], x[4] * course + x[5] * left, np.zeros(2)])


PATHS = [(0, 0), (1, 0), (-0.5, 0), (0, 1), (0.5, -2), (-1, 1), (1e-12, 1e-12), (1e-5, 3)]
CURVED = Curvilinear(0.1, 0.2)


@pytest.mark.parametrize(("tangential", "normal"), PATHS)
def test_a_curved_path_is_that_of_its_differential_equation(tangential, normal):
    x = np.array([10.0, -20.0, 12.0, -5.0, tangential, normal])
    expected = integrated(along_and_across, x, 6.0)
    np.testing.assert_allclose(CURVED.move(x, 6.0), expected, rtol=1e-6, atol=1e-4)
    with pytest.raises(AssertionError):
        np.testing.assert_allclose(CURVED.move(x + np.eye(6)[2] * 1e-2, 6.0), expected, rtol=1e-6, atol=1e-4)


def test_a_normal_acceleration_is_a_circle():
    x = np.array([0.0, 0, 10, 0, 0, 2.0])
    around = CURVED.move(x, 2 * np.pi * 10 / 2)
    np.testing.assert_allclose(around, x, atol=1e-3)
    assert CURVED.move(x, np.pi * 10 / 2)[1] == pytest.approx(2 * 10**2 / 2, rel=1e-5)


def test_what_brakes_stands_where_it_stopped():
    x = np.array([0.0, 0, 10, 0, -2.0, 0])
    later = CURVED.move(np.stack([x, x]), 5.0)[0], CURVED.move(x, 60.0)
    assert later[1][0] == pytest.approx(10**2 / 2 / 2, rel=1e-4)
    assert np.hypot(*later[1][2:4]) < 0.011
    assert np.all(np.isfinite(CURVED.move(np.array([0, 0, 0, 0, 5.0, 5.0]), 60.0)))


def test_noise_of_a_curved_path_follows_its_course():
    """Along the path it is that of white jerk with the one deviation, across it with the other."""
    course = 0.7
    along, across = np.array([np.cos(course), np.sin(course)]), np.array([-np.sin(course), np.cos(course)])
    Q = CURVED.noise(np.array([0, 0, *(9 * along), 0.3, 0.4]), 2.0)
    for direction, sigma, own in ((along, 0.1, 4), (across, 0.2, 5)):
        to_axis = np.zeros((3, 6))
        to_axis[0, :2] = to_axis[1, 2:4] = direction
        to_axis[2, own] = 1.0
        expected = ConstantAcceleration(sigma, axes=("x",)).covariance(2.0)
        np.testing.assert_allclose(to_axis @ Q @ to_axis.T, expected, rtol=1e-12)
