"""Whether a truth that is told in parts is judged where it tells nothing: there it is joined by lines."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from vedette.types import Trajectory
from vedette.units import say

WIDE, PART = 5.0, 0.05
"""A gap is so many usual steps of its object wide, and told where gaps are such a part of all that is judged. By hand."""


def joined(truth: Sequence[Trajectory]) -> Iterator[str]:
    """Yield a sentence where much of a truth lies in gaps that lines go over."""
    usual, gaps, whole = 0.0, [0.0], 0.0
    for path in truth:
        waits = np.diff(path.times)
        if len(waits):
            usual = max(usual, float(np.median(waits)))
            gaps += waits[waits > WIDE * np.median(waits)].tolist()
            whole += float(np.sum(waits))
    if sum(gaps) > PART * whole:
        longest = say(float(f"{max(gaps):.3g}"), "s")
        told = f"{sum(gaps) / whole:.0%} of the truth are gaps of up to {longest}, over which lines go"
        yield f"{told}: all figures take these for objects; to leave them out, set judge.truth_gap = {1.5 * usual:.3g}"
