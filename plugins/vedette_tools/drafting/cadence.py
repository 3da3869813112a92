"""Scans that a file leaves out because they held no return: the period by which a source puts them back."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vedette.space import Array

LEAST = 20
"""Fewer intervals show no period."""

NEAR = 0.1
"""An interval is a whole number of periods if it is so to this part of one."""

SHORT = 3
"""Longer gaps may be pauses, and any is near a whole number of periods if times are jittered: they tell nothing."""

SHARE = 0.8
"""Such a part of all intervals is one period or a short gap, and of the short gaps a whole number of them."""


def left_out_period(times: Array, counts: Sequence[int]) -> float | None:
    """Return the period in s at which scans are missing from `times` (s,) for want of returns; None if none are.

    `counts`: the returns of each scan. Sums of independent returns have log-concave counts, p(0) p(2) <= p(1)^2: where
    hardly any scan has a single return, a gap is a pause and no scan without any.
    """
    dt = np.diff(times)
    if len(dt) < LEAST:
        return None
    period = float(np.median(dt))
    ratio = dt / period if period > 0 else np.zeros(len(dt))
    whole = np.rint(ratio)
    near = np.abs(ratio - whole) <= NEAR
    single, gap = (whole == 1) & near, (ratio > 1.5) & (whole <= SHORT)
    if np.count_nonzero(single | gap) < SHARE * len(dt) or np.count_nonzero(gap) < 2:
        return None
    if np.count_nonzero(gap & near) < SHARE * np.count_nonzero(gap):
        return None
    empty = float(np.sum(whole[gap & near] - 1))
    one, two = (sum(count == k for count in counts) for k in (1, 2))
    if empty > 1 + 2 * one * max(1.0, one / max(two, 1)):
        return None
    return float(f"{np.mean(ratio[single]) * period:.4g}")
