"""A derivative for models that state none."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from vedette.space import Array


def numerical_jacobian(function: Callable[[Array], Array], x: Array, difference: Callable[[Array, Array], Array]) -> Array:
    """Return central differences of `function` (*b, n) -> (*b, m): (*b, m, n), truncation error O(step^2).

    `difference(a, b)` subtracts results, wrapped where they wrap. The step grows with sqrt |x|. In map
    coordinates a step that grew with |x| would be longer than the range of a near target, and a fixed one too short for
    the rounding. Beyond 1e16, where sqrt |x| is less than the rounding, it is 256 times that.
    """
    n = x.shape[-1]
    step = np.cbrt(np.finfo(float).eps) * np.sqrt(np.maximum(1.0, np.abs(x)))
    step = np.maximum(step, 256 * np.spacing(np.abs(x)))
    moves = step[..., None, :] * np.eye(n)
    ahead, behind = x[..., None, :] + moves, x[..., None, :] - moves
    width = np.diagonal(ahead - behind, axis1=-2, axis2=-1)  # what the step is after rounding
    return np.swapaxes(difference(function(ahead), function(behind)) / width[..., :, None], -1, -2)
