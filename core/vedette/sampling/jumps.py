"""Draw trajectories that jump between motion models: under given noise (`switch`, `follow_modes`), or from a generator."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import reduce
from typing import Any

import numpy as np

from vedette.roles import MotionModel
from vedette.sampling.trajectories import over, step, steps_of
from vedette.space import Array, Space

Modes = np.ndarray[Any, np.dtype[np.intp]]
"""Index of the active model, from 0."""


def union_state(models: Sequence[MotionModel]) -> Space:
    """Return all axes that any of `models` has, in the order in which they first appear."""
    return reduce(Space.union, (model.state for model in models), Space())


def common_state(models: Sequence[MotionModel]) -> Space:
    """Return the axes that all of `models` have, in the first one's order."""
    return Space(tuple(axis for axis in union_state(models).axes if all(axis.name in model.state for model in models)))


def switch(transition: Array, mode0: Modes | int, times: Array, uniform: Array) -> Modes:
    """Return a Markov chain under given noise. Over a step of 0 s nothing switches, as in the IMM estimator.

    Parameters
    ----------
    transition
        Probabilities (r, r) of every step longer than 0 s: row the mode, column the next.
    mode0
        First modes () or (*b).
    times
        Times in s (s,), never going back.
    uniform
        Numbers in [0, 1), (*b, s-1).

    Returns
    -------
    array
        Modes from 0 (*b, s).

    Raises
    ------
    ValueError
        If `transition` is no matrix of probabilities, or `mode0` is none of its modes.
    """
    transition = np.asarray(transition, dtype=float)
    r = transition.shape[0]
    if transition.shape != (r, r) or np.any(transition < 0) or not np.all(np.abs(transition.sum(axis=-1) - 1) < 1e-6):
        raise ValueError(f"transition: must be square with rows of probabilities that sum to 1, got {transition.tolist()}")
    if not np.all((np.asarray(mode0) >= 0) & (np.asarray(mode0) < r)):
        raise ValueError(f"mode0: must be one of the {r} modes, 0 to {r - 1}, got {mode0}")
    below = np.cumsum(transition, axis=-1)[:, :-1]
    modes = np.empty((*uniform.shape[:-1], uniform.shape[-1] + 1), dtype=np.intp)
    modes[..., 0] = mode0
    for k, dt in enumerate(steps_of(times)):
        mode = modes[..., k]
        modes[..., k + 1] = mode if dt == 0 else np.sum(uniform[..., k, None] >= below[mode], axis=-1)
    return modes


def follow_modes(
    models: Sequence[MotionModel], modes: Modes, x0: Array, times: Array, standard: Array, fresh: Array
) -> Array:
    """Return the trajectory over `union_state(models)`, u axes, under given modes and noise.

    Parameters
    ----------
    models
        The motion model of each mode.
    modes
        Modes (*b, s): modes[k] moves the state from times[k-1] to times[k]; modes[0] only decides which axes of x0 count.
    x0
        First states (*b, u).
    times
        Times in s (s,), never going back, x0 at the first.
    standard
        Standard normal numbers (*b, s-1, u).
    fresh
        Where an axis starts that the last model lacked (*b, s-1, u).

    Returns
    -------
    array
        States (*b, s, u), NaN on the axes that the current mode lacks.
    """
    space = union_state(models)
    places = [np.array(space.locate(model.state), dtype=np.intp) for model in models]
    lacks = np.ones((len(models), len(space)), dtype=bool)
    for j, axes in enumerate(places):
        lacks[j, axes] = False
    x = np.where(lacks[modes[..., 0]], np.nan, space.canonical(over(space, x0, modes.shape[:-1])))
    states = np.empty((*modes.shape, len(space)))
    states[..., 0, :] = x
    factors: list[dict[float, Array]] = [{} for _ in models]
    for k, dt in enumerate(steps_of(times)):
        x = np.where(np.isnan(x), fresh[..., k, :], x)
        after = np.full(x.shape, np.nan)
        for j, model in enumerate(models):
            rows = modes[..., k + 1] == j
            if np.any(rows):
                part = np.full((int(np.sum(rows)), len(space)), np.nan)
                part[:, places[j]] = step(
                    model, x[rows][:, places[j]], dt, standard[..., k, :][rows][:, places[j]], factors[j]
                )
                after[rows] = part
        states[..., k + 1, :] = x = after
    return states


def draw_jump_markov(
    models: Sequence[MotionModel],
    transition: Array,
    x0: Array,
    mode0: Modes | int,
    times: Array,
    rng: np.random.Generator,
    size: tuple[int, ...] = (),
    starts: Mapping[str, tuple[float, float]] | None = None,
) -> tuple[Modes, Array]:
    """Draw trajectories that switch between models by a Markov chain; shared axes are carried over by their names.

    Parameters
    ----------
    models
        The motion model of each mode.
    transition
        Probabilities (r, r) of every step longer than 0 s: row the mode, column the next.
    x0
        First states (*b, u) over `union_state(models)`.
    mode0
        First modes () or (*b).
    times
        Times in s (s,), never going back, x0 at the first.
    rng
        The generator that is drawn from.
    size
        Batch axes: so many trajectories are drawn from each first state.
    starts
        Axis to [mean, standard deviation], in the axis' unit, from which it starts when the last model lacked it.

    Returns
    -------
    tuple of arrays
        Modes (*size, *b, s), and states (*size, *b, s, u), NaN on the axes that the mode lacks.

    Raises
    ------
    ValueError
        If an axis that not all models have is not in `starts`, or for what `switch` refuses.
    """
    space, starts = union_state(models), starts or {}
    if len(transition) != len(models):
        raise ValueError(f"transition: must have one row for each of the {len(models)} models, got {len(transition)}")
    come_and_go = [name for name in space.names if name not in common_state(models)]
    if missing := [name for name in come_and_go if name not in starts]:
        raise ValueError(f"starts: must give [mean, standard deviation] of {', '.join(missing)}, which not all models have")
    shape = (*size, *np.shape(x0)[:-1], max(len(times) - 1, 0))
    modes = switch(transition, mode0, times, rng.random(shape))
    standard = rng.standard_normal((*shape, len(space)))
    mean, deviation = np.array([starts.get(name, (0.0, 0.0)) for name in space.names]).T
    fresh = mean + deviation * rng.standard_normal((*shape, len(space)))
    return modes, follow_modes(models, modes, x0, times, standard, fresh)
