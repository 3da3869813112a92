"""Random numbers of many generators at once: what each would draw by itself."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from vedette.space import Array

Generators = Sequence[np.random.Generator]


def normals(rngs: Generators, shape: tuple[int, ...]) -> Array:
    """Draw standard normal numbers (r, *shape), row i from generator i. No other thread may draw from them meanwhile."""
    return _filled((len(rngs), *shape), (rng.standard_normal(shape) for rng in rngs))


def uniforms(rngs: Generators, shape: tuple[int, ...]) -> Array:
    """Draw uniform numbers in [0, 1) (r, *shape), row i from generator i. No other thread may draw from them meanwhile."""
    return _filled((len(rngs), *shape), (rng.random(shape) for rng in rngs))


def _filled(shape: tuple[int, ...], rows: Iterator[Array]) -> Array:
    """Return an array of these rows, which are not held twice."""
    whole = np.empty(shape)
    for i, row in enumerate(rows):
        whole[i] = row
    return whole
