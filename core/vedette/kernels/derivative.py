"""A derivative for models that state none."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from vedette.space import Array


def numerical_jacobian(function: Callable[[Array], Array], x: Array, difference: Callable[[Array, Array], Array]) -> Array:
    """Central differences of `function` (*b, n) -> (*b, m): (*b, m, n), truncation error O(step^2).

    `difference(a, b)` subtracts results, the short way round where they wrap.
    """
    n = x.shape[-1]
    step = np.cbrt(np.finfo(float).eps) * np.maximum(1.0, np.abs(x))
    moves = step[..., None, :] * np.eye(n)
    slope = difference(function(x[..., None, :] + moves), function(x[..., None, :] - moves))
    return np.swapaxes(slope / (2.0 * step[..., :, None]), -1, -2)
