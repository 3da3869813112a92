"""Values from a user's hand, such as lists, as arrays: the converters of `vedette.types`."""

from __future__ import annotations

from typing import Any

import numpy as np

from vedette.space import Array, Indices, Mask
from vedette.units import short

_FLOAT, _BOOL = np.dtype(float), np.dtype(bool)


def _array(name: str, value: Any, dtype: np.dtype[Any]) -> Any:
    """Return what a user gave as `name`, such as a list, as an array; None and arrays are returned unchanged."""
    if value is None or (type(value) is np.ndarray and value.dtype is dtype):
        return value
    try:
        if isinstance(value, np.ma.MaskedArray):  # what is masked says nothing: it is no number, and not valid
            value = np.ma.filled(value.astype(dtype), np.nan if dtype is _FLOAT else False)
        given = np.asarray(value)
        if given.dtype.kind != "c":
            return given.astype(dtype, copy=False)
    except (TypeError, ValueError, OverflowError):
        pass
    raise ValueError(f"{name}: must be numbers in rows of equal length, got {short(value)}") from None


def z(value: Any) -> Array:
    if value is None:
        raise ValueError("z: must be numbers in rows, [] for a scan without returns, got None")
    return _array("z", value, _FLOAT)


def valid(value: Any) -> Mask:
    if value is None:
        raise ValueError("valid: must be true or false for each return, got None; `Detections.of(z)` takes all as valid")
    return _array("valid", value, _BOOL)


def evidence(value: Any) -> Array | None:
    return _array("evidence", value, _FLOAT)


def noise(value: Any) -> Array | None:
    return _array("noise", value, _FLOAT)


def times(value: Any) -> Array | None:
    return _array("time", value, _FLOAT)


def missing(value: Any) -> Mask | None:
    return _array("missing", value, _BOOL)


def identity(value: Any) -> Indices | None:
    """Return codes as whole numbers, None and NaN among them as -1."""
    if value is None or (type(value) is np.ndarray and value.dtype == np.int64):
        return value
    try:
        numbers = np.asarray(value)
        if numbers.dtype == object:
            numbers = np.array([-1 if one is None else one for one in numbers.ravel().tolist()]).reshape(numbers.shape)
        if numbers.dtype.kind == "f":
            numbers = np.where(np.isnan(numbers), -1.0, numbers)
        codes = numbers.astype(np.int64) if numbers.size else np.zeros(numbers.shape, dtype=np.int64)
        if numbers.dtype.kind in "iuf" and np.all(codes == numbers):
            return codes
    except (TypeError, ValueError, OverflowError):
        pass
    raise ValueError(f"identity: must be whole numbers, -1 where a return names no object, got {short(value)}") from None


def position(value: Any) -> Array:
    if value is None:
        raise ValueError("position: must be 2 or 3 numbers, got None")
    return _array("position", value, _FLOAT)


def velocity(value: Any) -> Array | None:
    return _array("velocity", value, _FLOAT)


def heading(value: Any) -> float | Array:
    if type(value) is float:
        return value
    if value is None:
        raise ValueError("heading: must be a number of rad, got None")
    angle = _array("heading", value, _FLOAT)
    return angle if angle.ndim else float(angle)


def pixels(value: Any) -> Any:
    """Return rows of numbers as an array; anything else as it is, for the tracker to refuse with its place."""
    if not isinstance(value, list | tuple):
        return value
    try:
        return np.asarray(value)
    except ValueError:
        return value


def corner(value: Any) -> Array | None:
    return _array("corner", value, _FLOAT)


def time(value: Any) -> float:
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"time: must be a number of s, got {short(value)}") from None
