"""False-alarm rates of constant-false-alarm-rate tests in exponential noise, in closed form, and their inverses.

A cell of power p is an echo if p > T Z, with Z from N reference cells around it. In noise of exponential power the rate
of false alarms does not depend on the noise's level. Gandhi, Kassam, Analysis of CFAR processors in nonhomogeneous
background, IEEE T-AES 24, 1988.
"""

from __future__ import annotations

import math
from collections.abc import Callable

KINDS = ("CA", "GO", "OS")
"""Z is the mean of all cells, the greater of the means of the near and the far half, or the cell of a given rank."""


def greatest_of(factor: float, cells: int) -> float:
    """Return 2 (1 + t)^-n - 2 sum_(k < n) C(n - 1 + k, k) (2 + t)^-(n + k), with n = N/2 and t = T/n."""
    n = cells // 2
    t = factor / n
    beside = sum(
        math.exp(math.lgamma(n + k) - math.lgamma(n) - math.lgamma(k + 1) - (n + k) * math.log(2 + t)) for k in range(n)
    )
    return 2 * math.exp(-n * math.log1p(t)) - 2 * beside


def ordered(factor: float, cells: int, rank: int) -> float:
    """Return product_(i < k) (N - i) / (N - i + T), with k the rank."""
    return math.exp(sum(math.log((cells - i) / (cells - i + factor)) for i in range(rank)))


def factor(kind: str, cells: int, rank: int, rate: float) -> float:
    """Return T for a false-alarm rate; GO and OS by bisection, to machine precision."""
    if kind == "CA":
        return cells * math.expm1(-math.log(rate) / cells)
    tell: Callable[[float], float] = {
        "GO": lambda t: greatest_of(t, cells),
        "OS": lambda t: ordered(t, cells, rank),
    }[kind]
    low, high = 0.0, 1.0
    while tell(high) > rate:
        high *= 2.0
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if tell(middle) > rate else (low, middle)
    return high
