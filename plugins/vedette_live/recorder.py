"""The record of a service: the scans that were taken, in order, which `vedette run` replays to the same tracks.

Each tells when it came. Lines between them tell of scans that were left out, as they came too late or too fast.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from contextlib import ExitStack
from io import BufferedRandom
from typing import final

from attrs import define

from vedette.errors import InputError
from vedette.experiment import Experiment
from vedette.space import Space
from vedette.types import Recording
from vedette.writing import growing, open_growing
from vedette_files import left_out_line, recording_head, scan_line
from vedette_files.input_files import user_path
from vedette_live.grouping import Formed
from vedette_live.window import Taken


@final
@define(eq=False)
class Recorder:
    """Appends scans to a file; `offset` is where the next one goes."""

    spaces: Mapping[str, Space]
    file: BufferedRandom
    held: ExitStack

    @classmethod
    def append(cls, path: str, experiment: Experiment) -> Recorder:
        """Open a record, new or to go on with; InputError if the file is something else."""
        place = user_path(path)
        spaces = {name: sensor.measurement for name, sensor in experiment.tracker.sensors.items()}
        detected = {name: spaces[name] for name in experiment.preprocessors}
        head = "".join(recording_head(Recording((), detected=detected), spaces)).encode()
        held = ExitStack()
        held.enter_context(growing(place, "service.record"))
        try:
            file = BufferedRandom(open_growing(place))
        except OSError as error:
            held.close()
            raise InputError(f"service.record: {place}: cannot be written: {error.strerror}") from None
        held.callback(file.close)
        there = file.read(len(head))
        if there and there != head:
            held.close()
            raise InputError(f"service.record: {place}: is not a record of these sensors; name another file")
        if not there:
            file.write(head)
        file.seek(0, os.SEEK_END)
        return cls(spaces, file, held)

    @property
    def offset(self) -> int:
        """Bytes of the file."""
        return self.file.tell()

    def cut(self, offset: int) -> None:
        """Forget what was written after a place: it comes again."""
        end = self.file.seek(0, os.SEEK_END)
        self.file.truncate(min(offset, end))
        self.file.seek(0, os.SEEK_END)

    def write(self, taken: Taken) -> None:
        """Add a scan."""
        arrived = max((one.arrived for one in taken.formed), default=None)
        self.file.write(scan_line(taken.scan, self.spaces, arrived=arrived).encode())

    def leave_out(self, formed: Formed, why: str) -> None:
        """Add what is known of a scan that was not taken."""
        scan = formed.scan
        self.file.write(left_out_line(scan.time, scan.sensor, len(scan.detections.z), formed.arrived, why).encode())

    def flush(self) -> None:
        """Let the system have what was written."""
        self.file.flush()

    def close(self) -> None:
        """Write what is left, and close."""
        self.held.close()
