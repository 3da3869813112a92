"""States, time steps and Gaussians for the laws: of usual size for the unit of each axis, and a small change."""

from __future__ import annotations

from functools import cache

import numpy as np
from hypothesis import strategies as st

from vedette import filters, kernels
from vedette.space import Array, Axis, Space
from vedette.types import Gaussian

STATE_SIZES = {"m": 2000.0, "m/s": 30.0, "m/s^2": 3.0, "rad": np.pi, "rad/s": 0.2, "s": 10.0, "1/km": 10.0, "1/km^2": 100.0}
"""Usual size of a coordinate in a unit."""

SEEDS = st.integers(0, 2**32 - 1)
STEPS = st.one_of(st.sampled_from([0.1, 1.0, 5.0]), st.floats(0.01, 10.0))
"""Time steps in s."""


def size(axis: Axis) -> float:
    """Return the usual size of a coordinate, in the axis' unit."""
    return STATE_SIZES.get(axis.unit, 3.0)


def sizes(space: Space) -> Array:
    """Return the usual size of every axis (n,)."""
    return np.array([size(axis) for axis in space.axes])


def steps_of(space: Space) -> Array:
    """Return a typical small change of every axis (n,)."""
    return 1e-2 * sizes(space)


def speeds_of(space: Space) -> list[tuple[int, int]]:
    """Return the indices of each position x and of the axis vx that is its velocity, in the unit of x per s."""
    axes, units = space.axes, {axis.name: axis.unit for axis in space.axes}
    return [(i, space.names.index(f"v{x.name}")) for i, x in enumerate(axes) if units.get(f"v{x.name}") == f"{x.unit}/s"]


@cache  # Hypothesis validates a strategy anew for each that is made
def points(space: Space, rows: int = 1) -> st.SearchStrategy[Array]:
    """Return a strategy for canonical states (rows, n)."""
    each = [st.one_of(st.floats(-size(axis), size(axis)), st.sampled_from(_marked(axis))) for axis in space.axes]
    plain = Space(space.axes)  # a space that wraps wrongly must not affect the draws
    least = 1e-9 * sizes(space)  # smaller values cannot be told from 0 by differences

    def state(values: tuple[float, ...]) -> Array:
        x = np.reshape(np.array(values), (rows, len(space)))
        return plain.canonical(np.where(np.abs(x) < least, 0.0, x))

    return st.tuples(*(each * rows)).map(state)


def _marked(axis: Axis) -> list[float]:
    """Return values where components often go wrong: 0, small, ordinary, far away, and on the wrap."""
    usual = [0.0, size(axis) / 3, -size(axis) / 5, size(axis) / 100]
    if axis.period is not None:
        return [*usual, -axis.period / 2, 0.4999 * axis.period]
    return [*usual, 4 * size(axis)] if axis.unit == "m" else usual


def random_covariance(space: Space, rng: np.random.Generator, batch: tuple[int, ...] = (), scale: float = 0.02) -> Array:
    """Draw positive definite covariances (*batch, n, n), of deviations of about `scale` of each axis' usual size."""
    n = len(space)
    mix = np.eye(n) + 0.4 * rng.standard_normal((*batch, n, n)) / np.sqrt(max(n, 1))
    root = scale * sizes(space)[:, None] * mix
    cov: Array = root @ np.swapaxes(root, -1, -2)
    return kernels.symmetric(cov)


def without_variance(belief: Gaussian, space: Space, fixed: Space) -> Gaussian:
    """Return a belief over a space without variance on some of its axes."""
    return Gaussian(belief.mean, filters.without_variance(belief.cov, space.locate(fixed)))


def random_gaussian(space: Space, rng: np.random.Generator, batch: tuple[int, ...] = ()) -> Gaussian:
    """Draw beliefs around states of a quarter of the usual size: mean (*batch, n), cov (*batch, n, n)."""
    mean = space.canonical(0.25 * sizes(space) * rng.standard_normal((*batch, len(space))))
    return Gaussian(mean, random_covariance(space, rng, batch))
