"""From raw scans to those that a tracker takes, by the preprocessors of an experiment."""

from __future__ import annotations

from collections import deque
from collections.abc import Container, Iterable, Iterator, Mapping
from copy import deepcopy
from itertools import groupby

import numpy as np
from attrs import evolve

from vedette.errors import ConfigError, Problem, ScanRefused
from vedette.roles import Sensor
from vedette.supporting import ImagingSensor, Preprocessor, Source
from vedette.tracking.faults import check_made, explain
from vedette.tracking.intake import Refused
from vedette.tracking.validation import flaws, with_axes, without_bad_returns
from vedette.types import Detections, Recording, Scan


def check_preprocessors(preprocessors: Mapping[str, Preprocessor], sensors: Mapping[str, Sensor]) -> None:
    """Raise ValueError if a preprocessor makes scans that no sensor reads, or if two take scans of one name.

    A camera's frames may go to a preprocessor and to the tracker as well.
    """
    direct = {name: sensor for name, sensor in sensors.items() if name not in preprocessors}
    taken = {name: f"the tracker's own sensor {name!r}" for name in direct}
    for name, preprocessor in preprocessors.items():
        if name not in sensors:
            raise ValueError(f"preprocessors.{name}: must be named as one of the sensors: {', '.join(map(repr, sensors))}")
        if preprocessor.measurement != sensors[name].measurement:
            raise ValueError(
                f"preprocessors.{name}: must make what the sensor {name!r} measures, {sensors[name].measurement}, "
                f"not {preprocessor.measurement}"
            )
        if preprocessor.takes_incomplete:
            lacked = {axis for sensor in preprocessor.sensors.values() for axis in sensor.optional}
            if lost := sorted(lacked & {*preprocessor.measurement.names} - {*sensors[name].optional}):
                told = f"must take returns that lack {', '.join(lost)}, as {preprocessor.kind!r} passes them on"
                raise ValueError(f"sensors.{name}: {told}: put 'partial' around {sensors[name].kind!r}")
        for raw, sensor in preprocessor.sensors.items():
            if raw in direct and isinstance(sensor, ImagingSensor):
                if sensor != direct[raw]:
                    raise ValueError(
                        f"preprocessors.{name}.sensors.{raw}: must be as sensors.{raw} is, whose frames both take"
                    )
                continue
            if raw in taken:
                raise ValueError(f"preprocessors.{name}.sensors.{raw}: scans of this name go to {taken[raw]}")
            taken[raw] = f"the preprocessor {name!r}"


def raw_sensors(preprocessors: Mapping[str, Preprocessor], sensors: Mapping[str, Sensor]) -> dict[str, Sensor]:
    """Return the sensors that a source delivers scans of: those of the preprocessors, and the other ones of the tracker."""
    plain = {name: sensor for name, sensor in sensors.items() if name not in preprocessors}
    return plain | {name: sensor for preprocessor in preprocessors.values() for name, sensor in preprocessor.sensors.items()}


def open_source(
    source: Source, preprocessors: Mapping[str, Preprocessor], sensors: Mapping[str, Sensor], rng: np.random.Generator
) -> Recording:
    """Open a source for the sensors that it delivers scans of; a ConfigError has its place in the config, below `source`."""
    parts = {"source": source, "sensors": sensors, "preprocessors": preprocessors}
    before = deepcopy(rng)
    try:
        recording = source.open(raw_sensors(preprocessors, sensors), rng)
        check_made(source, "open", recording, parts)
    except ConfigError as error:
        raise error.within("source") from None
    except OSError:
        raise
    except Exception as error:
        explain(error, parts, lambda: source.open(raw_sensors(preprocessors, sensors), before))
        raise
    return recording


def still_to_run(
    preprocessors: Mapping[str, Preprocessor], sensors: Mapping[str, Sensor], recording: Recording
) -> dict[str, Preprocessor]:
    """Return the preprocessors whose scans the recording does not hold already; ConfigError if it holds others' scans."""
    for name, space in recording.detected.items():
        sensor = sensors.get(name)
        if sensor is not None and space != sensor.measurement:
            told = f"the recording's scans of it are over {space}, and the tracker's measure {sensor.measurement}"
            raise ConfigError.at(f"sensors.{name}", told)
    return {name: preprocessor for name, preprocessor in preprocessors.items() if name not in recording.detected}


def noted(scans: Iterable[Scan], frames: deque[tuple[float, str, int]]) -> Iterator[Scan]:
    """Yield the scans, and note time, sensor and place of those with a frame."""
    for i, scan in enumerate(scans):
        if scan.frame is not None:
            frames.append((scan.time, scan.sensor, i))
        yield scan


def preprocessed(
    scans: Iterable[Scan], preprocessors: Mapping[str, Preprocessor], own: Container[str] = ()
) -> Iterator[Scan]:
    """Yield the scans, with those that a preprocessor takes replaced by its output; arrays may have a leading axis of runs.

    Scans of one time that go to one preprocessor make one scan, which comes after those that go to none. Frames of a sensor
    in `own`, the tracker's, are kept and come last: what is found in them starts there, not where it was.
    """
    goes_to = {raw: name for name, preprocessor in preprocessors.items() for raw in preprocessor.sensors}
    for time, moment in groupby(scans, key=lambda scan: scan.time):
        waiting: dict[str, dict[str, Scan]] = {name: {} for name in preprocessors}
        kept = []
        for scan in moment:
            if (name := goes_to.get(scan.sensor)) is None:
                yield scan
                continue
            if scan.sensor in own and scan.sensor not in preprocessors:
                kept.append(scan)
            if scan.sensor in waiting[name]:  # two scans of one sensor at the same time
                yield _made(name, preprocessors[name], time, waiting.pop(name))
                waiting[name] = {}
            waiting[name][scan.sensor] = scan
        yield from (_made(name, preprocessors[name], time, parts) for name, parts in waiting.items() if parts)
        yield from kept


def _made(name: str, preprocessor: Preprocessor, time: float, parts: Mapping[str, Scan]) -> Scan:
    pose = next((scan.pose for scan in parts.values()), None)
    made = preprocessor.process({raw: _readable(scan, preprocessor) for raw, scan in parts.items()})
    if not isinstance(made, Detections):
        check_made(preprocessor, "process", made, {"preprocessors": {name: preprocessor}})
    if made.missing is not None and made.missing.shape == made.z.shape:
        made = evolve(made, z=np.where(made.missing, 0.0, made.z))
    return Scan(time, name, made, pose)


def _readable(scan: Scan, preprocessor: Preprocessor) -> Scan:
    """Return the scan as a preprocessor reads it: nan is what a return lacks, or the return is padding."""
    detections, valid = scan.detections, scan.detections.complete
    if detections.missing is None:
        return scan
    if preprocessor.takes_incomplete:
        return evolve(scan, detections=evolve(detections, z=np.where(detections.missing, np.nan, detections.z)))
    whole = evolve(detections, z=np.where(valid[..., None], detections.z, 0.0), valid=valid, missing=None)
    return evolve(scan, detections=whole)


def preprocess(
    scans: Iterable[Scan],
    preprocessors: Mapping[str, Preprocessor],
    problems: list[Problem] | Refused,
    *,
    strict: bool,
    own: Container[str] = (),
) -> Iterator[Scan]:
    """Yield the scans of a recording after detection, one at a time, so that pictures need not fit into memory.

    Raw scans and returns that were left out are added to `problems`; if `strict` they raise ScanRefused.
    """
    raw = raw_sensors(preprocessors, {})
    whole = {name: each.kind for each in preprocessors.values() if not each.takes_incomplete for name in each.sensors}

    def sound() -> Iterator[Scan]:
        for i, scan in enumerate(scans):
            scan, lost = with_axes(scan, raw), False
            if refused := flaws(scan, raw, scan.time) if scan.sensor in raw else []:
                scan, left_out = without_bad_returns(scan)
                lost, refused = not left_out, left_out or refused
            if not lost and scan.sensor in whole:
                lacking = np.argwhere(scan.detections.valid & ~scan.detections.complete).tolist()
                told = f"lacks a component, and {whole[scan.sensor]!r} does not take such (`takes_incomplete`)"
                refused = [*refused, *(Problem(f"return {', '.join(map(str, one))}", told) for one in lacking)]
                lost = bool(lacking) and not scan.detections.complete.any()  # without any it would be a miss
            if strict and refused:
                raise ScanRefused(f"raw scan of {scan.sensor!r} at {scan.time:.6f} s: {'; '.join(map(str, refused))}")
            problems.extend([evolve(problem, place=f"raw scan {i}, {problem.place}") for problem in refused])
            if not lost:
                yield scan

    return preprocessed(sound(), preprocessors, own)
