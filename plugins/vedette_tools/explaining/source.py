"""What the beginning of an experiment's source tells of its scans: how often they come, where returns and targets are."""

from __future__ import annotations

from collections import defaultdict
from itertools import groupby, islice
from typing import Any

import numpy as np
from attrs import Factory, frozen

from vedette import Array, Experiment, Mask, Pose, Recording, Scan, VedetteError
from vedette.tracking import open_source, preprocess
from vedette.types import come_once

MOST_SCANS, MOST_FRAMES, MOST_PREPROCESSED = 200, 3, 20
"""Scans at the beginning of the source that are looked at, of frames, and for preprocessors, which take their time."""


@frozen(eq=False)
class Came:
    """What came of one sensor: the median time between its scans in s (None if there were fewer than two), the mean number
    of returns a scan (None of frames), the returns (k, m) with the pose of each, the pose of its first scan, the scans, and
    which components (m,) no return has.
    """

    interval: float | None
    per_scan: float | None
    returns: Array
    poses: tuple[Pose | None, ...]
    pose: Pose | None
    scans: tuple[Scan, ...] = ()
    lacks: Mask | None = None


@frozen(eq=False)
class Opened:
    """The beginning of a source: the recording (None if it could not be opened, and why), and what came of each sensor."""

    recording: Recording | None
    why: str = ""
    came: dict[str, Came] = Factory(dict)


def opened(experiment: Experiment) -> Opened:
    """Open the source and look at its first scans."""
    if experiment.source is None:
        return Opened(None, "there is no source")
    rng = np.random.default_rng(np.random.SeedSequence(experiment.seed).spawn(2)[0])
    sensors = experiment.tracker.sensors
    try:
        recording = open_source(experiment.source, experiment.preprocessors, sensors, rng)
        scans = _first(recording)
    except VedetteError as error:
        return Opened(None, str(error))
    goes_to = {raw: name for name, each in experiment.preprocessors.items() for raw in each.sensors}
    framed = {scan.sensor for scan in scans if scan.frame is not None}
    times: dict[str, list[float]] = defaultdict(list)
    for scan in scans:
        name = goes_to.get(scan.sensor, scan.sensor)
        if not times[name] or times[name][-1] != scan.time:
            times[name].append(scan.time)
    whole = {name: each for name, each in experiment.preprocessors.items() if name not in recording.detected}
    read = [scan for scan in scans if scan.sensor not in framed][: MOST_PREPROCESSED if whole else MOST_SCANS]
    by_sensor: dict[str, list[Scan]] = {name: [] for name in sensors}
    for scan in preprocess(read, whole, [], strict=False):
        if scan.sensor in by_sensor:
            by_sensor[scan.sensor].append(scan)
    return Opened(
        recording, "", {name: _came(times[name], by_sensor[name], len(sensors[name].measurement)) for name in sensors}
    )


def _first(recording: Recording) -> list[Scan]:
    """Return the first scans, all those of one time."""
    if come_once(recording.scans):
        return []  # what comes once is left to the run
    scans: list[Scan] = []
    for _, together in groupby(islice(recording.scans, 2 * MOST_SCANS), key=lambda scan: scan.time):
        scans += together
        if len(scans) >= (MOST_SCANS if scans[0].frame is None else MOST_FRAMES):
            break
    return scans


def _came(times: list[float], scans: list[Scan], axes: int) -> Came:
    gaps = np.diff(times)
    gaps = gaps[gaps > 0]
    returns: list[Any] = []
    poses: list[Pose | None] = []
    lacks = np.full(axes, any(np.any(scan.detections.valid) for scan in scans))
    for scan in scans:
        seen = scan.detections
        if seen.z.shape[-1] == axes:  # bad returns are the run's to refuse
            lacks &= np.all(seen.missing[seen.valid], axis=0) if seen.missing is not None else not np.any(seen.valid)
            whole = seen.complete & np.all(np.isfinite(seen.z), axis=-1)
            returns += list(seen.z[whole])
            poses += [scan.pose] * int(np.sum(whole))
    return Came(
        interval=float(np.median(gaps)) if len(gaps) else None,
        per_scan=float(np.mean([np.sum(scan.detections.valid) for scan in scans])) if scans else None,
        returns=np.array(returns).reshape(-1, axes),
        poses=tuple(poses),
        pose=next((scan.pose for scan in scans), None),
        scans=tuple(scans),
        lacks=lacks if np.any(lacks) and not np.all(lacks) else None,
    )
