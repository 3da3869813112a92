"""Random numbers of many generators at once: what each would draw by itself."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vedette.space import Array

Generators = Sequence[np.random.Generator]


def normals(rngs: Generators, shape: tuple[int, ...]) -> Array:
    """Draw standard normal numbers (r, *shape), row i from generator i. No other thread may draw from them meanwhile."""
    return np.array([rng.standard_normal(shape) for rng in rngs]).reshape(len(rngs), *shape)


def uniforms(rngs: Generators, shape: tuple[int, ...]) -> Array:
    """Draw uniform numbers in [0, 1) (r, *shape), row i from generator i. No other thread may draw from them meanwhile."""
    return np.array([rng.random(shape) for rng in rngs]).reshape(len(rngs), *shape)
