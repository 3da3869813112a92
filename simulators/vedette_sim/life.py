"""When an object of a scene is there."""

from __future__ import annotations

import numpy as np

from vedette import Array


def check_life(appears: float, disappears: float | None) -> None:
    """Raise ValueError if an object is gone before it comes."""
    if disappears is not None and disappears <= appears:
        raise ValueError(f"disappears: must be after it appears at {appears:.6g} s, got {disappears:.6g} s")


def life(appears: float, disappears: float | None, scan_times: Array, duration: float) -> Array:
    """Return the times at which an object is known: when it appears, at each scan, when it is gone or the scene ends."""
    last = duration if disappears is None else min(disappears, duration)
    return np.unique([appears, *scan_times[(scan_times > appears) & (scan_times < last)], last])
