"""A stream that was recorded as it came: radar plots, reports, lines."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import ClassVar, final

import numpy as np
from attrs import Factory, frozen

from vedette import fields
from vedette.errors import ConfigError, InputError, Problem
from vedette.roles import Sensor
from vedette.streams import Format
from vedette.supporting import Source
from vedette.types import Recording, Rows, Scan
from vedette_files import FRAMES, Origin, replaced
from vedette_files.input_files import check_regular
from vedette_files.readers import find
from vedette_live.grouping import Grouper, Grouping
from vedette_live.placing import Placing, named, placed
from vedette_live.stations import Site, misplaced

PIECE = 2**16
"""Bytes that are read at once."""
NAMED = 1000
"""Refused messages that are named; all are counted."""


@final
@frozen
class StreamSource(Source):
    """The messages of a file in one of the formats that `vedette serve` reads, grouped into scans as it groups them.

    Times are those in the messages. A time of the day counts from midnight of the first one, and goes on over the next.
    """

    kind: ClassVar[str] = "stream"
    draws: ClassVar[bool] = False

    format: Format = fields.part("how messages stand in the file")
    path: str = fields.text("the file", default="")
    scans: Grouping = fields.part("how messages become scans", default=Grouping())
    sensors: dict[str, str] = fields.names('in the stream to those of the tracker, as { "2/17" = "north" }')
    sensor: str = fields.text("the tracker's sensor of messages that name none", default="")
    origin: Origin | None = fields.part("where x and y are 0", default=None)
    frame: str = fields.choice("where x and y point", FRAMES, default=FRAMES[0])
    sites: Mapping[str, Site] = fields.part("sensor to its latitude, longitude and altitude", default=Factory(dict))

    def open(self, sensors: Mapping[str, Sensor], rng: np.random.Generator) -> Recording:
        """Return the scans in time order; InputError if the file is missing or holds none for the tracker's sensors."""
        if problems := misplaced(self.sites, sensors, self.origin):
            raise ConfigError(problems)
        path = find(self.path, f"a recorded stream. Format: {self.format.kind}")
        check_regular(path)
        placing = Placing(sensors, named(self.sensors, self.sensor), self.origin, self.frame, self.sites)
        grouper, memory = Grouper(self.scans, placing), self.format.start()
        scans, refused, count, bad = list[Scan](), list[Problem](), 0, 0
        try:
            for data in (*_pieces(path), None):
                decoded = self.format.end(memory) if data is None else self.format.decode(memory, data)
                memory = decoded.memory
                told = list(decoded.refused)
                for message in decoded.messages:
                    try:
                        scans += [formed.scan for formed in grouper.add(message, None)]
                    except ValueError as error:
                        told.append(str(error))
                count += len(decoded.messages) + len(decoded.refused)
                bad += len(told)
                refused += [Problem(f"{path.name}, up to message {count}", text) for text in told[: NAMED - len(refused)]]
        except OSError as error:
            raise InputError(f"{path}: cannot be read: {error.strerror}") from None
        scans += [formed.scan for formed in grouper.due()]
        if not scans:
            first = f"; the first problem: {refused[0].text}" if refused else ""
            raise InputError(f"{path}: holds no scan of {', '.join(map(repr, sensors))}{first}")
        scans.sort(key=lambda scan: (scan.time, scan.sensor))
        rows = {"messages": Rows(count, count - bad, bad)}
        notes = placed(self.origin, self.frame)
        odd = (*placing.doubts(), *replaced(sensors, scans))
        return Recording(tuple(scans), refused=tuple(refused), notes=notes, warnings=odd, rows=rows)


def _pieces(path: Path) -> Iterator[bytes]:
    with path.open("rb") as file:
        while data := file.read(PIECE):
            yield data
