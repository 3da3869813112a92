"""Which of Q and R is wrong in one run, where truth is given: a sensor's errors are known then, and need no guess."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from vedette.space import Array
from vedette_report.detector_errors.off_truth import beside
from vedette_report.detector_errors.shape import long_run
from vedette_report.noises import sized
from vedette_report.recorded.off_path import OffPath

FEWEST = 50
"""Of fewer returns the size tells no R from another that is half as large: by hand."""
WRONG = 0.2
"""An R is told that is off by such a part, beyond chance; errors go on that are alike by such a part: by hand."""
RIGHT = 2.0
"""R is called right where it is within so many deviations along each axis, and these are so many times below `WRONG`."""
LARGE, SURE = 1.2, 3.5
"""NEES is off where both halves of a run are by this, and the whole by so many deviations: by hand."""


def by_truth(off: Collection[OffPath], nees: Array | None, slow: float, told: bool) -> str:
    """Return which of Q and R is likely wrong, by the returns less the truth; "" if these do not tell.

    nees: (s,), 1 expected. slow: above 0 where innovations look as of too small a Q, below 0 of too large a one; told:
    whether they are beyond chance. Where the sensors' errors are white and as large as R says, it is Q.
    """
    way = _off(nees) or (float(np.sign(slow)) if told else 0.0)
    sizes = [_sizes(one) for one in off]
    if not way or not sizes or any(one is None for one in sizes):
        return ""
    each = [size for one in sizes if one is not None for size in one]
    wrong = [text for name, size, error in each if (text := sized(name, size, error, WRONG))]
    if wrong:
        return f"by the truth, if that is exact, {', '.join(wrong)}"
    if any(abs(size - 1.0) > RIGHT * error or RIGHT * error > WRONG for _, size, error in each):
        return ""  # neither is told: that R is not shown to be wrong does not make it right
    return f"by the truth returns are as R says: likely Q is too {'small' if way > 0 else 'large'}"


def _sizes(off: OffPath) -> list[tuple[str, float, float]] | None:
    """Return of each axis its name, its squared errors over R, and the error of that; None if they are not white, or few."""
    seen = off.returns
    if np.count_nonzero(off.sampled) < FEWEST or beside(off.sensor, off.space, seen) is not None:
        return None
    u = (seen.apart / np.sqrt(np.diagonal(seen.noise, axis1=-2, axis2=-1)))[off.sampled]
    power = np.mean(u**2, axis=0)
    alike = np.mean(u[1:] * u[:-1], axis=0) / power
    if np.any(np.abs(alike) > max(WRONG, SURE / np.sqrt(len(u)))):
        return None
    errors = np.std(u**2, axis=0, ddof=1) / np.sqrt(len(u))
    names = [f"R of {off.sensor} along {axis}" for axis in off.space.names]
    return list(zip(names, power.tolist(), errors.tolist(), strict=True))


def _off(nees: Array | None) -> float:
    """Return 1 where errors are larger than stated, -1 where smaller, all the run; 0 if that is not beyond chance."""
    if nees is None or len(nees) < FEWEST:
        return 0.0
    logs = [float(np.log(np.mean(part))) for part in np.array_split(nees, 2)]
    mean = float(np.mean(nees))
    reach = SURE * np.sqrt(long_run(nees)) / len(nees) / mean
    off = min(map(abs, logs)) > np.log(LARGE) and logs[0] * logs[1] > 0 and abs(np.log(mean)) > reach
    return float(np.sign(logs[0])) if off else 0.0
