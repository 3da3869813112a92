"""Functions of elapsed time over time constant, for models with exponentially decaying correlation."""

from __future__ import annotations

import math

import numpy as np

_ORDERS = np.arange(26)
_SERIES = np.array(
    [
        [
            1 / math.factorial(i + 1),
            1 / math.factorial(i + 2),
            2**i / math.factorial(i + 1),
            (2 ** (i + 2) - 2) / math.factorial(i + 3),
            (2 ** (i + 2) - i - 3) / math.factorial(i + 3),
            (2 ** (i + 4) - 2 * i - 10) / math.factorial(i + 5),
        ]
        for i in range(len(_ORDERS))
    ]
)
"""Coefficients of (-u)^i of the six functions in `shares`; at u = 1 what is left out is below 1e-17."""


def shares(u: float) -> tuple[float, ...]:
    """Return the parts of F and Q that depend on u = T/tau >= 0 alone; by series below u = 1, where they cancel.

    With e = exp(-u): the gains a = (1 - e)/u of velocity and b = (1 - a)/u of position, and of the variances the shares
    c = (1 - e^2)/(2u), (1 - 2a + c)/u^2 of velocity, (c - e)/u^2 of position with acceleration, and
    (u^2/3 - u + 1 + c - 2e)/u^4 of position.
    """
    if u < 1.0:
        return tuple(((-u) ** _ORDERS @ _SERIES).tolist())
    e = math.exp(-u)
    a, c = (1 - e) / u, (1 - e * e) / (2 * u)
    return a, (1 - a) / u, c, (1 - 2 * a + c) / u / u, (c - e) / u / u, (((1 + c - 2 * e) / u - 1) / u + 1 / 3) / u / u
