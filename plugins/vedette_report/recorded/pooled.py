"""The NIS of a track over scans, by the probabilities of its returns."""

from __future__ import annotations

import numpy as np

from vedette.metrics import gate_truncation, within_gate
from vedette.space import Array


def pooled_nis(nis: Array, hit: Array, axes: Array | int, gate_probability: Array | float = 1.0) -> Array:
    """Return the sum of the weighted NIS over its expectation: 1 on matched truth. (*b, s) -> (*b), NaN where all is missed.

    nis (*b, s) is sum_i w_i nis_i over a scan's returns and hit (*b, s) is sum_i w_i; `axes` and `gate_probability` are
    those of each scan (s,), or of all. As w_i is the probability that return i is the target's, both sums are expectations
    over which return it is: their ratio requires no choice of a return. Chi-square holds only if all weights are known to
    be 0 or 1.
    """
    inside = within_gate(nis, hit, axes, gate_probability)
    expected = np.sum(inside * hit * axes * gate_truncation(axes, gate_probability), axis=-1)
    total = np.sum(inside * nis, axis=-1)
    return np.divide(total, expected, out=np.full(np.shape(total), np.nan), where=expected > 0)
