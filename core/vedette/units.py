"""Units that a config may write after a number, and the SI units that components hold.

>>> in_unit("90 deg", "rad")
1.5707963267948966
>>> in_unit("90deg", "rad")
1.5707963267948966
"""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np

_SI = {
    "m": {"m": 1.0, "km": 1e3, "NM": 1852.0, "ft": 0.3048, "cm": 1e-2, "mm": 1e-3, "um": 1e-6},
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0},
    "m/s": {"m/s": 1.0, "km/h": 1 / 3.6, "kn": 1852 / 3600},
    "m/s^2": {"m/s^2": 1.0, "g": 9.80665},
    "m/s^1.5": {"m/s^1.5": 1.0, "m/s^2": 1.0, "g": 9.80665},
    "m/s^2.5": {"m/s^2.5": 1.0, "m/s^3": 1.0},
    "rad": {"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180, "mil": math.pi / 3200},
    "rad/s": {"rad/s": 1.0, "deg/s": math.pi / 180},
    "rad/s^2": {"rad/s^2": 1.0, "deg/s^2": math.pi / 180},
    "rad/s^1.5": {"rad/s^1.5": 1.0, "deg/s^1.5": math.pi / 180, "rad/s^2": 1.0, "deg/s^2": math.pi / 180},
    "px/s^0.5": {"px/s^0.5": 1.0, "px": 1.0},
    "px/s^1.5": {"px/s^1.5": 1.0, "px/s^2": 1.0},
    "deg": {"deg": 1.0, "rad": 180 / math.pi},
}
"""SI unit to spelling and factor. The root of a white noise's spectral density has a half power of seconds; what the noise
gains in 1 s, which has the same number, may be written in its stead: older configs do. A circle has 6,400 mil.
"""

_NUMBER = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?![eE][-+]?\d))\s*([^\W\d_].*)?$")


def spellings(unit: str) -> tuple[str, ...]:
    """Return what a config may write after a number for a parameter in `unit`; nothing after a pure number."""
    return () if unit in ("1", "") else tuple(_SI.get(unit, (unit,)))


def say(value: float, unit: str = "1") -> str:
    """Format a number for a message, with its unit unless that is 1."""
    number = f"{value:.6g}"
    return number if unit in ("1", "") else f"{number} {unit}"


def in_unit(value: Any, unit: str, largest: float = math.inf, name: str = "") -> float:
    """Return `value`, a number or a string like "1.5 deg", in `unit`; ValueError says what would be right."""
    where = f"{name}: " if name else ""
    known = _SI.get(unit, {unit: 1.0})
    factor = 1.0
    given = value
    if isinstance(value, str):
        joined = _NUMBER.match(value.strip())  # "0.6deg" is read as "0.6 deg" is
        value, written = joined.groups() if joined else value.strip().partition(" ")[::2]
        if written and written not in known:
            right = "a number without a unit" if unit == "1" else f"in {' or '.join(list(known)[:4])}"
            raise ValueError(f"{where}must be {right}, got {given!r}")
        factor = known.get(written, 1.0)
    try:
        if isinstance(value, bool) or np.ndim(value) or (isinstance(value, str) and "_" in value):
            raise TypeError  # "1_0" is a number in Python alone
        number = factor * float(value)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{where}must be a number{f' in {unit}' if unit != '1' else ''}, got {given!r}") from None
    if not abs(number) <= largest:  # also False for NaN
        raise ValueError(f"{where}must be a finite number of at most {largest:g}, got {given!r}")
    return number


def short(value: Any) -> str:
    """Return a value in words, cut where it is long."""
    text = repr(value)
    return text if len(text) <= 80 else f"{text[:77]}..."
