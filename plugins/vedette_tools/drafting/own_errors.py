"""Errors that a table tells: of each return, in columns of deviations, or variances and covariances; of all, by digits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations, pairwise
from math import gcd, sqrt

from vedette.units import in_unit
from vedette_files.tables.numbers import is_number
from vedette_tools.drafting.several import GEODETIC
from vedette_tools.drafting.titles import UNITS, by_words_of

DEVIATION, VARIANCE = ("sigma", "std", "stddev", "stdev", "sd", "deviation"), ("var", "variance")
"""Words before or behind that of an axis."""

EARTH = 6.371e6
"""m: the radius of the earth."""

SEVERAL = 8
"""Of so many numbers all are whole steps by no chance: of twice the last digit, one time in 128."""

MOST = 0.9
"""Of so many rows the errors are above 0, or the columns are not read."""


def own_errors(axes: Mapping[str, str], columns: Mapping[str, Sequence[str]]) -> dict[str, str]:
    """Return the columns of errors by axis, as a source reads them; axes: those measured, to the axes of their titles.

    Nothing unless there is one for each axis: errors of latitudes may be in degrees or m, and are not read.

    >>> own_errors({"x": "x", "y": "y"}, {"x_std": ["2.0"], "y_std": ["3.0"]})
    {'x': 'x_std', 'y': 'y_std'}
    """
    by_words = by_words_of(columns)
    found: dict[str, str] = {}
    for axis, word in axes.items():
        deviations = [name for each in DEVIATION for name in (f"{each}_{word}", f"{word}_{each}")]
        variances = [name for each in VARIANCE for name in (f"{each}_{word}", f"{word}_{each}")]
        variances += [f"cov_{word}{word}", f"cov_{word}_{word}"]
        for key, names in ((axis, deviations), (f"{axis} {axis}", variances)):
            title = next((by_words[name] for name in names if name in by_words), "")
            if title and _above_0(columns[title]):
                found[key] = title
                break
        else:
            return {}
    for (one, first), (other, second) in combinations(axes.items(), 2):
        names = [f"cov_{a}{between}{b}" for a, b in ((first, second), (second, first)) for between in ("", "_")]
        title = next((by_words[name] for name in names if name in by_words), "")
        found |= {f"{one} {other}": title} if title else {}
    return found


def _above_0(cells: Sequence[str]) -> bool:
    good = sum(is_number(cell) and float(cell) > 0 for cell in cells)
    return len(cells) > 0 and good >= MOST * len(cells)


def roundings(columns: Mapping[str, Sequence[str]], units: Mapping[str, str]) -> dict[str, float]:
    """Return the deviation, in SI units, that the cells of each axis have for want of digits, or as all are whole steps of
    more, as altitudes of 25 ft; 0 where these do not tell it. That of latitudes and longitudes is in m, along a meridian.

    >>> {axis: round(size, 2) for axis, size in roundings({"x": ["1.25", "7.1"], "y": ["30"]}, {"x": "km"}).items()}
    {'x': 2.89, 'y': 0.29}
    >>> round(roundings({"altitude": [str(25 * (1400 + k)) for k in range(9)]}, {"altitude": "ft"})["altitude"], 2)
    2.2
    """
    found = {}
    for axis, cells in columns.items():
        unit = units.get(axis, "deg" if axis in GEODETIC else "")
        size, _, word = unit.rpartition(" ")
        try:
            step = in_unit(f"{size or 1} {word}", "rad" if word in UNITS["rad"].values() else "m") if word else 1.0
        except ValueError:
            step = 1.0  # of pixels
        step *= EARTH if axis in GEODETIC else 1.0
        given = [cell.lower() for cell in cells if is_number(cell)]
        digits = max((len(cell.partition(".")[2]) for cell in given), default=0)
        told = bool(given) and not any("e" in cell for cell in given)  # not where degrees have minutes
        found[axis] = step * 10.0**-digits * _steps(given, digits) / sqrt(12) if told else 0.0
    return found


def _steps(cells: Sequence[str], digits: int) -> int:
    """Return how many of their last digits numbers are apart, all of them; 1 of few, which may be so by chance."""
    there = sorted({round(float(cell) * 10**digits) for cell in cells})
    return gcd(*(b - a for a, b in pairwise(there))) if len(there) >= SEVERAL else 1
