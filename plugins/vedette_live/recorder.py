"""The record of a service: the scans that were taken, in order, which `vedette run` replays to the same tracks.

Each tells when it came. Lines between them tell of scans that were left out, as they came too late or too fast.
"""

from __future__ import annotations

import json
import os
from collections import deque
from collections.abc import Mapping
from contextlib import ExitStack, suppress
from io import FileIO
from itertools import chain, count
from pathlib import Path
from typing import final

from attrs import define, field

from vedette.errors import InputError
from vedette.experiment import Experiment
from vedette.space import Space
from vedette.types import Recording
from vedette_files import Terms, left_out_line, recording_head, scan_line
from vedette_files.input_files import user_path
from vedette_files.writing import growing, is_at, open_growing, unused
from vedette_live.grouping import Formed
from vedette_live.log import LOG
from vedette_live.window import Taken

MOST = 10_000
"""Lines that wait for a file that cannot be written, as on a full disk; then the oldest are dropped."""
PIECE = 2**20
"""Bytes that are read at once."""


@final
@define(eq=False)
class Recorder:
    """Appends scans to a file, whole lines or nothing; `end` is where the next one goes.

    A file that was moved away or emptied, as logs are, is begun anew.
    """

    path: Path
    head: bytes
    spaces: Mapping[str, Space]
    file: FileIO
    held: ExitStack
    end: int
    waiting: deque[bytes] = field(factory=lambda: deque[bytes](maxlen=MOST))
    dropped: int = 0

    @classmethod
    def append(cls, path: str, experiment: Experiment, notes: Mapping[str, str]) -> Recorder:
        """Open a record, new or to go on with, whose head holds `notes`; beside a file that is something else, and told."""
        place = user_path(path)
        spaces = {name: sensor.measurement for name, sensor in experiment.tracker.sensors.items()}
        detected = {name: spaces[name] for name in experiment.preprocessors}
        head = "".join(recording_head(Recording((), notes=notes, detected=detected), spaces)).encode()
        beside = (place.with_stem(f"{place.stem}-{number}") for number in count(2))
        opened = next(one for each in chain([place], beside) if (one := cls._opened(each, head, spaces)) is not None)
        if opened.path != place:
            why = f"{place.name} is no record of these sensors and notes, and stays as it is: {opened.path.name} is written"
            LOG.error("record", extra={"why": why})
        return opened

    @classmethod
    def _opened(cls, place: Path, head: bytes, spaces: Mapping[str, Space]) -> Recorder | None:
        """Open a file; None if it is something else, InputError if it cannot be written."""
        held = ExitStack()
        held.enter_context(growing(place, "service.record"))
        try:
            file = open_growing(place)
            held.callback(file.close)
            there, end = file.read(len(head)), _end_of_lines(file)
        except OSError as error:
            held.close()
            raise InputError(f"service.record: {place}: cannot be written: {error.strerror}") from None
        if not _begins(there, head):
            held.close()
            return None
        file.truncate(end)
        return cls(place, head, spaces, file, held, end)

    def cut(self, offset: int) -> None:
        """Forget what was written after a place: it comes again."""
        self.end = min(offset, self.end)
        self.file.truncate(self.end)

    def write(self, taken: Taken) -> None:
        """Add a scan."""
        arrived = max((one.arrived for one in taken.formed), default=None)
        self._add(scan_line(taken.scan, self.spaces, arrived=arrived))

    def leave_out(self, formed: Formed, why: str) -> None:
        """Add what is known of a scan that was not taken."""
        scan = formed.scan
        known = (scan.time, scan.sensor, len(scan.detections.z), formed.arrived, why)
        self._add(left_out_line(*known))

    def _add(self, line: str) -> None:
        self.dropped += len(self.waiting) == self.waiting.maxlen
        self.waiting.append(line.encode())

    @property
    def moved(self) -> bool:
        """Whether the file was moved away or cut, so that `flush` begins it anew."""
        return not is_at(self.path, self.file) or self._size < self.end

    @property
    def _size(self) -> int:
        return os.fstat(self.file.fileno()).st_size

    def flush(self) -> None:
        """Write what waits; OSError, and all of it still waits, if it cannot be written."""
        if self.moved:
            self._begin_anew()
        data = b"".join((b"" if self.end else self.head, *self.waiting))
        try:
            at = 0
            while at < len(data):
                at += self.file.write(data[at:])
        except OSError:
            self.file.truncate(min(self.end, self._size))
            raise
        self.end += len(data)
        self.waiting.clear()

    def set_aside(self) -> Path:
        """Give the file another name, and return that; `flush` then begins it anew."""
        aside = unused(self.path.with_name(f"{self.path.name}.before"))
        if is_at(self.path, self.file):
            self.path.rename(aside)
        return aside

    def _begin_anew(self) -> None:
        file = open_growing(self.path)
        if file.seek(0, os.SEEK_END):
            file.close()
            raise OSError(f"{self.path} was cut, or is another file by now: move it away")
        self.held.callback(file.close)
        self.file.close()
        self.file, self.end = file, 0
        LOG.warning("the record was moved away or emptied, and is begun anew", extra={"path": str(self.path)})

    def close(self) -> None:
        """Close the file, and let others have it."""
        self.held.close()


def _begins(there: bytes, head: bytes) -> bool:
    """Return whether a file begins, as far as it goes, as a record with a head does; one of the same x and y may go on."""
    if head.startswith(there):
        return True
    with suppress(ValueError):
        begun, own = json.loads(there.partition(b"\n")[0]), json.loads(head)
        if isinstance(begun, dict) and begun == {**own, "notes": begun.get("notes")}:
            return Terms.of(begun["notes"]).stay(Terms.of(own["notes"]))
    return False


def _end_of_lines(file: FileIO) -> int:
    """Return where the last whole line ends: a service that was killed may have left a part of the next one."""
    end = file.seek(0, os.SEEK_END)
    while end:
        start = file.seek(max(0, end - PIECE))
        if line_end := file.read(end - start).rfind(b"\n") + 1:
            return start + line_end
        end = start
    return 0
