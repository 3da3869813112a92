"""One experiment on one recording, with any values of its free parameters: how likely each scan was."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import islice

import numpy as np
from attrs import evolve, frozen

from vedette import Array, ConfigError, Experiment, ImagingSensor, Recording, Scan, Sensor, VedetteError
from vedette.config import warnings_of
from vedette.experiment import Steps
from vedette.progress import silent
from vedette.tracking import Expected, State, open_source
from vedette.types import come_once
from vedette_report.detector_errors.in_tracks import Told, in_tracks
from vedette_report.warnings.words import left_out
from vedette_tools.tuning.field_of_view import Cover, View, views
from vedette_tools.tuning.innovations import Gathering, Moments
from vedette_tools.tuning.likelihood import Predictive
from vedette_tools.tuning.parameters import Free, applied
from vedette_tools.tuning.unstated import Unstated, found
from vedette_tools.tuning.unthresholded import unthresholded

LEAST = 10
"""Scans that are needed to tune on, and to judge by."""

PASSES = 4
"""So often what a config does not state is found anew from what was found before."""

FAULTS = (VedetteError, ValueError, ArithmeticError, np.linalg.LinAlgError)
"""What a tracker that cannot run raises."""


@frozen(eq=False)
class Data:
    """An experiment's recording, opened once, so that every evaluation meets the same scans and draws the same numbers.

    Scans before the time `cut` are tuned on, `tuned` of them, the others judged by; `times` (s,). `scans` are those that
    the tracker took; None of cameras, whose frames need not fit into memory. `unstated` is what the config does not state,
    `covers` are the sensors' views of it at each scan, `densities` stand in where the gate counts clutter itself. `odd`:
    what looks wrong with the input.
    """

    experiment: Experiment
    recording: Recording
    scans: Sequence[Scan] | None
    times: Array
    tuned: int
    sensors: Sequence[str]
    unstated: Unstated
    covers: Sequence[Cover]
    densities: dict[str, float] | None
    odd: tuple[str, ...] = ()

    @property
    def cut(self) -> float:
        """The time of the first scan that is held back, in s."""
        return float(self.times[self.tuned]) if self.tuned < len(self.times) else math.inf

    def within(self, unstated: Unstated) -> Data:
        """Return the same data with something else of what the config does not state."""
        assert self.scans is not None
        sensors = self.experiment.tracker.sensors
        return evolve(self, unstated=unstated, covers=tuple(_cover(sensors, unstated.views, scan) for scan in self.scans))

    def run(self, experiment: Experiment) -> Iterator[tuple[State, Scan, State]]:
        """Run the experiment over the recording: yield each scan with the states before and after it."""
        if self.scans is None:
            steps = _steps(experiment, self.recording, self.experiment.seed)
            for scan, state in steps:
                yield steps.before, scan, state
            return
        tracker = experiment.tracker
        state = tracker.start(tracker.given(self.recording), self.scans[0].time, _seeds(self.experiment.seed)[1])
        for scan in self.scans:
            before, state = state, tracker.step(state, scan)
            yield before, scan, state


def _seeds(seed: int) -> list[np.random.SeedSequence]:
    """Return what the source and the tracker draw from, as a run has them."""
    return np.random.SeedSequence(seed).spawn(2)


def _steps(experiment: Experiment, recording: Recording, seed: int) -> Steps:
    given = experiment.tracker.given(recording)
    return Steps(experiment, recording, given, _seeds(seed)[1], strict=False, progress=silent, named=0)


@frozen(eq=False)
class Evaluated:
    """The log-likelihood of each scan (s,), and how many returns of no track were expected there (s,)."""

    loglik: Array
    expected: Array


def open_data(experiment: Experiment, part: float) -> Data:
    """Open an experiment's source and keep the first `part` of its scans to be tuned on; ConfigError says what lacks."""
    if experiment.source is None:
        raise ConfigError.at("source", "is missing: there are no scans to tune on")
    rng = np.random.default_rng(_seeds(experiment.seed)[0])
    recording = open_source(experiment.source, experiment.preprocessors, experiment.tracker.sensors, rng)
    return data_of(experiment, recording, part)


def data_of(experiment: Experiment, recording: Recording, part: float) -> Data:
    """Return the data of a recording."""
    if come_once(recording.scans):
        raise ConfigError.at("source", "must be a recording: what a camera gives comes once")
    if not 0 < part <= 1:
        raise ConfigError.at("--part", f"must be > 0 and <= 1, got {part:g}")
    tracker = experiment.tracker
    try:
        steps = _steps(experiment, recording, experiment.seed)
    except ValueError as error:
        raise ConfigError.at("", str(error)) from None
    framed = any(isinstance(sensor, ImagingSensor) for sensor in tracker.sensors.values())
    scans = [evolve(scan, frame=None) if framed else scan for scan, _ in steps]
    times = np.array([scan.time for scan in scans])
    tuned = len(scans) if part == 1 else int(np.searchsorted(times, times[int(part * len(times))])) if len(times) else 0
    odd = (*warnings_of(steps.intake, recording, tracker.sensors), *left_out(steps.intake, recording))
    if tuned < LEAST or (part < 1 and len(scans) - tuned < LEAST):
        told = f"gives {len(scans)} scan{'' if len(scans) == 1 else 's'}, of which {tuned} are to tune on"
        text = "; ".join([f"{told}: at least {LEAST} are needed there and in the rest", *odd])
        raise ConfigError.at("source", text)
    if not steps.intake.returns + steps.intake.frames:
        raise ConfigError.at("source", f"gives {len(scans)} scans without any return: there is nothing to tune by")
    seen = views(tracker.sensors, scans)
    densities = None
    if tracker.gate.clutter == "nonparametric":
        densities = {name: _density(seen[name], name, scans) for name in seen}
    covers = tuple(_cover(tracker.sensors, seen, scan) for scan in scans)
    names = tuple(scan.sensor for scan in scans)
    kept = None if framed else scans
    return Data(experiment, recording, kept, times, tuned, names, Unstated(seen), covers, densities, odd)


def evaluate(data: Data, free: Sequence[Free], values: Sequence[float], *, whole: bool = False) -> Evaluated | None:
    """Return how likely the scans are with these values, by default of those that are tuned on; None if it cannot run."""
    try:
        return _evaluated(data, judging(data, free, values), len(data.times) if whole else data.tuned)
    except FAULTS:
        return None


def moments(data: Data, free: Sequence[Free], values: Sequence[float], *, whole: bool = False) -> Moments | None:
    """Return what the tracker itself, with its thresholds, makes of the scans with these values; None if it cannot run."""
    count = len(data.times) if whole else data.tuned
    try:
        experiment = applied(data.experiment, free, values)
        gathering, i = Gathering(experiment.tracker), 0
        for (it, expected, _), state in _expected(data, experiment, count):
            gathering.add(it, state, expected)
            i += 1
    except FAULTS:
        return None
    return gathering.found() if i == count else None


def errors_in_time(data: Data, free: Sequence[Free], values: Sequence[float]) -> tuple[Told, ...]:
    """Return how the errors of sensors go on from scan to scan, by the returns that the tracker's own tracks took."""
    if data.scans is None:
        return ()
    experiment = applied(data.experiment, free, values)
    return in_tracks(experiment.tracker, data.scans, (state for _, _, state in data.run(experiment)))


def settled(data: Data, free: Sequence[Free], values: Sequence[float]) -> Data:
    """Return the data with what the config does not state as a tracker with these values finds it, if that can run."""
    if data.scans is None:
        return data
    first = data.unstated
    for _ in range(PASSES):
        try:
            experiment = judging(data, free, values)
            now = found(experiment.tracker, data.run(experiment), data.unstated)
        except FAULTS:
            return data
        if now.like(data.unstated):
            break
        data = data.within(now)
    return data.within(evolve(data.unstated, number=first.number + 1)) if data.unstated is not first else data


def check(data: Data, free: Sequence[Free], values: Sequence[float]) -> None:
    """Raise ConfigError, with the reason, if the tracker cannot run on the data with these values."""
    reason = "the likelihood of its scans is no number"
    try:
        experiment = applied(data.experiment, free, values)
        if all(1 for _ in _expected(data, experiment, len(data.times))) and _evaluated(
            data, judging(data, free, values), len(data.times)
        ):
            return
    except (VedetteError, ValueError, ArithmeticError) as error:
        reason = str(error)
    told = ", ".join(f"{each.path} at {each.told(value)}" for each, value in zip(free, values, strict=True))
    raise ConfigError.at("", f"the tracker cannot run on this recording with {told}: {reason}")


def judging(data: Data, free: Sequence[Free], values: Sequence[float]) -> Experiment:
    """Return the experiment with these values, and with the tracker by which returns are judged."""
    experiment = applied(data.experiment, free, values)
    freed = [each.place.path for each in free]
    return evolve(experiment, tracker=unthresholded(experiment.tracker, data.unstated.real, freed))


def _evaluated(data: Data, experiment: Experiment, count: int) -> Evaluated | None:
    loglik, expected, i = np.zeros(count), np.zeros(count), 0
    for (_, expected[i], loglik[i]), _ in _expected(data, experiment, count):
        i += 1
    return Evaluated(loglik, expected) if i == count and np.all(np.isfinite(loglik)) else None


def _expected(data: Data, experiment: Experiment, count: int) -> Iterator[tuple[tuple[Expected, float, float], State]]:
    """Yield what was expected of each scan, how many returns of no track, and how likely it was, with the state after it."""
    predictive = Predictive(experiment.tracker)
    with np.errstate(over="ignore", under="ignore", divide="ignore", invalid="ignore"):
        for i, (before, scan, state) in enumerate(islice(data.run(experiment), count)):
            density = None if data.densities is None else data.densities.get(scan.sensor, 0.0)
            it = experiment.tracker.expect(before, scan)
            loglik, expected = predictive(it, data.covers[i], density)
            yield (it, expected, loglik), state


def _cover(sensors: Mapping[str, Sensor], seen: Mapping[str, View], scan: Scan) -> Cover:
    sensor = sensors[scan.sensor]
    if isinstance(sensor, ImagingSensor) or scan.sensor not in seen:
        return Cover(np.zeros((0, len(sensor.measurement))), 0.0)
    return seen[scan.sensor].cover(sensor.placed(scan.pose), scan.pose)


def _density(view: View, name: str, scans: Sequence[Scan]) -> float:
    """Return the mean number of returns a scan over the volume of the view."""
    counts = [np.count_nonzero(scan.detections.valid) for scan in scans if scan.sensor == name]
    return float(np.mean(counts) / np.prod(view.high - view.low))
