"""Returns as lines of comma-separated values."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import ClassVar, final

import numpy as np
from attrs import evolve, field, frozen

from vedette import fields
from vedette.streams import Decoded, Format, Message
from vedette.units import in_unit
from vedette_files.input_files import shown
from vedette_files.tables.numbers import LARGEST, LEAST, Number, Row
from vedette_files.tables.rows import BETWEEN, UNCLOSED, Dialect
from vedette_files.tables.times import DAY, EXAMPLES, NUMBER, OF_DAY, ZONED, check_pattern, stamp
from vedette_live.formats.text import Rest, decoded

SI = ("m", "rad", "s", "m/s", "deg")


@frozen
class _Memory:
    """The rest of a line, and whether a line has come that is no comment: the first one may be a header.

    Lines of numbers are read alike before and after, so the latter is no part of what they need.
    """

    rest: Rest = Rest()
    begun: bool = field(default=False, eq=False)


@final
@frozen
class CsvLines(Format):
    """One return a line, its values in the order of `columns`: `12.5,north,310.0,0.52`.

    The columns `time` (in s, or a date or a time of day, as a `csv` source reads them) and `sensor` are told by their names;
    every other one is an axis of the sensor, or latitude and longitude in deg. An empty cell is a missing component; a line
    whose axes are all empty is a look without a return. A first line of as many words is a header, and is passed over, as
    are comments above it, after #.
    RFC 4180, Common Format and MIME Type for Comma-Separated Values (CSV) Files, 2005.
    """

    kind: ClassVar[str] = "csv_lines"

    columns: tuple[str, ...] = fields.words("names of the values of a line, in order")
    units: dict[str, str] = fields.names('of columns that are not in SI units, as { range = "NM" }')
    separator: str = fields.choice("between values; one blank stands for any", BETWEEN, default=",")
    decimal: str = fields.choice("in numbers", (".", ","), default=".")
    dates: str = fields.text("how dates are written, as '%d/%m/%Y %H:%M:%S'; default: by ISO 8601", default="")

    def __attrs_post_init__(self) -> None:
        if len(set(self.columns)) != len(self.columns):
            raise ValueError(f"columns: must be names, each once, got {list(self.columns)}")
        if self.decimal == self.separator:
            raise ValueError("decimal: must not be the separator: name what else stands between values")
        if self.dates:
            check_pattern(self.dates)
        if not self._axes:
            raise ValueError("columns: must name at least one axis beside time and sensor")
        for name, unit in self.units.items():
            if name not in self.columns:
                raise ValueError(f"units: {name!r} is no column; the columns are {', '.join(self.columns)}")
            if _factor(unit) is None:
                raise ValueError(f"units: {name}: unknown unit {unit!r}")

    @property
    def _axes(self) -> tuple[str, ...]:
        return tuple(name for name in self.columns if name not in ("time", "sensor"))

    def sample(self) -> bytes:
        row = self.separator.join({"sensor": "north"}.get(name, f"{i}.5") for i, name in enumerate(self.columns))
        return f"{row}\n{row}\n".encode()

    def start(self) -> _Memory:
        return _Memory()

    def decode(self, memory: _Memory, data: bytes) -> Decoded:
        begun = memory.begun

        def read(line: bytes) -> Message | None:
            nonlocal begun
            text = line.decode(errors="replace").strip("\ufeff\r\n")
            if not text.strip() or (not begun and text.lstrip().startswith("#")):
                return None
            first, begun = not begun, True
            return self._message(text, first=first)

        found = decoded(memory.rest, data, read)
        return evolve(found, memory=_Memory(found.memory, begun))

    def end(self, memory: _Memory) -> Decoded:
        left = self.decode(memory, b"\n") if memory.rest.data else Decoded(memory)
        return evolve(left, memory=self.start())

    def _message(self, text: str, *, first: bool) -> Message | None:
        """Return a line's message; None for a header, which may be the `first` line."""
        cells = Dialect(self.separator, self.decimal).cells(text)
        if cells is None:
            raise ValueError(f"is no line of values: it has {UNCLOSED}")
        if len(cells) != len(self.columns):
            raise ValueError(f"must have {len(self.columns)} values, {', '.join(self.columns)}, got {len(cells)}")
        if cells == list(self.columns) or (first and all(map(_is_word, cells))):
            return None
        row = dict(zip(self.columns, cells, strict=True))
        time, period = self._time(row) if row.get("time") else (None, None)
        empty = not any(row[name] for name in self._axes)
        z = [] if empty else [[self._number(row, name) if row[name] else np.nan for name in self._axes]]
        values = np.array(z).reshape(-1, len(self._axes))
        return Message(row.get("sensor", ""), time, values, self._axes, period=period)

    def _time(self, row: dict[str, str]) -> tuple[float, float | None]:
        """Return a line's time in s, and after how many s it begins anew if it is one of the day."""
        try:
            form, seconds = stamp(row["time"], self.dates)
        except (ValueError, OverflowError):
            told = f"must be {f'as {self.dates}' if self.dates else f'a number, or a date and time {EXAMPLES[ZONED]}'}"
            raise ValueError(f"time {told}, got {shown(row['time'])}; `dates` says how dates are written") from None
        return self._number(row, "time") if form == NUMBER else seconds, DAY if form == OF_DAY else None

    def _number(self, row: dict[str, str], name: str) -> float:
        factor = (_factor(self.units[name]) or 1.0) if name in self.units else 1.0
        return Number(name, name, factor, LARGEST.get(name), LEAST.get(name, -math.inf)).of(Row("", row))


def _is_word(cell: str) -> bool:
    """Return whether a cell may be a title."""
    return cell[:1].isalpha() and cell.lower() not in ("nan", "inf", "infinity")


@lru_cache(1024)
def _factor(unit: str) -> float | None:
    """Return how many SI units one `unit` is; None for none that is known."""
    for base in SI:
        try:
            return in_unit(f"1 {unit}", base)
        except ValueError:
            continue
    return None
