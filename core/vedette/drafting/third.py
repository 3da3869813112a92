"""What returns measure beside a position in the plane: a height, or a range rate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vedette.drafting.chains import Chain
from vedette.drafting.titles import Meaning
from vedette.space import Array

THIRD: dict[str, dict[str, tuple[str, ...]]] = {
    "range": {"range_rate": ("range_rate",)},
    "latitude": {"altitude": ("altitude", "z")},
    "x": {"z": ("z", "altitude")},
    "east": {"z": ("z", "altitude")},
}
"""By the first axis of the position: what else a source reads, and the axes that titles may name it by."""

EVEN = 0.01
"""Three returns are even in time if their two steps differ by less than this share."""


def third_column(first: str, measured: Mapping[str, Meaning], columns: Mapping[str, list[str]]) -> dict[str, str]:
    """Return what else is read and the axis of its title: only a column that has a number in each row, and not one alone."""
    for key, names in THIRD[first].items():
        for name in names:
            cells = columns[measured[name].title] if name in measured else []
            if len(set(cells)) > 1 and all(map(_is_number, cells)):
                return {key: name}
    return {}


def third_noise(found: Sequence[Chain], thirds: Sequence[Array]) -> float:
    """Return the standard deviation of its errors, by its second differences along chains; NaN without any.

    Steady motion leaves the noise alone in them: sqrt(6) of it. The median takes no notice of jumps to another target.
    """
    apart: list[Array] = [np.zeros(0)]
    for chain in found:
        if len(chain.times) > 2:
            dt = np.diff(chain.times)
            apart.append(np.diff(_along(chain, thirds), 2)[np.abs(dt[1:] - dt[:-1]) < EVEN * dt[1:]])
    every = np.concatenate(apart)
    return float(1.4826 * np.median(np.abs(every)) / np.sqrt(6)) if len(every) else float("nan")


def recedes(found: Sequence[Chain], thirds: Sequence[Array], stands: Array) -> bool:
    """Return whether rates are positive where ranges grow."""
    total = 0.0
    for chain in found:
        ranges = np.linalg.norm(chain.spots - stands[chain.scans], axis=-1)
        rates = _along(chain, thirds)
        total += float(np.sum(np.diff(ranges) * (rates[1:] + rates[:-1])))
    return total > 0


def _along(chain: Chain, thirds: Sequence[Array]) -> Array:
    return np.array([thirds[i][j] for i, j in zip(chain.scans.tolist(), chain.returns.tolist(), strict=True)])


def _is_number(cell: str) -> bool:
    try:
        return bool(np.isfinite(float(cell)))
    except ValueError:
        return False
