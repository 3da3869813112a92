"""Typed arrays as text: bytes of equal weight together, deflated, in base64. `data.js` unpacks them."""

from __future__ import annotations

import zlib
from base64 import b64encode
from typing import Any

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from vedette.space import Array

EXACT, PLAIN = 23, 16
"""Bits of the mantissa that a float keeps: of a place, and of a value, whose relative error is then at most 2^-17."""


@frozen
class Packed:
    """A column of the page: its name, as `tracks.id`, the type of its numbers, and their text."""

    name: str
    type: str
    text: str


def pack(name: str, values: NDArray[Any]) -> Packed:
    """Return a column as text; its numbers keep their bits."""
    flat = np.ascontiguousarray(values).reshape(-1)
    raw = flat.astype(flat.dtype.newbyteorder("<"), copy=False).view(np.uint8).reshape(-1, flat.itemsize)
    return Packed(name, flat.dtype.str[1:], b64encode(zlib.compress(raw.T.tobytes(), 6)).decode())


def single(values: Array, bits: int = PLAIN) -> NDArray[np.float32]:
    """Return numbers in single precision, rounded to so many bits of the mantissa; NaN stays NaN."""
    whole = np.asarray(values, dtype=np.float32)
    lost = EXACT - bits
    if not lost:
        return whole
    raw = whole.view(np.uint32)
    rounded = ((raw + np.uint32(1 << (lost - 1))) & ~np.uint32((1 << lost) - 1)).view(np.float32)
    return np.where(np.isfinite(whole) & np.isfinite(rounded), rounded, whole)
