"""Recordings in Vedette's own format."""

from __future__ import annotations

from array import array
from collections.abc import Iterator, Mapping, Sequence
from typing import ClassVar, final

import numpy as np
from attrs import evolve, frozen

from vedette import ImagingSensor, InputError, Recording, Scan, Sensor, Source, Space, fields
from vedette_files.input_files import shown
from vedette_files.jsonl.recording import read_recording
from vedette_files.oddities import odd_returns, replaced
from vedette_files.packed import PackedScans
from vedette_files.readers import find


@final
@frozen
class JsonLinesSource(Source):
    """A recording in Vedette's JSON-lines format: a header, true states, scans of several sensors, empty ones too.

    Scans of sensors that the tracker lacks are left out and counted in the notes. Those that a preprocessor has made, as the
    header says of the recording of a run, are delivered as they are.
    """

    kind: ClassVar[str] = "jsonl"
    draws: ClassVar[bool] = False

    path: str = fields.text("the file", default="")
    about: str = fields.text("what the recording is and who published it, told to those who lack it", default="")
    sort: bool = fields.flag("sort all lines by time; default: those that go back in time are refused", default=False)

    def open(self, sensors: Mapping[str, Sensor], rng: np.random.Generator) -> Recording:
        """Return the scans in time order.

        InputError if the file is missing or empty, its header is invalid, its axes are not what the tracker's sensors
        measure, it lacks the frames of a camera, or no scan can be used.
        """
        path = find(self.path, f"{self.about or 'a recording'}. Format: Vedette's JSON lines")
        optional = {name: sensor.optional for name, sensor in sensors.items()}
        recording, spaces = read_recording(path, sort=self.sort, optional=optional)
        made, every = recording.detected, recording.scans
        assert isinstance(every, PackedScans)
        for name in spaces:
            if name in sensors and name not in made and set(spaces[name].axes) != set(sensors[name].measurement.axes):
                measured = sensors[name].measurement
                raise InputError(
                    f"{path}:1: sensor {shown(name)} gives {spaces[name]}, and the tracker's measures {measured}"
                )
        kept = every.of({*sensors, *made})
        if any(spaces[name] != sensors[name].measurement for name in spaces if name in sensors and name not in made):
            kept = PackedScans(
                scan if scan.sensor in made else _over(sensors[scan.sensor].measurement, scan, spaces[scan.sensor])
                for scan in kept
            )
        if not kept:
            first = f"; the first problem: {recording.refused[0]}" if recording.refused else ""
            names = ", ".join(shown(name) for name in spaces if name not in sensors) or ("" if spaces else "no sensor")
            others = f", but of {names}" if names else ""
            empty = "" if first or recording.scans else ": there is nothing below its header"
            raise InputError(f"{path}: holds no usable scan of {', '.join(map(repr, sensors))}{others}{first}{empty}")
        for name in spaces:
            imaging = isinstance(sensors.get(name), ImagingSensor) and name not in made
            if imaging and all(scan.frame is None for scan in kept.of({name})):
                there = f" ({recording.notes['frames']})" if "frames" in recording.notes else ""
                raise InputError(
                    f"{path}: holds none of the frames of {shown(name)}: those that a run reads from a video{there} stay "
                    "there; run the video again, with the config.json of that run"
                )
        notes = dict(recording.notes)
        for name in spaces:
            if name not in sensors and name not in made:
                count = len(every.of({name}))
                notes[f"scans of {shown(name)}, which the tracker lacks"] = str(count)
        lines, left_out = recording.rows["lines"], len(recording.scans) - len(kept)
        rows = {"lines": evolve(lines, used=lines.used - left_out, left_out=left_out)}
        odd = [
            said
            for name in spaces
            if name in sensors and name not in made
            for said in _odd(name, sensors[name], kept.of({name}))
        ]
        odd += replaced(sensors, kept)
        return evolve(recording, scans=kept, notes=notes, rows=rows, warnings=(*recording.warnings, *odd))


def _odd(name: str, sensor: Sensor, scans: Sequence[Scan]) -> Iterator[str]:
    """Yield in words what looks like no returns of the sensor."""
    z, counts, copies, named = array("d"), array("q"), array("q"), False
    for scan in scans:
        if scan.frame is None:
            seen = scan.detections
            named = named or (seen.identity is not None and bool(np.any(seen.identity >= 0)))
            z.frombytes(seen.z.tobytes())
            counts.append(len(seen.z))
            if counts[-1]:
                copies.append(hash((scan.time, seen.z.tobytes())))
    returns = np.array(z).reshape(-1, len(sensor.measurement))
    yield from odd_returns(name, sensor.measurement, returns, np.repeat(np.arange(len(counts)), counts), named=named)
    if again := len(copies) - len(np.unique(np.array(copies))):
        yield f"{name}: {again:,} of {len(copies):,} scans are copies of another: each counts as one more; delete the copies"


def _over(measured: Space, scan: Scan, written: Space) -> Scan:
    """Return the scan with its axes in the sensor's order."""
    if written == measured:
        return scan
    where = written.locate(measured)
    detections = scan.detections
    noise = None if detections.noise is None else detections.noise[:, where][:, :, where]
    missing = None if detections.missing is None else detections.missing[:, where]
    return evolve(scan, detections=evolve(detections, z=detections.z[:, where], noise=noise, missing=missing))
