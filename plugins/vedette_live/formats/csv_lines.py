"""Returns as lines of comma-separated values."""

from __future__ import annotations

import csv
from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import fields
from vedette.fields import ABSURD
from vedette.streams import Decoded, Format, Message
from vedette.units import in_unit
from vedette_files.input_files import shown
from vedette_live.formats.text import Rest, decoded, ended

SI = ("m", "rad", "s", "m/s", "deg")


@final
@frozen
class CsvLines(Format):
    """One return a line, its values in the order of `columns`: `12.5,north,310.0,0.52`.

    The columns `time` (s) and `sensor` are told by their names; every other one is an axis of the sensor, or latitude and
    longitude in deg. An empty cell is a missing component; a line whose axes are all empty is a look without a return. A
    header like `columns` is skipped.
    RFC 4180, Common Format and MIME Type for Comma-Separated Values (CSV) Files, 2005.
    """

    kind: ClassVar[str] = "csv_lines"

    columns: tuple[str, ...] = fields.words("names of the values of a line, in order")
    units: dict[str, str] = fields.names('of columns that are not in SI units, as { range = "NM" }')
    separator: str = fields.choice("between values", (",", ";", "\t"), default=",")

    def __attrs_post_init__(self) -> None:
        if len(set(self.columns)) != len(self.columns):
            raise ValueError(f"columns: must be names, each once, got {list(self.columns)}")
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

    def start(self) -> Rest:
        return Rest()

    def decode(self, memory: Rest, data: bytes) -> Decoded:
        return decoded(memory, data, self._read)

    def end(self, memory: Rest) -> Decoded:
        return ended(memory, self._read)

    def _read(self, line: bytes) -> Message | None:
        """Return a line's message; None for an empty one and for a header."""
        text = line.decode(errors="replace").strip("\r\n")
        if not text.strip() or [cell.strip() for cell in text.split(self.separator)] == list(self.columns):
            return None
        return self._message(text)

    def _message(self, text: str) -> Message:
        try:
            cells = next(csv.reader([text], delimiter=self.separator, strict=True), [])
        except csv.Error as error:
            raise ValueError(f"is no line of values: {error}") from None
        if len(cells) != len(self.columns):
            raise ValueError(f"must have {len(self.columns)} values, {', '.join(self.columns)}, got {len(cells)}")
        row = dict(zip(self.columns, (cell.strip() for cell in cells), strict=True))
        time = self._number(row, "time") if row.get("time") else None
        empty = not any(row[name] for name in self._axes)
        z = [] if empty else [[self._number(row, name) if row[name] else np.nan for name in self._axes]]
        return Message(row.get("sensor", ""), time, np.array(z).reshape(-1, len(self._axes)), self._axes)

    def _number(self, row: dict[str, str], name: str) -> float:
        try:
            value = float(row[name]) if "_" not in row[name] else np.nan
        except ValueError:
            value = np.nan
        if not abs(value) <= ABSURD:
            raise ValueError(f"{name} must be a finite number, got {shown(row[name])}")
        return value * (_factor(self.units[name]) or 1.0) if name in self.units else value


def _factor(unit: str) -> float | None:
    """Return how many SI units one `unit` is; None for none that is known."""
    for base in SI:
        try:
            return in_unit(f"1 {unit}", base)
        except ValueError:
            continue
    return None
