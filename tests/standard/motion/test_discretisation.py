"""Noise and transition of linear models against the matrix exponential, held noise, and axes of any names."""

import re

import numpy as np
import pytest
from scipy.integrate import quad_vec
from scipy.linalg import expm

from vedette_standard.motion.constant_acceleration import ConstantAcceleration
from vedette_standard.motion.constant_acceleration_piecewise import ConstantAccelerationPiecewise
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.constant_velocity_piecewise import ConstantVelocityPiecewise
from vedette_standard.motion.gauss_markov import GaussMarkov
from vedette_standard.motion.ornstein_uhlenbeck import OrnsteinUhlenbeck
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
        return np.cov((x @ np.transpose(model.transition(dt))).T, bias=True)
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
    F, half, whole = (np.array(block) for block in (model.transition(1.0), model.covariance(1.0), model.covariance(2.0)))
    assert not np.allclose(F @ half @ F.T + half, whole, rtol=0.1)


def test_discretisations_agree_where_they_should():
    """Held and white noise give the velocity the same variance over one step of T if q T = sigma^2 T^2."""
    dt = 2.0
    white, piecewise = ConstantVelocity(0.3 * np.sqrt(dt)), ConstantVelocityPiecewise(0.3)
    assert white.covariance(dt)[1][1] == pytest.approx(piecewise.covariance(dt)[1][1])
    assert white.covariance(dt)[0][0] / piecewise.covariance(dt)[0][0] == pytest.approx(4 / 3)
