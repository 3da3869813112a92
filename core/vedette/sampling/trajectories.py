"""Draw trajectories from motion models, in lock-step over any batch axes: the only loop is over time.

Each draw is a pure function of its standard noise (`follow`), wrapped by one that draws the noise from a generator
(`draw_states`). To give each run its own generator, stack the runs' noise.
"""

from __future__ import annotations

import numpy as np

from vedette.roles import MotionModel
from vedette.sampling.gaussians import psd_root, spread
from vedette.space import Array, Space


def steps_of(times: Array) -> list[float]:
    """Return the steps between times in s; raise ValueError if these go back."""
    times = np.asarray(times, dtype=float)
    if times.ndim != 1 or not len(times) or not np.all(np.isfinite(times)) or np.any(np.diff(times) < 0):
        raise ValueError(f"times: must be finite numbers in s, at least one, never going back, got {times}")
    return [float(step) for step in np.diff(times)]


def over(state: Space, x0: Array, batch: tuple[int, ...]) -> Array:
    """Return first states over batch axes; raise ValueError if they lack an axis."""
    x0 = np.asarray(x0, dtype=float)
    if x0.shape[-1:] != (len(state),):
        raise ValueError(f"x0: must have the {len(state)} axes {state}, got shape {x0.shape}")
    return np.broadcast_to(x0, (*batch, len(state)))


def step(model: MotionModel, x: Array, dt: float, standard: Array, factors: dict[float, Array]) -> Array:
    """Move one step; `factors` holds this model's L by dt where Q lacks the batch's axes, as it then depends on dt alone."""
    lower = factors.get(dt)
    if lower is None:
        lower = psd_root(model.noise(x, dt))
        if lower.ndim == 2:
            factors[dt] = lower
    return model.state.displace(model.move(x, dt), spread(lower, standard))


def follow(model: MotionModel, x0: Array, times: Array, standard: Array) -> Array:
    """Return the trajectory of a model under given noise: x' = f(x, dt) + L w with L L' = Q(x, dt).

    Parameters
    ----------
    model
        The motion model.
    x0
        First states (*b, n) over the model's axes.
    times
        Times in s (s,), never going back, x0 at the first.
    standard
        Standard normal numbers (*b, s-1, n), the w above.

    Returns
    -------
    array
        States (*b, s, n).

    Raises
    ------
    ValueError
        If a shape is wrong, or times go back.
    """
    steps = steps_of(times)
    if standard.shape[-2:] != (len(steps), len(model.state)):
        raise ValueError(f"standard: must end in {(len(steps), len(model.state))}, got shape {standard.shape}")
    x = model.state.canonical(over(model.state, x0, standard.shape[:-2]))
    states = np.empty((*x.shape[:-1], len(steps) + 1, x.shape[-1]))
    states[..., 0, :] = x
    factors: dict[float, Array] = {}
    for k, dt in enumerate(steps):
        states[..., k + 1, :] = x = step(model, x, dt, standard[..., k, :], factors)
    return states


def draw_states(model: MotionModel, x0: Array, times: Array, rng: np.random.Generator, size: tuple[int, ...] = ()) -> Array:
    """Draw trajectories of a model.

    Parameters
    ----------
    model
        The motion model.
    x0
        First states (*b, n) over the model's axes.
    times
        Times in s (s,), never going back, x0 at the first.
    rng
        The generator that is drawn from.
    size
        Batch axes: so many trajectories are drawn from each first state.

    Returns
    -------
    array
        States (*size, *b, s, n).
    """
    shape = (*size, *np.shape(x0)[:-1], max(len(times) - 1, 0), len(model.state))
    return follow(model, x0, times, rng.standard_normal(shape))
