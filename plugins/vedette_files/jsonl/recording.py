"""Vedette's own format for recordings: JSON lines, a header first. docs/formats.md describes it."""

from __future__ import annotations

import json
from array import array
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from attrs import define, field, frozen

from vedette import InputError, Problem, Recording, Rows, Scan, Space, SpaceError, Trajectory
from vedette_files.input_files import lines
from vedette_files.json_values import number, parse, short, vector
from vedette_files.jsonl.frames import FrameFiles
from vedette_files.jsonl.scans import check_fields, one_of, scan_fields, scan_of
from vedette_files.oddities import set_back
from vedette_files.packed import PackedScans
from vedette_files.readers import Sample, in_time_order, offer_sorting
from vedette_files.writing import whole_file

FORMAT = "vedette"
VERSION = 1
HEADER_FIELDS = ("format", "version", "sensors", "detected", "truth", "nobody", "notes")
LEFT_OUT_FIELDS = ("left_out", "time", "sensor", "returns", "arrived")
STATE_FIELDS = ("truth", "time", "state")
_ENCODER = json.JSONEncoder(allow_nan=False)


@frozen
class Header:
    """The first line of a recording: the axes of each sensor and each true object, and notes.

    `detected` are the sensors whose scans come from a preprocessor; `nobody`: the truth is known to hold no object.
    """

    sensors: dict[str, Space]
    truth: dict[str, Space]
    notes: dict[str, str]
    detected: tuple[str, ...] = ()
    nobody: bool = False


@define
class _Lines:
    """What lines give of a sensor or an object: times in s, numbers of the lines (l,), places of scans or states (l n,)."""

    times: Any = field(factory=lambda: array("d"))
    numbers: Any = field(factory=lambda: array("q"))
    values: Any = field(factory=lambda: array("d"))

    def add(self, number: int, time: float, values: Sequence[float]) -> None:
        """Take what the next line gives."""
        self.times.append(time)
        self.numbers.append(number)
        self.values.extend(values)

    def put_in_order(self, file: str, name: str, refused: list[Problem], *, sort: bool) -> tuple[str, ...]:
        """Put all in the order of time, as `in_time_order` does; return what is odd about how they stood."""
        times = np.array(self.times)
        if np.all(times[1:] >= times[:-1]):
            return ()
        given = zip(self.numbers, self.times, strict=True)
        samples = [Sample(f"{file}:{number}", time, i) for i, (number, time) in enumerate(given)]
        odd = tuple(set_back(name, samples)) if sort else ()
        kept = [sample.value for sample in in_time_order(samples, refused, sort=sort)]
        self.values = np.array(self.values).reshape(len(times), -1)[kept].ravel()
        self.times, self.numbers = times[kept], np.array(self.numbers)[kept]
        return odd


def write_recording(path: Path | str, recording: Recording, sensors: Mapping[str, Space]) -> None:
    """Write a recording, whose scans are over the measurement spaces `sensors` by name; equal ones give equal bytes.

    The frames of cameras are written beside it, unless they are read lazily from a file that holds them already.
    Floats are written so that they read back to the last bit. What was refused is not written. ValueError, and no file,
    for numbers that are not finite, batches of runs, true objects of one name, sensors that are not in `sensors`.
    """
    path = Path(path)
    head, frames = recording_head(recording, sensors), FrameFiles.of(path, recording)
    with whole_file(path) as file:
        file.writelines(head)
        file.writelines(scan_line(scan, sensors, frames) for scan in recording.scans)


def recording_head(recording: Recording, sensors: Mapping[str, Space]) -> Iterator[str]:
    """Return the lines that come before the scans: the header, and the truth."""
    truth = {true.name: units(true.space) for true in recording.truth}
    if len(truth) != len(recording.truth):
        raise ValueError("two true objects share a name, so the format cannot tell them apart")
    header = {
        "format": FORMAT,
        "version": VERSION,
        "sensors": {name: units(space) for name, space in sensors.items()},
        **({"detected": list(recording.detected)} if recording.detected else {}),
        "truth": truth,
        **({"nobody": True} if recording.nobody else {}),
        "notes": dict(recording.notes),
    }
    yield line(header)
    for true in recording.truth:
        for time, state in zip(true.times.tolist(), true.states.tolist(), strict=True):
            yield line({"truth": true.name, "time": time, "state": state})


def scan_line(
    scan: Scan, sensors: Mapping[str, Space], frames: FrameFiles | None = None, *, arrived: float | None = None
) -> str:
    """Return the line of one scan, which came at `arrived`; its frame, if it has one, goes to `frames`."""
    fields = scan_fields(scan, sensors)
    if scan.frame is not None and frames is not None:
        fields["frame"] = frames.keep(scan.frame)
    if arrived is not None:
        fields["arrived"] = arrived
    return line(fields)


def left_out_line(time: float, sensor: str, returns: int, arrived: float, why: str) -> str:
    """Return the line of a scan that a live run did not take."""
    known = (time, sensor, returns, arrived)
    return line({"left_out": why, **dict(zip(LEFT_OUT_FIELDS[1:], known, strict=True))})


def read_recording(
    path: Path | str, *, sort: bool = False, optional: Mapping[str, Collection[str]] = MappingProxyType({})
) -> tuple[Recording, dict[str, Space]]:
    """Return a recording and the measurement space of each of its sensors; with `sort`, lines may stand in any order.

    optional: by sensor, the axes that its returns may lack, null in `z`; of one that it does not name, any.

    Bad lines, a truncated last one among them, are in `refused`; the rest is read. InputError if
    the file is missing, empty, or its header is not one of this format and version.
    """
    refused: list[Problem] = []
    path = Path(path)
    given = lines(path)
    _, head = next(given)
    try:
        header = _header(parse(head))
    except ValueError as error:
        raise InputError(f"{path}:1: {error}") from None
    packed = PackedScans()
    scans, states = ({name: _Lines() for name in names} for names in (header.sensors, header.truth))
    total = 0
    for i, text in given:
        if not text.strip():
            continue
        total += 1
        place = f"{path.name}:{i}"
        try:
            entry = parse(text)
            if isinstance(entry, dict) and "truth" in entry:
                name, time, state = _state(entry, header.truth)
                states[name].add(i, time, state)
            elif isinstance(entry, dict) and "left_out" in entry:
                raise ValueError(_left_out(entry))
            else:
                scan, problems = scan_of(entry, header.sensors, path.parent, optional)
                refused += [Problem(place, text, int(scan is None and i == 0)) for i, text in enumerate(problems)]
                if scan is not None:
                    scans[scan.sensor].add(i, scan.time, [len(packed)])
                    packed.add(scan)
        except ValueError as error:
            refused.append(Problem(place, str(error)))
    odd = tuple(said for name, seen in scans.items() for said in seen.put_in_order(path.name, name, refused, sort=sort))
    for name, seen in states.items():
        seen.put_in_order(path.name, name, refused, sort=sort)
    kept = np.concatenate([np.zeros((3, 0)), *([seen.times, seen.numbers, seen.values] for seen in scans.values())], axis=1)
    in_time = packed.ordered(kept[2, np.lexsort((kept[1], kept[0]))].astype(np.intp))
    truth = tuple(
        Trajectory(name, header.truth[name], np.array(seen.times), np.array(seen.values).reshape(len(seen.times), -1))
        for name, seen in states.items()
        if len(seen.times)
    )
    used = len(in_time) + sum(len(true.times) for true in truth)
    rows = {"lines": Rows(total, used, sum(problem.rows for problem in refused))}
    told = tuple(offer_sorting(refused, total))
    detected = {name: header.sensors[name] for name in header.detected}
    recording = Recording(in_time, truth, told, header.notes, odd, rows, detected, nobody=header.nobody)
    return recording, header.sensors


def units(space: Space) -> dict[str, str]:
    """Axis names to units, as `Space.of` takes them; ValueError for a period that is not 2 pi."""
    for axis in space.axes:
        if axis.period not in (None, 2 * np.pi):
            raise ValueError(f"axis {axis} cannot be written: the only period of the format is 2pi")
    return {axis.name: axis.unit + (" mod 2pi" if axis.period else "") for axis in space.axes}


def line(fields: Mapping[str, Any]) -> str:
    """Return one line of JSON; ValueError if a number is not finite."""
    return _ENCODER.encode(fields) + "\n"


def _header(given: Any) -> Header:
    if not isinstance(given, dict) or given.get("format") != FORMAT:
        raise ValueError(f'the first line must be a header {{"format": "{FORMAT}", "version": ...}}, got {short(given)}')
    if given.get("version") != VERSION:
        raise ValueError(f"this Vedette reads version {VERSION} of the format, the file is of {short(given.get('version'))}")
    check_fields(given, HEADER_FIELDS)
    if "sensors" not in given:
        raise ValueError('the header must name the sensors: "sensors": {"radar": {"range": "m", "bearing": "rad mod 2pi"}}')
    notes = given.get("notes", {})
    if not isinstance(notes, dict) or not all(isinstance(note, str) for note in notes.values()):
        raise ValueError(f"notes must be names to strings, got {short(notes)}")
    sensors, detected = _spaces(given["sensors"], "sensors"), given.get("detected", [])
    if not isinstance(detected, list) or not all(isinstance(name, str) and name in sensors for name in detected):
        raise ValueError(f"detected must be names of the header's sensors, got {short(detected)}")
    truth, nobody = _spaces(given.get("truth", {}), "truth"), given.get("nobody", False)
    if not isinstance(nobody, bool) or (nobody and truth):
        raise ValueError(f"nobody must be true or false, and false with a truth, got {short(nobody)}")
    return Header(sensors, truth, notes, tuple(detected), nobody)


def _spaces(given: Any, what: str) -> dict[str, Space]:
    if not isinstance(given, dict):
        raise ValueError(f"{what} must be names to axes, got {short(given)}")
    return {name: space_of(axes, f"{what}.{name}") for name, axes in given.items()}


def space_of(axes: Any, what: str) -> Space:
    """Return the space of a header's axes; ValueError says that `what` must be axis names to units."""
    if not isinstance(axes, dict) or not axes or not all(isinstance(unit, str) for unit in axes.values()):
        raise ValueError(f"{what} must be axis names to units, got {short(axes)}")
    try:
        return Space.of(**axes)
    except (SpaceError, TypeError) as error:  # TypeError: an axis named as the parameter of `of` that holds the class
        raise ValueError(f"{what}: {error}") from None


def _state(given: Mapping[str, Any], truth: Mapping[str, Space]) -> tuple[str, float, list[float]]:
    check_fields(given, STATE_FIELDS)
    name = given["truth"]
    if not isinstance(name, str) or name not in truth:
        raise ValueError(f"truth must be {one_of(truth)}, got {short(name)}")
    return name, number(given.get("time"), "time"), vector(given.get("state"), "state", len(truth[name]))


def _left_out(given: Mapping[str, Any]) -> str:
    """Return what a line tells of a scan that the live run did not take."""
    check_fields(given, LEFT_OUT_FIELDS)
    told = f"a scan of {short(given.get('sensor'))} at {short(given.get('time'))} s"
    return f"the live run left out {told}, with {short(given.get('returns'))} returns: {short(given['left_out'])}"
