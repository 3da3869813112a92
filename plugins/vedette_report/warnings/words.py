"""What looks wrong with a run, and what to change: wrong units, refused input, nothing that fits.

A run does not end for any of it, and none of it is certain; each is one sentence, in the summary and on the terminal.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import compress
from typing import TypeAlias

import numpy as np

from vedette.config import warnings_of
from vedette.experiment import Experiment, Result
from vedette.hypotheses import HypothesisAssociator
from vedette.metrics import Score
from vedette.roles import Sensor
from vedette.supporting import ImagingSensor
from vedette.tracking import Came, Intake, Tracker, open_source
from vedette.types import LazyScans, Recording, Scan, Track
from vedette_files import DATED, beyond_period
from vedette_report.figures import count
from vedette_report.warnings.coalescence import LONG, coalesced
from vedette_report.warnings.joined import joined
from vedette_report.warnings.late import late
from vedette_report.warnings.rehearsal import rehearsed, silenced
from vedette_report.warnings.several import several
from vedette_report.warnings.stated import otherwise
from vedette_report.warnings.turned import turned

MOST = 0.5
"""A larger fraction of the input than this must be odd before it is reported."""
MUCH = 0.25
"""Of such a part of the input that is left out it is said that it is much. Chosen by hand."""
ENOUGH = 10
"""Fewer scans or returns than this are not judged."""
_SHORT, _LONG = 1e-5, 1000.0
"""Scans this near to each other, or this far apart, in s, are no sensor's: their times are in another unit."""


First: TypeAlias = tuple[Sequence[Scan], Sequence[Track]]
"""The first scans of a run, and the tracks in these."""


def warnings(experiment: Experiment, result: Result, score: Score, first: First | None = None) -> Iterator[str]:
    """Yield a sentence for each thing that looks wrong, the most serious first; `first` of a run that keeps no others."""
    intake, (scans, tracks) = result.intake, (result.scans, result.tracks) if first is None else first
    yield from warnings_of(intake, result.recording, experiment.tracker.sensors)
    yield from _nothing_found(experiment, result, score, scans)
    yield from _on_each_other(experiment.tracker, tracks)
    yield from held(experiment.tracker)
    yield from (f"{place}: {said}; try {better}" for place, said, better in silenced(experiment.tracker, result.scans))
    around = list(turned(experiment.tracker, result.scans, result.recording.truth))
    yield from map(str, around)
    yield from late(experiment.tracker, scans, tracks, [one.sensor for one in around])
    yield from several(experiment.tracker, scans, tracks)
    if tracks or not score.tracks:  # which may all have come later
        yield from otherwise(experiment.tracker, scans, tracks)
    if experiment.judge.truth_gap is None:
        yield from joined(result.recording.truth, np.array([scan.time for scan in scans]))
    yield from _off_truth(result, score)


def _nothing_found(experiment: Experiment, result: Result, score: Score, scans: Sequence[Scan]) -> Iterator[str]:
    """Say that no track took anything, or that none was confirmed, and what may be why."""
    intake = result.intake
    if intake.tracked >= ENOUGH and intake.hits == 0 and intake.frames == intake.scans:
        yield (
            f"there were tracks in {intake.tracked:,} frames, and in none of them was a target found: does it stand "
            "out in the first frame, where its track begins?"
        )
    elif intake.tracked >= ENOUGH and intake.hits == 0:
        told = f"there were tracks and returns in {intake.tracked:,} scans, and in none of them did a track take a return"
        yield from _because(
            experiment, result, told, "compare the sensor's noise and the motion's with the units of the data"
        )
    elif ENOUGH <= intake.scans <= intake.returns and not score.tracks:
        told = f"no track was confirmed in {intake.scans:,} scans with {intake.returns:,} returns"
        better = (
            "does a target move there, and stand out?"
            if intake.frames
            else _incomplete(experiment.tracker, scans)
            or "compare the lifecycle, the sensor's noise and its clutter with the data"
        )
        yield from _because(experiment, result, told, better)


def _on_each_other(tracker: Tracker, tracks: Sequence[Track]) -> Iterator[str]:
    """Say that tracks lay on each other, where the associator is one that averages over those that are close."""
    associator = tracker.associator
    if associator.decides or isinstance(associator, HypothesisAssociator):
        return
    if pairs := coalesced(tracks):
        a, b, times = max(pairs, key=lambda pair: pair[2])
        yield (
            f"{count(len(pairs), 'pair')} of tracks lay on each other for {LONG} scans or more ({a} and {b}: {times}): "
            f"where targets stay close, {associator.kind!r} averages over them. Nearer than two of the sensor's deviations "
            "that places them best; if yours are farther apart, take 'jpda_star'"
        )


def _off_truth(result: Result, score: Score) -> Iterator[str]:
    """Say that the truth is of other times, or elsewhere."""
    if result.recording.truth and score.scans < ENOUGH <= result.intake.scans:
        yield (
            f"of {result.intake.scans:,} scans only {score.scans:,} lie between the first and the last time of the truth: "
            "do their clocks agree?"
        )
    if score.coverage == 0 and score.tracks:
        yield (
            f"of {score.tracks:,} confirmed tracks none was ever near a true object: compare axes, units and origin of "
            "truth and tracks, and judge.cover_radius"
        )


def _incomplete(tracker: Tracker, scans: Sequence[Scan]) -> str:
    """Return that all returns of the sensors that may start tracks lack components, as they then start none; or ""."""
    birth = tracker.birth
    if birth is None or birth.kind == "poisson":
        return ""
    own = [scan for scan in scans if scan.frame is None and birth.starts_from(scan.sensor)]
    lacking = [scan for scan in own if np.any(scan.detections.valid)]
    if not lacking or any(np.any(scan.detections.complete) for scan in lacking):
        return ""
    sensor, missing = lacking[0].sensor, lacking[0].detections.missing
    axes = compress(tracker.sensors[sensor].measurement.names, np.any(missing, axis=0))
    return f"returns that lack a component, as all of {sensor} lack {', '.join(axes)}, start tracks with 'poisson' alone"


def held(tracker: Tracker) -> Iterator[str]:
    """Yield a sentence for each axis that a birth is unsure of and a sensor sees, but the motion holds as it begins."""
    stated = {**getattr(tracker.birth, "spread", {}), **getattr(tracker.birth, "start", {})}
    for axis in tracker.estimator.zero_variance.names:
        seen = [name for name, sensor in tracker.sensors.items() if _sees(sensor, axis)]
        if seen and np.any(np.atleast_1d(stated.get(axis, 0.0))[-1:] > 0):
            told = f"{axis} begins with a deviation, {seen[0]} sees it, and the motion holds it: no return will change it"
            yield f"{told}; let it move, as by 'product' with a 'random_walk' of its own"


def _sees(sensor: Sensor, axis: str) -> bool:
    """Return whether it measures by an axis; what looks at frames learns of a target in its own way."""
    return axis in sensor.observes and not isinstance(sensor, ImagingSensor)


def _because(experiment: Experiment, result: Result, told: str, otherwise: str) -> Iterator[str]:
    """Yield what was told with each cause that a target played to the tracker shows, and its cure; without, `otherwise`."""
    causes = [f"{place}: {said}; try {better}" for place, said, better in rehearsed(experiment.tracker, result.scans)]
    yield from (f"{told}: {cause}" for cause in causes or [otherwise])


def of_input(intake: Intake, recording: Recording, sensors: Mapping[str, Sensor]) -> Iterator[str]:
    """Yield a sentence for each thing that looks wrong with the input alone, whatever the tracks made of it."""
    if (said := _refused(intake)) is not None:
        yield said
    yield from recording.warnings
    for name, came in intake.came.items():
        yield from _of_sensor(name, came, sensors[name])
    yield from at_rest(recording.scans, sensors)
    if intake.scans == 1 and intake.returns >= ENOUGH:
        yield f"all {intake.returns:,} returns are of one scan, and one confirms no track: is the right column the time?"
    gap = 0.0 if intake.times is None else (intake.times[1] - intake.times[0]) / max(intake.scans - 1, 1)
    if intake.scans >= ENOUGH and (gap >= _LONG or 0 < gap < _SHORT) and recording.notes.get("time") != DATED:
        yield f"scans are {_interval(gap)} apart on average: are their times in another unit, such as ms? They are read as s"


def at_rest(scans: Sequence[Scan], sensors: Mapping[str, Sensor]) -> Iterator[str]:
    """Yield a sentence for each sensor of range rates whose platform moves, in scans whose pose states no velocity."""
    rated = [name for name, sensor in sensors.items() if "range_rate" in sensor.measurement]
    for name in rated if not isinstance(scans, LazyScans) else ():
        poses = [scan.pose for scan in scans if scan.sensor == name and scan.pose is not None]
        places = [pose.position for pose in poses if pose.velocity is None]
        if not all(np.array_equal(place, places[0]) for place in places):
            told = f"{name}: its platform moves, and {count(len(places), 'pose')} without a velocity count as at rest"
            yield f"{told}: range rates are relative to it; state velocity, 0 where its motion is taken out of them"


def left_out(intake: Intake, recording: Recording) -> Iterator[str]:
    """Yield how much of the input was left out, and why the first part was; nothing where all of it was taken."""
    if intake.refused.count:
        first = next((f", the first: {problem}" for problem in (*recording.refused, *intake.refused.first)), "")
        yield f"{count(intake.refused.count, 'part')} of the input left out{first}"


def of_recording(experiment: Experiment) -> Iterator[str]:
    """Yield what looks wrong with the input of an experiment that reads a recording, opened for that; no frame is read."""
    if experiment.source is None or experiment.source.draws:
        return
    sensors = experiment.tracker.sensors
    recording = open_source(experiment.source, experiment.preprocessors, sensors, np.random.default_rng(experiment.seed))
    unread = isinstance(recording.scans, LazyScans) or bool(experiment.preprocessors)
    yield from warnings_of(Intake.of(sensors, () if unread else recording.scans, recording.refused), recording, sensors)


def _interval(gap: float) -> str:
    return f"{gap:,.0f} s" if gap >= _LONG else f"{gap:.3g} s"


def _refused(intake: Intake) -> str | None:
    """Say that much of the input was refused, and how to put times that go back right."""
    refused, taken = intake.refused, max(intake.scans, intake.returns)
    if not refused.count or refused.count < MUCH * (refused.count + taken):
        return None
    part = "most" if refused.count >= taken else "much"
    told = f"{part} of the input was left out: {count(refused.count, 'part')}, and {count(intake.scans, 'scan')} taken"
    if refused.late > MOST * refused.count:
        return f"{told}; {refused.late:,} of them go back in time: sort the recording, or state `sort = true`"
    return f"{told}; what is wrong with the first is said below"


def _of_sensor(name: str, came: Came, sensor: Sensor) -> Iterator[str]:
    """Yield what is odd about all returns of one sensor."""
    if came.returns == 0 and came.frames == 0 and came.scans >= ENOUGH and not sensor.claims:
        yield f"{name}: none of {came.scans:,} scans holds a return: is the right sensor, column or threshold read?"
    for axis, largest in zip(sensor.measurement.axes, came.largest, strict=False):
        if (said := beyond_period(name, axis, np.array([largest]))) is not None:
            yield said
    if came.looked >= ENOUGH and came.out_of_reach == came.looked:
        yield (
            f"{name}: all of the first {came.looked:,} returns lie where the sensor says that it detects nothing: check the "
            "unit of their ranges, and max_range"
        )
    if came.scans >= ENOUGH and came.same_time > MOST * came.scans:
        yield (
            f"{name}: {came.same_time:,} of {came.scans:,} scans have the very time of the one before: is each return a "
            "scan of its own, or are the times cut to whole seconds?"
        )
