"""What the kinds share that are given as matrices: axes by name, and what a matrix must be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vedette import Array, Space

_UNITS = {**dict.fromkeys("xyz", "m")}
_UNITS |= {f"v{axis}": "m/s" for axis in "xyz"} | {f"a{axis}": "m/s^2" for axis in "xyz"}


def named_space(axes: Sequence[str], units: Mapping[str, str]) -> Space:
    """Return the space of axes; x, vx, ax and their like are in m, m/s, m/s^2 and others in 1 unless `units` says otherwise.

    ValueError, naming the parameter, for a unit of an axis that there is not.
    """
    for name in units:
        if name not in axes:
            raise ValueError(f"units.{name}: there is no such axis; those are {', '.join(axes)}")
    return Space.of(**{name: units.get(name, _UNITS.get(name, "1")) for name in axes})


def covariance_fault(matrix: Array, *, definite: bool) -> str | None:
    """Return what keeps a matrix from being a covariance; None if it is one."""
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1]:
        return f"must be square, got {matrix.shape[0]} x {matrix.shape[-1]}"
    if not np.allclose(matrix, matrix.T, rtol=1e-9, atol=0.0):
        return f"must be symmetric, got {matrix.tolist()}"
    smallest, largest = np.linalg.eigvalsh(matrix)[[0, -1]] if len(matrix) else (1.0, 1.0)
    if smallest < -1e-12 * abs(largest) or (definite and smallest <= 0):
        return f"must be positive {'definite' if definite else 'semi-definite'}, got the eigenvalue {smallest:.3g}"
    return None
