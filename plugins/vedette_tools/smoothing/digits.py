"""What the digits of positions leave out: no error is smaller, however often an object at rest repeats them."""

from __future__ import annotations

import numpy as np

from vedette.space import Array, Indices
from vedette_tools.smoothing.paths import edges_of

LOOKED_AT, SEVERAL = 1000, 3
"""So many rows of an object tell it, of so many different numbers: all are of ten times the step one time in a thousand."""

PARTS, MOST_DIGITS = (1, 60, 3600), 9
"""Degrees may have been minutes or seconds before; more than so many digits after the point are taken to be whole."""

SHOWN = 2e-14
"""So near a step is a number that was written with 15 digits, in parts of itself."""


def roundings(numbers: Array, codes: Indices, sizes: Array, *, degrees: bool) -> tuple[Array, float]:
    """Return the deviation along an axis of what digits leave out, of each object, NaN where it has too few, and of all: the
    least of an object's, or what all rows show together; 0 where none are cut.

    numbers (n, 2): positions as they are written; codes (n,): whose each is, in order; sizes (2,): what 1 is, in m.
    """
    starts = edges_of(codes)
    first = np.arange(len(codes)) < np.repeat(starts[:-1], np.diff(starts)) + LOOKED_AT
    numbers, codes = numbers[first], codes[first]
    parts = PARTS if degrees else (1,)
    of_objects = np.stack([_steps(column, codes, parts, SEVERAL) for column in numbers.T], axis=-1) * sizes
    own = np.max(np.nan_to_num(of_objects, nan=-1.0), axis=-1) / np.sqrt(12.0)
    own = np.where(own < 0, np.nan, own)
    if np.isfinite(own).any():
        return own, float(np.nanmin(own))
    for several in (2, 1):  # what is the same in all rows says little: 10 may be a meridian
        whole = (
            np.array([_steps(column, 0 * codes, parts, several)[:1] for column in numbers.T]).ravel() * sizes[: len(codes)]
        )
        if np.isfinite(whole).any():
            return own, float(np.nanmax(whole)) / np.sqrt(12.0)
    return own, 0.0


def _steps(numbers: Array, codes: Indices, parts: tuple[int, ...], several: int) -> Array:
    """Return of each object the largest step of which all its numbers are multiples, 0 without one; NaN if these are few."""
    order = np.lexsort((numbers, codes))
    numbers, codes = numbers[order], codes[order]
    fresh = np.append(True, (np.diff(numbers) != 0) | (np.diff(codes) != 0))[: len(numbers)]
    numbers, codes = numbers[fresh], codes[fresh]
    count = np.bincount(codes)
    found = np.zeros(len(count))
    for step in sorted(10.0**-k / part for part in parts for k in range(MOST_DIGITS + 1)):
        off = np.abs(numbers - step * np.rint(numbers / step)) > SHOWN * np.abs(numbers)
        found[np.bincount(codes, off) == 0] = step
    return np.where(count >= several, found, np.nan)
