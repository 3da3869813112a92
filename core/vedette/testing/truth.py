"""Truth that matches an estimator, drawn from its own prior and motion models."""

from __future__ import annotations

from typing import Any

import numpy as np

from vedette.roles import Estimator, MotionModel
from vedette.sampling import Modes, draw_gaussian, draw_jump_markov, draw_states, union_state
from vedette.space import Array
from vedette.testing.comparisons import Misuse
from vedette.types import Gaussian


def motion_of(estimator: Estimator[Any]) -> MotionModel | None:
    """Return the one motion model that an estimator, or the one that it holds as `of`, holds as `motion`, or None."""
    motion, held = getattr(estimator, "motion", None), getattr(estimator, "of", None)
    if motion is None and isinstance(held, Estimator) and held.state == estimator.state:
        return motion_of(held)
    return motion if isinstance(motion, MotionModel) else None


def modes_of(estimator: Estimator[Any]) -> tuple[Estimator[Any], ...]:
    """Return the estimators that a mixture holds as `modes`, or none."""
    modes = getattr(estimator, "modes", ())
    return tuple(modes) if all(isinstance(mode, Estimator) for mode in modes) else ()


def chain_of(mixture: Estimator[Any], dt: float) -> Array:
    """Return P(mode in the column after `dt` s | mode in the row) (r, r), from `transition`, `interval` and `rates`."""
    from scipy.linalg import expm, logm

    transition, rates = getattr(mixture, "transition", None), getattr(mixture, "rates", None)
    interval = getattr(mixture, "interval", None)
    if rates is not None:
        return np.asarray(expm(rates * dt))
    if transition is None:
        raise Misuse(f"{mixture.kind}: has modes but no `transition` or `rates`, so no truth can be drawn from it")
    matrix = transition / transition.sum(axis=1, keepdims=True)
    return matrix if interval is None else np.real(expm(np.real(logm(matrix)) * (dt / interval)))


def initial_of(mixture: Estimator[Any]) -> Array:
    """Return the mode probabilities of a new track (r,)."""
    modes, initial = modes_of(mixture), getattr(mixture, "initial", None)
    return np.full(len(modes), 1.0 / len(modes)) if initial is None else initial / initial.sum()


def draw_moded(
    estimator: Estimator[Any], prior: Gaussian, times: Array, rng: np.random.Generator, runs: int
) -> tuple[Array, Modes | None]:
    """Draw trajectories (runs, s, n) over `estimator.state` from the prior mean (n,), cov (n, n) at times[0].

    A mixture's truth jumps between its modes' models by the mixture's own chain, and which mode is active at each time
    (runs, s) is returned, too; an axis that a mode lacks has the value that the mixture assumes. Misuse if the estimator
    does not show what it holds as `motion`, or `modes` and `transition`.
    """
    start = estimator.state.canonical(draw_gaussian(prior.mean, prior.cov, rng, (runs,)))
    motion = motion_of(estimator)
    if motion is not None:
        own = motion.state.locate(estimator.state)
        there = draw_states(motion, start[:, estimator.state.locate(motion.state)], times, rng)
        return there[..., own], None
    modes = modes_of(estimator)
    models = [model for mode in modes if (model := motion_of(mode)) is not None]
    if not models or len(models) != len(modes):
        raise Misuse(f"{estimator.kind}: shows neither one `motion` nor `modes` that each do, so no truth can be drawn")
    absent = dict(getattr(estimator, "absent", {}))
    space = union_state(models)
    starts = {name: absent.get(name, (0.0, 0.0)) for name in space.names}
    first = rng.choice(len(models), runs, p=initial_of(estimator))
    chain = chain_of(estimator, float(times[1] - times[0]) if len(times) > 1 else 1.0)
    x0 = start[:, estimator.state.locate(space)]
    active, states = draw_jump_markov(models, chain / chain.sum(axis=1, keepdims=True), x0, first, times, rng, starts=starts)
    mean, deviation = np.array([starts[name] for name in space.names]).T
    filled = np.where(np.isnan(states), mean + deviation * rng.standard_normal(states.shape), states)
    return filled[..., space.locate(estimator.state)], active
