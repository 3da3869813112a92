"""ASTERIX of EUROCONTROL: plots and antenna messages of radars, read; system tracks, read and written. By libasterix."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Any, ClassVar, final

from attrs import frozen

from vedette import fields
from vedette.streams import Decoded, Format, Message, TrackReport
from vedette_files.libraries import needed
from vedette_live.formats.asterix_items import DAY, EITHER, GEOMETRIC, PRESSURE, message

CATEGORIES = (1, 2, 10, 20, 21, 34, 48, 62)
TICKS = 128.0
"""Of the time of day in a second: rounded to these, it may be that of the next day."""
_HEAD = 3
"""Bytes of category and length before a block."""
FARTHEST, FASTEST = 2.0**22, 2.0**13
"""m and m/s below which a coordinate and a velocity are: beyond, they would be written with the other sign."""
HIGHEST, FOOT = 2.0**15 * 6.25, 0.3048
"""ft below which a height is, likewise; m."""
_TRACKS = 1500
"""Tracks of one block at most: its length has 16 bits."""


@final
@frozen
class Asterix(Format):
    """Target reports of categories 001, 010, 020, 021, 048, 062 as returns, north and sector messages of 002 and 034.

    The sensor is named by its codes, as "2/17". Polar reports give range and azimuth, clockwise from north, others x and y
    or latitude and longitude. Heights, velocities and calculated Doppler speeds are read where they are valid; a height by
    pressure and a geometric one differ by up to hundreds of m. Times are of the day. Blocks of other categories are passed
    over. Tracks are written as 062.
    EUROCONTROL-SPEC-0149, Specification for Surveillance Data Exchange ASTERIX.
    """

    kind: ClassVar[str] = "asterix"
    writes: ClassVar[bool] = True

    editions: dict[str, str] = fields.names('of categories, as { 48 = "1.30" }; default: the newest known')
    heights: str = fields.choice("which heights are read, geometric first", (EITHER, GEOMETRIC, PRESSURE), default=EITHER)
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
                yield message(category, record, self.heights)
            except Exception as error:  # whatever the bytes: the library's own mistakes must not end the service
                yield f"a record cannot be read: {error}"
                return

    def encode(self, report: TrackReport) -> bytes:
        cat = _category(62, self.editions.get("62", ""))
        where = {axis.name: k for k, axis in enumerate(report.space.axes)}
        latitudes = longitudes = heights = None
        if report.geodetic is not None:
            latitudes, longitudes, heights = report.geodetic(report.mean)
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
            if heights is not None and "z" in where and abs(height := float(heights[i]) / FOOT) < HIGHEST - TICKS:
                items["130"] = (height, "ft")
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
