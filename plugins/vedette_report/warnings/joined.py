"""Whether a truth that is told in parts is judged where it tells nothing: there it is joined by lines."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from vedette import Array, Trajectory
from vedette.units import say

WIDE, PART = 5.0, 0.05
"""A gap is so many usual steps of its object wide; told where such a part of what is judged lies in gaps. By hand."""


def joined(truth: Sequence[Trajectory], times: Array) -> Iterator[str]:
    """Yield a sentence where lines go over much of what is judged: scans at `times` in gaps of the truth, off its rows."""
    usual, gaps, inside, whole = 0.0, [0.0], 0, 0
    for path in truth:
        waits = np.diff(path.times)
        if not len(waits):
            continue
        step = float(np.median(waits))
        usual = max(usual, step)
        judged = times[(times >= path.times[0]) & (times <= path.times[-1])]
        after = np.clip(np.searchsorted(path.times, judged), 1, len(waits))
        off = np.minimum(judged - path.times[after - 1], path.times[after] - judged) > step
        within = off & (waits[after - 1] > WIDE * step)
        gaps += waits[after - 1][within].tolist()
        inside, whole = inside + int(np.count_nonzero(within)), whole + len(judged)
    if inside > PART * whole:
        longest = say(float(f"{max(gaps):.3g}"), "s")
        told = f"{inside / whole:.0%} of what is judged lies in gaps of the truth of up to {longest}, over which lines go"
        yield f"{told}: all figures take these for objects; to leave them out, set judge.truth_gap = {1.5 * usual:.3g}"
