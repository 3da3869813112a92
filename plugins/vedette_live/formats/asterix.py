"""ASTERIX of EUROCONTROL: plots and antenna messages of radars, read; system tracks, read and written. By libasterix."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from math import pi
from typing import Any, ClassVar, final

import numpy as np
from attrs import frozen

from vedette import fields
from vedette.space import Indices
from vedette.streams import Decoded, Format, Message, TrackReport
from vedette_files import code
from vedette_files.libraries import needed

CATEGORIES = (1, 2, 10, 20, 21, 34, 48, 62)
DAY = 86400.0
TICKS = 128.0
"""Of the time of day in a second: rounded to these, it may be that of the next day."""
TRUNCATED = 512.0
"""s after which the time of day of category 001 starts anew."""
_NONE = np.zeros((0, 0))
_HEAD = 3
"""Bytes of category and length before a block."""
FARTHEST, FASTEST = 2.0**22, 2.0**13
"""m and m/s below which a coordinate and a velocity are: beyond, they would be written with the other sign."""
_TRACKS = 1500
"""Tracks of one block at most: its length has 16 bits."""

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
_ADDRESSES = {20: "220", 21: "080", 48: "220"}
_AXES = {
    "RHO": ("range", "azimuth"),
    "X": ("east", "north"),
    "LAT": ("latitude", "longitude"),
}
_SI = {"NM": 1852.0, "m": 1.0, "s": 1.0, "m/s": 1.0}


@final
@frozen
class Asterix(Format):
    """Target reports of categories 001, 010, 020, 021, 048, 062 as returns, north and sector messages of 002 and 034.

    The sensor is named by its codes, as "2/17". Polar reports give range and azimuth, clockwise from north, others x and y
    or latitude and longitude. Times are of the day. Blocks of other categories are passed over. Tracks are written as 062.
    EUROCONTROL-SPEC-0149, Specification for Surveillance Data Exchange ASTERIX.
    """

    kind: ClassVar[str] = "asterix"
    writes: ClassVar[bool] = True

    editions: dict[str, str] = fields.names('of categories, as { 48 = "1.30" }; default: the newest known')
    sac: int = fields.integer("system area code in tracks that are written", default=0, at_most=255)
    sic: int = fields.integer("system identification code in tracks that are written", default=0, at_most=255)

    def __attrs_post_init__(self) -> None:
        for category in self.editions:
            if not category.isdecimal() or int(category) not in CATEGORIES:
                known = ", ".join(map(str, CATEGORIES))
                raise ValueError(f"editions: must be of categories {known}, got {category!r}")

    def sample(self) -> bytes:
        """Return a north message, a plot and a sector message of a radar 2/17."""
        return bytes.fromhex("22000ae002110107080030000dd002110708400a002000220008d002110240")

    def decode(self, memory: bytes, data: bytes) -> Decoded:
        data, at = memory + data, 0
        messages, refused = list[Message](), list[str]()
        while len(data) - at >= _HEAD:
            category, length = data[at], int.from_bytes(data[at + 1 : at + _HEAD])
            if length < _HEAD:
                refused.append(f"a block of category {category:03d} states a length of {length}, less than its head")
                return Decoded(b"", messages, refused)
            if len(data) - at < length:
                break
            if category in CATEGORIES:
                for record in self._records(category, data[at + _HEAD : at + length]):
                    if isinstance(record, str):
                        refused.append(f"category {category:03d}: {record}")
                    else:
                        messages.append(record)
            at += length
        return Decoded(data[at:], messages, refused)

    def _records(self, category: int, data: bytes) -> Iterator[Message | str]:
        """Yield the messages of a block, or why one is refused: what follows a record that cannot be read is lost."""
        base, uap = _base(), _category(category, self.editions.get(str(category), "")).cv_uap
        bits = base.Bits.from_bytes(data)
        while len(bits):
            try:
                record, bits = _record(base, uap, bits)
                yield _message(category, record)
            except Exception as error:  # whatever the bytes: the library's own mistakes must not end the service
                yield f"a record cannot be read: {error}"
                return

    def encode(self, report: TrackReport) -> bytes:
        cat = _category(62, self.editions.get("62", ""))
        where = {axis.name: k for k, axis in enumerate(report.space.axes)}
        latitudes = longitudes = None
        if report.geodetic is not None:
            latitudes, longitudes, _ = report.geodetic(report.mean)
        records = []
        for i, mean in enumerate(report.mean.tolist()):
            items: dict[str, Any] = {
                "010": (("SAC", self.sac), ("SIC", self.sic)),
                "040": int(report.ids[i]) % 65536,
                "070": (round(report.time % DAY * TICKS) / TICKS % DAY, "s"),
                "080": ((("MON", 0), ("SPI", 0), ("MRH", 0), ("SRC", 0), ("CNF", int(not report.confirmed[i])), None),),
            }
            east, north = (mean[where[name]] for name in report.ground)
            if max(abs(east), abs(north)) < FARTHEST:
                items["100"] = (("X", (east, "m")), ("Y", (north, "m")))
            elif latitudes is None:
                continue
            if latitudes is not None and longitudes is not None:
                items["105"] = (("LAT", (float(latitudes[i]), "°")), ("LON", (float(longitudes[i]), "°")))
            velocity = [mean[where[f"v{name}"]] for name in report.ground if f"v{name}" in where]
            if len(velocity) == 2 and max(map(abs, velocity)) < FASTEST:
                items["185"] = (("VX", (velocity[0], "m/s")), ("VY", (velocity[1], "m/s")))
            records.append(cat.cv_record.create(items))
        blocks = [records[i : i + _TRACKS] for i in range(0, len(records), _TRACKS)]
        return b"".join(cat.create(block).unparse().to_bytes() for block in blocks)


@cache
def _base() -> Any:
    return needed("asterix.base", "ASTERIX needs libasterix", "live")


@cache
def _category(category: int, edition: str) -> Any:
    """Return a category in an edition, the newest by default; ValueError with those that are known."""
    known = needed("asterix.generated", "ASTERIX needs libasterix", "live").manifest["CATS"][category]
    by_name = {"{}.{}".format(*edition_known.cv_edition): edition_known for edition_known in known}
    if edition and edition not in by_name:
        raise ValueError(f"editions: of category {category} must be one of {', '.join(by_name)}, got {edition!r}")
    return by_name[edition] if edition else max(known, key=lambda edition_known: tuple(edition_known.cv_edition))


def _record(base: Any, uap: Any, bits: Any) -> tuple[Any, Any]:
    """Return the first record and the rest; category 001 has one layout for plots and one for tracks."""
    kinds = list(uap.cv_uaps.values()) if hasattr(uap, "cv_uaps") else [uap.cv_record]
    record: Any = None
    for i, kind in enumerate(kinds):
        record = kind._parse(base.ParsingMode.StrictParsing, bits)
        if not isinstance(record, ValueError) and (len(kinds) == 1 or _is_track(record[0]) == bool(i)):
            return record[0], record[1]
    raise ValueError(str(record) if isinstance(record, ValueError) else "is neither a plot nor a track")


def _is_track(record: Any) -> bool:
    item = record.get_item("020")
    return item is not None and bool(item.variation.get_item("TYP").as_uint())


def _message(category: int, record: Any) -> Message:
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
    for name, first, second in _PLACES[category]:
        item = record.get_item(name)
        if item is not None:
            values = [_quantity(item.variation.get_item(part)) for part in (first, second)]
            if first == "RHO":
                values[1] = np.deg2rad(values[1])
            return Message(
                sensor, time, np.array([values]), _AXES[first], identity=_address(category, record), period=period
            )
    raise ValueError(f"lacks a position, item {' or '.join(name for name, *_ in _PLACES[category])}")


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
