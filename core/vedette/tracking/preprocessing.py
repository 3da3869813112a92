"""From raw scans to those that a tracker takes, by the detectors of an experiment."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from itertools import groupby

import numpy as np
from attrs import evolve

from vedette.errors import Problem, ScanRefused
from vedette.roles import Detector, Sensor
from vedette.tracking.validation import flaws, without_bad_returns
from vedette.types import Scan


def check_detectors(detectors: Mapping[str, Detector], sensors: Mapping[str, Sensor]) -> None:
    """ValueError if a detector makes scans that no sensor of the tracker reads, or if two take scans of one name."""
    taken = {name: f"the tracker's own sensor {name!r}" for name in sensors if name not in detectors}
    for name, detector in detectors.items():
        if name not in sensors:
            raise ValueError(f"detectors.{name}: must be named as one of the sensors: {', '.join(map(repr, sensors))}")
        if detector.measurement != sensors[name].measurement:
            raise ValueError(
                f"detectors.{name}: must make what the sensor {name!r} measures, {sensors[name].measurement}, "
                f"not {detector.measurement}"
            )
        for raw in detector.sensors:
            if raw in taken:
                raise ValueError(f"detectors.{name}.sensors.{raw}: scans of this name go to {taken[raw]}")
            taken[raw] = f"the detector {name!r}"


def raw_sensors(detectors: Mapping[str, Detector], sensors: Mapping[str, Sensor]) -> dict[str, Sensor]:
    """The sensors that a source delivers scans of: the detectors' own, and those of the tracker without a detector."""
    plain = {name: sensor for name, sensor in sensors.items() if name not in detectors}
    return plain | {name: sensor for detector in detectors.values() for name, sensor in detector.sensors.items()}


def detected(scans: Iterable[Scan], detectors: Mapping[str, Detector]) -> Iterator[Scan]:
    """The scans, those that a detector takes replaced by what it makes of them; arrays may lead with runs.

    Scans of the same time that go to one detector make one scan, which comes after those that go to none. Detectors see
    whole returns only: to them one that lacks a component is padding.
    """
    goes_to = {raw: name for name, detector in detectors.items() for raw in detector.sensors}
    for time, moment in groupby(scans, key=lambda scan: scan.time):
        waiting: dict[str, dict[str, Scan]] = {name: {} for name in detectors}
        for scan in moment:
            name = goes_to.get(scan.sensor)
            if name is None:
                yield scan
                continue
            if scan.sensor in waiting[name]:  # it looked twice at the same moment
                yield _made(name, detectors[name], time, waiting.pop(name))
                waiting[name] = {}
            waiting[name][scan.sensor] = scan
        for name, parts in waiting.items():
            if parts:
                yield _made(name, detectors[name], time, parts)


def _made(name: str, detector: Detector, time: float, parts: Mapping[str, Scan]) -> Scan:
    pose = next((scan.pose for scan in parts.values()), None)
    return Scan(time, name, detector.detect({raw: _whole(scan) for raw, scan in parts.items()}), pose)


def _whole(scan: Scan) -> Scan:
    """The scan as a detector sees it: a return that lacks a component is padding."""
    seen = scan.detections
    if seen.missing is None:
        return scan
    valid = seen.valid & ~np.any(seen.missing, axis=-1)
    return evolve(scan, detections=evolve(seen, z=np.where(valid[..., None], seen.z, 0.0), valid=valid, missing=None))


def detect_all(
    scans: Iterable[Scan], detectors: Mapping[str, Detector], problems: list[Problem], *, strict: bool
) -> Iterator[Scan]:
    """The scans of a recording after detection, one at a time, so that pictures need not fit into memory.

    What of the raw ones was left out is added to `problems`; if `strict` it raises ScanRefused.
    """
    return detected(_sound(scans, detectors, problems, strict), detectors)


def _sound(
    scans: Iterable[Scan], detectors: Mapping[str, Detector], problems: list[Problem], strict: bool
) -> Iterator[Scan]:
    """The scans without what no detector can take."""
    raw = {name: sensor for detector in detectors.values() for name, sensor in detector.sensors.items()}
    for i, scan in enumerate(scans):
        if scan.sensor in raw and (found := flaws(scan, raw, scan.time)):
            if strict:
                raise ScanRefused(f"raw scan of {scan.sensor!r} at {scan.time:.6f} s: {'; '.join(map(str, found))}")
            scan, left_out = without_bad_returns(scan)
            found = left_out or found
            problems += [Problem(f"raw scan {i}, {problem.place}", problem.text) for problem in found]
            if not left_out:
                continue
        yield scan
