"""Laws of motion models."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from vedette.roles import MotionModel
from vedette.space import Array
from vedette.testing.comparisons import (
    Closed,
    closed_if,
    covariance,
    demand,
    deviations,
    finite,
    frozen_copy,
    is_derivative,
    products,
    same,
)
from vedette.testing.law import Law
from vedette.testing.laws import curved_paths, gaps, reframing, twins
from vedette.testing.laws import space as spaces
from vedette.testing.laws.motion_cases import Moves
from vedette.testing.laws.noise_units import deviations_count, mean_noise_is_a_mean, noise_has_its_units
from vedette.testing.states import random_gaussian, speeds_of, steps_of, without_variance
from vedette.types import Gaussian

Method = Callable[[Array, float], Array]
SHORT = 0.02
"""A short time, in s."""


def _methods(model: MotionModel) -> dict[str, tuple[Method, int]]:
    return {"move": (model.move, 1), "jacobian": (model.jacobian, 2), "noise": (model.noise, 2)}


def _full(result: Array, x: Array, axes: int) -> Array:
    """A result as (*b, n) or (*b, n, n), also where it left out the batch axes."""
    n = x.shape[-1]
    return np.broadcast_to(result, (*x.shape[:-1], *(n,) * axes))


def pure(model: MotionModel, drawn: Moves) -> None:
    """Calls leave their arguments and the model as they were, and give the same again."""
    for name, (method, _) in _methods(model).items():
        first = np.array(method(drawn.x, drawn.dt))
        method(drawn.step, drawn.later)
        same(f"{name} called again", method(drawn.x, drawn.dt), first, 0.0)


def batches_as_it_loops(model: MotionModel, drawn: Moves) -> None:
    """A batch of states gives what each state gives alone, whatever the number of batch axes."""
    block = frozen_copy(np.stack([drawn.x, drawn.x[::-1]]))
    for name, (method, axes) in _methods(model).items():
        got = _full(method(block, drawn.dt), block, axes)
        alone = np.stack([_full(method(x, drawn.dt), x, axes) for x in drawn.x])
        same(name, got, np.stack([alone, alone[::-1]]))
        none = method(drawn.x[:0], drawn.dt)
        demand(none.size == 0 or none.ndim == axes, f"{name}: of no states must be empty, got shape {none.shape}")


def gives_finite_numbers(model: MotionModel, drawn: Moves) -> None:
    """Ordinary states and times give finite numbers."""
    for name, (method, _) in _methods(model).items():
        finite(name, method(drawn.x, drawn.dt))


def zero_step_changes_nothing(model: MotionModel, drawn: Moves) -> None:
    """A step of no time moves nothing and adds no noise."""
    n = len(model.state)
    same("move(x, 0)", model.move(drawn.x, 0.0), drawn.x)
    same("noise(x, 0)", _full(model.noise(drawn.x, 0.0), drawn.x, 2), np.zeros((3, n, n)), 0.0)
    same("jacobian(x, 0)", _full(model.jacobian(drawn.x, 0.0), drawn.x, 2), np.broadcast_to(np.eye(n), (3, n, n)), 1e-8)


def noise_is_a_covariance(model: MotionModel, drawn: Moves) -> None:
    """The noise, and its mean over a belief, are symmetric and positive semi-definite."""
    covariance("noise", _full(model.noise(drawn.x, drawn.dt), drawn.x, 2), definite=False)
    covariance("mean_noise", _full(model.mean_noise(drawn.x, _doubt(drawn.x), drawn.dt), drawn.x, 2), definite=False)


def _doubt(x: Array) -> Array:
    return np.broadcast_to(np.eye(x.shape[-1]), (*x.shape, x.shape[-1]))


def zero_variance_axes_have_no_noise(model: MotionModel, drawn: Moves) -> None:
    """An axis without variance gets no noise: it is moved by rules."""
    closed_if(not len(model.zero_variance), "it carries no axes")
    where = model.state.locate(model.zero_variance)
    cov = model.noise(drawn.x, drawn.dt)
    same("noise of zero-variance axes", cov[..., where, :], np.zeros_like(cov[..., where, :]), 0.0)


def jacobian_is_the_derivative(model: MotionModel, drawn: Moves) -> None:
    """The jacobian is the derivative of move, the short way round where axes wrap."""
    for x in drawn.x:
        stated = _full(model.jacobian(x, drawn.dt), x, 2)
        is_derivative(lambda y: model.move(y, drawn.dt), model.state.difference, stated, x, steps_of(model.state))


def linear_as_declared(model: MotionModel, drawn: Moves) -> None:
    """If linear: move(x) = F x, modulo the periods, with one F and one noise for all states."""
    F = _full(model.jacobian(drawn.x, drawn.dt), drawn.x, 2)
    Q = _full(model.noise(drawn.x, drawn.dt), drawn.x, 2)
    same("jacobian elsewhere", F[1:], np.broadcast_to(F[0], F[1:].shape), 1e-9)
    same("noise elsewhere", Q[1:], np.broadcast_to(Q[0], Q[1:].shape), 1e-9)
    scale = np.abs(F[0]) @ np.abs(drawn.x[0]) + 1e-12
    apart = model.state.difference(model.move(drawn.x[0], drawn.dt), model.state.canonical(F[0] @ drawn.x[0]))
    same("move less F x", apart, np.zeros(apart.shape), 1e-9, scale)


def two_steps_make_one(model: MotionModel, drawn: Moves) -> None:
    """If divisible: F(a+b) = F(b) F(a) and Q(a+b) = F(b) Q(a) F(b)' + Q(b)."""
    a, b = drawn.dt, drawn.later
    for x in drawn.x:
        between = model.move(x, a)
        F = model.jacobian(between, b)
        goal = model.move(x, a + b)
        same("move(x, a + b)", model.move(between, b), goal, 1e-9, np.abs(goal).max() + np.abs(x).max() + 1e-9)
        same("jacobian(x, a + b)", F @ model.jacobian(x, a), model.jacobian(x, a + b), 1e-6)
        got, wanted = F @ model.noise(x, a) @ F.T + model.noise(between, b), model.noise(x, a + b)
        spread = np.sqrt(np.abs(np.diagonal(wanted)))
        same("noise(x, a + b)", got, wanted, 1e-6, np.maximum(spread[:, None] * spread, 1e-300))


def velocities_move_their_positions(model: MotionModel, drawn: Moves) -> None:
    """An axis vx is the velocity of x: over a short time, x gains dt times vx, and never more of its noise than dt times."""
    names, dt = model.state.names, 1e-3
    closed_if(not (pairs := speeds_of(model.state)), "it has no velocity of a position")
    F = _full(model.jacobian(drawn.x, dt), drawn.x, 2)
    for i, v in pairs:
        calm = np.abs(F[:, v, v] - 1.0) < 0.02  # a stiff model loses its velocity even in this time
        rate = F[calm, i, v] / dt
        told = f"jacobian: {names[i]} must gain dt times v{names[i]}, gains {rate} dt times"
        demand(np.all(np.abs(rate - 1.0) < 0.05), told)
    for dt in (1e-3, 1.0, 8.0):  # a position gains with its velocity what that gained, for as long as it had it
        Q = np.stack([_full(model.noise(drawn.x, part * dt), drawn.x, 2) for part in (1.0, 0.75, 0.5, 0.25)])
        for i, v in pairs:
            most = 1.3 * dt * np.max(Q[..., v, v], axis=0)
            bad = np.abs(Q[0, :, i, v]) > most
            gains = f"{names[i]} gains {np.abs(Q[0, bad, i, v])} with v{names[i]}"
            told = f"noise: in {dt:g} s {gains}, at most that time times the variance that gains, {most[bad] / 1.3}"
            demand(not np.any(bad), told)


def an_integrals_noise_goes_with_it(model: MotionModel, drawn: Moves) -> None:
    """Where one axis moves by another, and its noise grows as the integral of the other's, their covariance is one, too."""
    x = np.where([name == "range" for name in model.state.names], np.abs(drawn.x), drawn.x)
    Q, twice = (_full(model.noise(x, k * SHORT), x, 2) for k in (1, 2))
    F, far = (_full(model.jacobian(x, k * SHORT), x, 2) for k in (1, 2))
    variance, later = (np.diagonal(each, axis1=-2, axis2=-1) for each in (Q, twice))
    grown, wanted = later / np.maximum(variance, 1e-300), F / 2 * variance[:, None, :]
    fed = np.isclose(far, 2 * F, rtol=0.05) & (np.abs(wanted) > 0.05 * products(deviations(Q)))
    for k, i, v in np.argwhere(fed & (np.abs(grown - 8) < 0.8)[:, :, None] & (np.abs(grown - 2) < 0.2)[:, None, :]):
        names, own = model.state.names, wanted[k, i, v]
        told = f"{own:.4g} with {names[v]}, half of what {names[i]} moves by it times its variance, got {Q[k, i, v]:.4g}"
        demand(abs(Q[k, i, v] - own) < 0.2 * abs(own), f"noise: in {SHORT} s {names[i]} must covary by {told}")


def parts_keep_their_own(model: MotionModel, drawn: Moves) -> None:
    """If it holds `models`: over the axes of each, it moves and has noise as that model."""
    parts = getattr(model, "models", ())
    if not isinstance(parts, tuple) or not parts or not all(isinstance(part, MotionModel) for part in parts):
        raise Closed("it holds no `models`")
    if any(part.state.names == model.state.names for part in parts) or sum(len(p.state) for p in parts) != len(model.state):
        raise Closed("its `models` share axes")
    moved, Q = model.move(drawn.x, drawn.dt), _full(model.noise(drawn.x, drawn.dt), drawn.x, 2)
    for part in parts:
        own = model.state.locate(part.state)
        x = frozen_copy(drawn.x[:, own])
        same("move of a part", moved[:, own], part.move(x, drawn.dt), 1e-9)
        same("noise of a part", Q[:, own, :][..., own], _full(part.noise(x, drawn.dt), x, 2), 1e-9)


def reframing_keeps_a_belief(model: MotionModel, drawn: Moves) -> None:
    """Settling gives a belief over the same axes, with a covariance that is one, and a `heading` turns as its paths do."""
    rng = np.random.default_rng(drawn.seed)
    own = without_variance(random_gaussian(model.state, rng, (2, 3)), model.state, model.zero_variance)
    own = Gaussian(frozen_copy(own.mean), frozen_copy(own.cov))
    settled = model.reframe(own, own)
    demand(settled.mean.shape == own.mean.shape, f"reframe: mean must have shape {own.mean.shape}, got {settled.mean.shape}")
    finite("mean", settled.mean)
    covariance("covariance", settled.cov, definite=False)
    names = model.state.names
    if "heading" not in names or "heading" not in model.zero_variance:
        return
    pairs = [
        (i, names.index(f"{name[:-1]}y")) for i, name in enumerate(names) if name[-1] == "x" and f"{name[:-1]}y" in names
    ]
    turned = np.array(own.mean)
    for i, j in pairs:
        turned[..., i], turned[..., j] = -own.mean[..., j], own.mean[..., i]
    h = names.index("heading")
    turned[..., h] += np.pi / 2
    there = Gaussian(frozen_copy(model.state.canonical(turned)), own.cov)
    apart = model.state.difference(model.reframe(there, there).mean, settled.mean)[..., h]
    same("reframe: heading of what is turned by pi / 2", np.abs(apart), np.full(apart.shape, np.pi / 2), 1e-9)


def differences_undo_steps(model: MotionModel, drawn: Moves) -> None:
    """In the state space, difference and displace are inverse, and speeds are in the units of what moves."""
    spaces.differences_undo_steps(model.state, drawn.x, drawn.step)
    spaces.speeds_have_their_units(model.state)


def angles_wrap(model: MotionModel, drawn: Moves) -> None:
    """In the state space, whole turns change nothing and wrapped axes are canonical."""
    closed_if(all(axis.period is None for axis in model.state.axes), "no axis wraps")
    spaces.wraps_are_canonical(model.state, drawn.x, drawn.step)


LAWS: tuple[Law, ...] = (
    *map(Law, (
        pure, batches_as_it_loops, gives_finite_numbers, zero_step_changes_nothing, noise_is_a_covariance,
        mean_noise_is_a_mean, noise_has_its_units,
        deviations_count, zero_variance_axes_have_no_noise, jacobian_is_the_derivative, velocities_move_their_positions,
        an_integrals_noise_goes_with_it, parts_keep_their_own, reframing_keeps_a_belief, reframing.frames_within_turn,
        differences_undo_steps, angles_wrap,
    )),
    *(Law(linear_as_declared, needs="linear"), Law(two_steps_make_one, needs="divisible")),
    *gaps.OF_MOTION, *curved_paths.LAWS, *twins.OF_MOTION,
)  # fmt: skip
