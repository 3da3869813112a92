"""The record of a service: the scans that were taken, in order, which `vedette run` replays to the same tracks."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import BinaryIO, final

from attrs import define

from vedette.errors import InputError
from vedette.experiment import Experiment
from vedette.space import Space
from vedette.types import Recording, Scan
from vedette_files import recording_head, scan_line
from vedette_files.input_files import user_path


@final
@define(eq=False)
class Recorder:
    """Appends scans to a file; `offset` is where the next one goes."""

    path: Path
    spaces: Mapping[str, Space]
    file: BinaryIO

    @classmethod
    def append(cls, path: str, experiment: Experiment) -> Recorder:
        """Open a record, new or to go on with; InputError if the file is something else."""
        place = user_path(path)
        spaces = {name: sensor.measurement for name, sensor in experiment.tracker.sensors.items()}
        head = "".join(recording_head(Recording(()), spaces)).encode()
        try:
            number = os.open(place, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o644)
        except OSError as error:
            raise InputError(f"service.record: {place}: cannot be written: {error.strerror}") from None
        file = os.fdopen(number, "r+b")
        there = file.read(len(head))
        if there and there != head:
            file.close()
            raise InputError(f"service.record: {place}: is not a record of these sensors; name another file")
        if not there:
            file.write(head)
        file.seek(0, os.SEEK_END)
        return cls(place, spaces, file)

    @property
    def offset(self) -> int:
        """Bytes of the file."""
        return self.file.tell()

    def cut(self, offset: int) -> None:
        """Forget what was written after a place: it comes again."""
        end = self.file.seek(0, os.SEEK_END)
        self.file.truncate(min(offset, end))
        self.file.seek(0, os.SEEK_END)

    def write(self, scan: Scan) -> None:
        """Add a scan."""
        self.file.write(scan_line(scan, self.spaces).encode())

    def flush(self) -> None:
        """Let the system have what was written."""
        self.file.flush()

    def close(self) -> None:
        """Write what is left, and close."""
        self.file.close()
