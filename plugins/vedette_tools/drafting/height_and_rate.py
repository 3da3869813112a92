"""What returns measure beside a position in the plane: a height, an elevation, or a range rate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import zip_longest
from math import comb, sqrt

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from vedette.space import Array
from vedette_files.tables.numbers import is_number
from vedette_tools.drafting.chains import Chain
from vedette_tools.drafting.titles import Meaning, meaning

THIRD: dict[str, dict[str, tuple[str, ...]]] = {
    "range": {"elevation": ("elevation",), "range_rate": ("range_rate",)},
    "latitude": {"altitude": ("altitude", "z")},
    "x": {"z": ("z", "altitude")},
    "east": {"z": ("z", "altitude")},
}
"""By the first axis of the position: what else a source reads, and the axes that titles may name it by."""

UPWARD = ("elevation", "z", "altitude")
"""What of these makes a position one in space."""

UPRIGHT = 90.0
"""deg: no elevation is larger."""

VELOCITY = ("vx", "vy", "speed", "course")
"""The axes of a platform's velocity."""

UNSURE = 0.2
"""Beyond this standard error the data do not tell whether rates hold the platform's own motion: 1 is all of it, 0 none."""

EVEN = 0.01
"""Returns are even in time if their steps differ by less than this share."""

HIGHEST = 8
"""Differences of heights are taken up to this order."""


def fullest(height: Meaning, columns: Mapping[str, list[str]], below: Sequence[str]) -> Meaning:
    """Return which of the heights that a table has, as baroaltitude and geoaltitude, has the most numbers; if alike, the one
    that was found. `below`: the row of units, or [].
    """
    others = (meaning(title, stated) for title, stated in zip_longest(columns, below, fillvalue=""))
    alike = (each for each in others if (each.axis, each.own) == (height.axis, height.own))
    return max((height, *alike), key=lambda each: sum(map(is_number, columns[each.title])))


def third_column(first: str, measured: Mapping[str, Meaning], columns: Mapping[str, list[str]]) -> dict[str, str]:
    """Return what else is read and the axis of its title: only a column that has a number in each row, and not one alone."""
    for key, names in THIRD[first].items():
        for name in names:
            cells = columns[measured[name].title] if name in measured else []
            if len(set(cells)) > 1 and all(map(is_number, cells)) and not _is_length(measured[name], cells):
                return {key: name}
    return {}


def _is_length(given: Meaning, cells: Sequence[str]) -> bool:
    """Return whether a column that is called an elevation tells heights."""
    return given.axis == "elevation" and not given.unit and max(abs(float(cell)) for cell in cells) > UPRIGHT


def own_velocity(
    own: Mapping[str, Meaning], platform: Mapping[str, Meaning], columns: Mapping[str, list[str]], compass: bool
) -> dict[str, Meaning]:
    """Return the columns of the platform's velocity that have a number in each row; `compass`: x of latitudes is north."""
    north = compass if "latitude" in platform else platform["x"].axis == "north"
    named = ("vx", "vy") if "x" in platform and platform["x"].axis == "x" else ("vnorth", "veast")
    pairs = {"vx": named[0], "vy": named[1]} if north or named[0] == "vx" else {"vx": named[1], "vy": named[0]}
    for names in (pairs, {"speed": "speed", "course": "course"}):
        thirds = {axis: own[name] for axis, name in names.items() if name in own}
        if len(thirds) == 2 and all(all(map(is_number, columns[each.title])) for each in thirds.values()):
            return thirds
    return {}


def third_noise(chains: Sequence[Chain], thirds: Sequence[Array]) -> float:
    """Return the standard deviation of its errors, by its differences along chains; NaN without any.

    Steady motion leaves the noise alone in second ones: sqrt(6) of it. Of a ball or a satellite they hold its turns, and
    higher ones less of these: the next order is taken as long as it says half as much.
    """
    noise = _by_differences(chains, thirds, 2)
    for order in range(3, HIGHEST + 1):
        finer = _by_differences(chains, thirds, order)
        if not finer < 0.5 * noise:
            break
        noise = finer
    return noise


def _by_differences(chains: Sequence[Chain], thirds: Sequence[Array], order: int) -> float:
    """Return the noise that makes the median of these differences, which takes no notice of jumps to another target."""
    apart: list[Array] = [np.zeros(0)]
    for chain in chains:
        if len(chain.times) > order:
            dt = sliding_window_view(np.diff(chain.times), order)
            apart.append(np.diff(_along(chain, thirds), order)[np.ptp(dt, axis=-1) < EVEN * dt[:, -1]])
    every = np.concatenate(apart)
    return float(1.4826 * np.median(np.abs(every)) / sqrt(comb(2 * order, order))) if len(every) else float("nan")


def recedes(chains: Sequence[Chain], thirds: Sequence[Array], stands: Array, *, relative: bool) -> bool:
    """Return whether rates are positive where ranges grow; `relative`: to the platform, else to where it stood."""
    total = 0.0
    for chain in chains:
        own, fixed = _steps(chain, stands)
        total += float(np.sum((own if relative else fixed) * _mean_rates(chain, thirds)))
    return total > 0


def own_share(chains: Sequence[Chain], thirds: Sequence[Array], stands: Array) -> tuple[float, float]:
    """Return which share of the platform's own motion the rates hold, and its standard error; 1 and 0 if it stands still.

    A radar measures all of it, but many take it out. By least squares: a range as seen from one place grows by the rate,
    plus what the platform's own motion makes of it times the share.
    """
    apart, moved = [np.zeros(0)], [np.zeros(0)]
    for chain in chains:
        own, fixed = _steps(chain, stands)
        apart.append(fixed - _mean_rates(chain, thirds) * np.diff(chain.times))
        moved.append(fixed - own)
    y, w = np.concatenate(apart), np.concatenate(moved)
    total = float(np.sum(w**2))
    if total <= 1e-12 * max(float(np.sum(y**2)), 1e-300):
        return 1.0, 0.0
    share = float(y @ w) / total
    return share, float(np.sqrt(np.mean((y - share * w) ** 2) / total))


def _steps(chain: Chain, stands: Array) -> tuple[Array, Array]:
    """Return by how much the range grows from each return to the next: from the moving platform, and from where it was."""
    places = stands[chain.scans]
    ranges = np.linalg.norm(chain.spots - places, axis=-1)
    return np.diff(ranges), np.linalg.norm(chain.spots[1:] - places[:-1], axis=-1) - ranges[:-1]


def _mean_rates(chain: Chain, thirds: Sequence[Array]) -> Array:
    rates = _along(chain, thirds)
    mean: Array = 0.5 * (rates[1:] + rates[:-1])
    return mean


def _along(chain: Chain, thirds: Sequence[Array]) -> Array:
    return np.array([thirds[i][j] for i, j in zip(chain.scans.tolist(), chain.returns.tolist(), strict=True)])
