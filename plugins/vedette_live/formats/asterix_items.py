"""Which items of ASTERIX become what a message tells: places, heights, velocities, Doppler speeds, times and names."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi
from typing import Any

import numpy as np

from vedette.space import Indices
from vedette.streams import Message
from vedette_files import code

DAY = 86400.0
TRUNCATED = 512.0
"""s after which the time of day of category 001 starts anew."""
GEOMETRIC, PRESSURE = "geometric", "pressure"
EITHER = "geometric or pressure"
_NONE = np.zeros((0, 0))

_TIMES: dict[int, tuple[str, ...]] = {
    1: ("141",),
    2: ("030",),
    10: ("140",),
    20: ("140",),
    21: ("071", "073", "077"),
    34: ("030",),
    48: ("140",),
    62: ("070",),
}
_PLACES: dict[int, tuple[tuple[str, str, str], ...]] = {
    1: (("040", "RHO", "THETA"), ("042", "X", "Y")),
    10: (("040", "RHO", "TH"), ("042", "X", "Y"), ("041", "LAT", "LON")),
    20: (("041", "LAT", "LON"), ("042", "X", "Y")),
    21: (("131", "LAT", "LON"), ("130", "LAT", "LON")),
    48: (("040", "RHO", "THETA"),),
    62: (("105", "LAT", "LON"), ("100", "X", "Y")),
}
_HEIGHTS: dict[int, dict[str, tuple[tuple[str, str], ...]]] = {
    1: {PRESSURE: (("090", "HGT"),)},
    10: {PRESSURE: (("090", "FL"),)},
    20: {GEOMETRIC: (("105", ""),), PRESSURE: (("090", "FL"),)},
    21: {GEOMETRIC: (("140", ""),), PRESSURE: (("145", ""),)},
    48: {GEOMETRIC: (("110", "3DH"),), PRESSURE: (("090", "FL"),)},
    62: {GEOMETRIC: (("130", ""),), PRESSURE: (("136", ""), ("135", "CTB"))},
}
"""The items of heights, and their part if they have some."""
FLAGGED = "090"
"""That which says of a height that it is not validated, V, or garbled, G."""
_VELOCITIES: dict[int, tuple[str, str, str]] = {
    10: ("202", "VX", "VY"),
    20: ("202", "VX", "VY"),
    21: ("160", "GS", "TA"),
    62: ("185", "VX", "VY"),
}
_ADDRESSES = {20: "220", 21: "080", 48: "220"}
DOPPLER = (48, "120")
_AXES = {
    "RHO": ("range", "azimuth"),
    "X": ("east", "north"),
    "LAT": ("latitude", "longitude"),
    "VX": ("east_speed", "north_speed"),
    "GS": ("speed", "course"),
}
_SI = {"NM": 1852.0, "m": 1.0, "s": 1.0, "m/s": 1.0, "NM/s": 1852.0, "ft": 0.3048, "FL": 30.48}


def meanings() -> Iterator[tuple[int, str, str]]:
    """Yield category, items and what they become, for a page."""
    for category, places in _PLACES.items():
        for number, part, _ in places:
            yield category, number, ", ".join(_AXES[part])
        for sort, items in _HEIGHTS[category].items():
            yield category, " or ".join(number for number, _ in items), f"altitude, {sort}"
        if category in _VELOCITIES:
            number, part, _ = _VELOCITIES[category]
            yield category, number, ", ".join(_AXES[part])
        if category == DOPPLER[0]:
            yield *DOPPLER, "range_rate, of its calculated speed"
        if category in _ADDRESSES:
            yield category, _ADDRESSES[category], "identity"


def message(category: int, record: Any, heights: str) -> Message:
    """Return what a record tells, of `heights` those that are geometric, by pressure, or either; ValueError if it cannot."""
    source = record.get_item("010")
    if source is None:
        raise ValueError("lacks item 010, who sends it")
    codes = (source.variation.get_item(name).as_uint() for name in ("SAC", "SIC"))
    sensor = "{}/{}".format(*codes)
    time, period = _time(category, record), TRUNCATED if category == 1 else DAY
    if category in (2, 34):
        kind = record.get_item("000")
        marker = {1: "north", 2: "sector"}.get(-1 if kind is None else kind.as_uint(), "")
        sector = record.get_item("020")
        angle = None if sector is None else sector.as_uint() * 2 * pi / 256
        return Message(sensor, time, _NONE, marker=marker or "other", angle=angle, period=period)
    told = dict(_measured(category, record, heights))
    return Message(
        sensor, time, np.array([list(told.values())]), tuple(told), identity=_address(category, record), period=period
    )


def _measured(category: int, record: Any, heights: str) -> Iterator[tuple[str, float]]:
    """Yield the axes of a target report: the place, then what else it tells."""
    found = next((place for place in _PLACES[category] if record.get_item(place[0]) is not None), None)
    if found is None:
        raise ValueError(f"lacks a position, item {' or '.join(name for name, *_ in _PLACES[category])}")
    yield from _pair(record, found)
    if (height := _height(category, record, heights)) is not None:
        yield "altitude", height
    if category in _VELOCITIES and record.get_item(_VELOCITIES[category][0]) is not None:
        yield from _pair(record, _VELOCITIES[category])
    if category == DOPPLER[0] and (doppler := _doppler(record)) is not None:
        yield "range_rate", doppler


def _pair(record: Any, item: tuple[str, str, str]) -> Iterator[tuple[str, float]]:
    """Yield the two quantities of an item, directions in rad."""
    number, *parts = item
    variation = record.get_item(number).variation
    for axis, part in zip(_AXES[parts[0]], parts, strict=True):
        value = _quantity(variation.get_item(part))
        yield axis, np.deg2rad(value) if axis in ("azimuth", "course") else value


def _height(category: int, record: Any, heights: str) -> float | None:
    """Return the height in m, a geometric one first; None where there is none that is wanted, validated and not garbled."""
    for sort, items in _HEIGHTS[category].items():
        for number, part in items if heights in (sort, EITHER) else ():
            item = record.get_item(number)
            if item is not None and not (number == FLAGGED and (_flag(item, "V") or _flag(item, "G"))):
                return _quantity(item.variation.get_item(part) if part else item)
    return None


def _flag(item: Any, name: str) -> bool:
    return bool(item.variation.get_item(name).as_uint())


def _doppler(record: Any) -> float | None:
    """Return the calculated Doppler speed in m/s, which is to be positive where the range grows, unless it is doubtful."""
    item = record.get_item(DOPPLER[1])
    speed = None if item is None else item.variation.get_item("CAL")
    return None if speed is None or _flag(speed, "D") else _quantity(speed.variation.get_item("CAL"))


def _address(category: int, record: Any) -> Indices | None:
    """Return the code of an aircraft's 24-bit address, written as six hexadecimal digits."""
    item = record.get_item(_ADDRESSES[category]) if category in _ADDRESSES else None
    return None if item is None else np.array([code(f"{item.as_uint():06x}")])


def _time(category: int, record: Any) -> float | None:
    for name in _TIMES[category]:
        item = record.get_item(name)
        if item is not None:
            return _quantity(item)
    return None


def _quantity(item: Any) -> float:
    """Return a quantity in SI units, angles in deg."""
    content = item.variation.content
    return float(content.as_quantity()) * _SI.get(type(content).cv_unit, 1.0)
