"""One experiment on one recording, with any values of its free parameters: how likely each scan was."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import islice

import numpy as np
from attrs import evolve, frozen

from vedette.config import warnings_of
from vedette.errors import ConfigError, Problem, VedetteError
from vedette.experiment import Experiment, Steps
from vedette.progress import silent
from vedette.roles import Sensor
from vedette.space import Array
from vedette.supporting import ImagingSensor
from vedette.tracking import State, open_source
from vedette.types import LazyScans, Recording, Scan
from vedette_tools.tuning.field_of_view import Cover, View, views
from vedette_tools.tuning.innovations import Gathering, Moments
from vedette_tools.tuning.likelihood import Predictive
from vedette_tools.tuning.parameters import Free, applied

LEAST = 10
"""Scans that are needed to tune on, and to judge by."""


@frozen(eq=False)
class Data:
    """An experiment's recording, opened once, so that every evaluation meets the same scans and draws the same numbers.

    Scans before the time `cut` are tuned on, `tuned` of them, the others judged by; `times` (s,). `scans` are those that
    the tracker took; None of cameras, whose frames need not fit into memory. `covers` are the sensors' views at each scan,
    `densities` stand in where the gate counts clutter itself. `odd`: what looks wrong with the input.
    """

    experiment: Experiment
    recording: Recording
    scans: Sequence[Scan] | None
    times: Array
    tuned: int
    covers: Sequence[Cover]
    densities: dict[str, float] | None
    odd: tuple[str, ...] = ()

    @property
    def cut(self) -> float:
        """The time of the first scan that is held back, in s."""
        return float(self.times[self.tuned]) if self.tuned < len(self.times) else math.inf

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
    """The log-likelihood of each scan (s,), and its moments if asked for."""

    loglik: Array
    moments: Moments | None = None


def open_data(experiment: Experiment, part: float) -> Data:
    """Open an experiment's source and keep the first `part` of its scans to be tuned on; ConfigError says what lacks."""
    if experiment.source is None:
        raise ConfigError([Problem("source", "is missing: there are no scans to tune on")])
    rng = np.random.default_rng(_seeds(experiment.seed)[0])
    recording = open_source(experiment.source, experiment.preprocessors, experiment.tracker.sensors, rng)
    return data_of(experiment, recording, part)


def data_of(experiment: Experiment, recording: Recording, part: float) -> Data:
    """Return the data of a recording."""
    if isinstance(recording.scans, LazyScans) and recording.scans.once:
        raise ConfigError([Problem("source", "must be a recording: what a camera gives comes once")])
    if not 0 < part <= 1:
        raise ConfigError([Problem("--part", f"must be > 0 and <= 1, got {part:g}")])
    tracker = experiment.tracker
    try:
        steps = _steps(experiment, recording, experiment.seed)
    except ValueError as error:
        raise ConfigError([Problem("", str(error))]) from None
    framed = any(isinstance(sensor, ImagingSensor) for sensor in tracker.sensors.values())
    scans = [evolve(scan, frame=None) if framed else scan for scan, _ in steps]
    times = np.array([scan.time for scan in scans])
    tuned = len(scans) if part == 1 else int(np.searchsorted(times, times[int(part * len(times))])) if len(times) else 0
    odd = tuple(warnings_of(steps.intake, recording, tracker.sensors))
    if tuned < LEAST or (part < 1 and len(scans) - tuned < LEAST):
        told = f"gives {len(scans)} scan{'' if len(scans) == 1 else 's'}, of which {tuned} are to tune on"
        text = "; ".join([f"{told}: at least {LEAST} are needed there and in the rest", *odd])
        raise ConfigError([Problem("source", text)])
    if not steps.intake.returns + steps.intake.frames:
        raise ConfigError([Problem("source", f"gives {len(scans)} scans without any return: there is nothing to tune by")])
    seen = views(tracker.sensors, scans)
    densities = None
    if tracker.gate.clutter == "nonparametric":
        densities = {name: _density(seen[name], name, scans) for name in seen}
    covers = tuple(_cover(tracker.sensors, seen, scan) for scan in scans)
    return Data(experiment, recording, None if framed else scans, times, tuned, covers, densities, odd)


def evaluate(
    data: Data, free: Sequence[Free], values: Sequence[float], *, whole: bool = False, moments: bool = False
) -> Evaluated | None:
    """Return how likely the scans are with these values, by default of those that are tuned on; None if it cannot run."""
    try:
        return _evaluated(data, applied(data.experiment, free, values), len(data.times) if whole else data.tuned, moments)
    except (VedetteError, ValueError, ArithmeticError, np.linalg.LinAlgError):
        return None


def check(data: Data, free: Sequence[Free], values: Sequence[float]) -> None:
    """Raise ConfigError, with the reason, if the tracker cannot run on the data with these values."""
    reason = "the likelihood of its scans is no number"
    try:
        if _evaluated(data, applied(data.experiment, free, values), len(data.times), False) is not None:
            return
    except (VedetteError, ValueError, ArithmeticError) as error:
        reason = str(error)
    told = ", ".join(f"{each.path} at {each.told(value)}" for each, value in zip(free, values, strict=True))
    raise ConfigError([Problem("", f"the tracker cannot run on this recording with {told}: {reason}")])


def _evaluated(data: Data, experiment: Experiment, count: int, moments: bool) -> Evaluated | None:
    predictive, gathering = Predictive(experiment.tracker), Gathering(experiment.tracker)
    loglik, i = np.zeros(count), 0
    with np.errstate(over="ignore", under="ignore", divide="ignore", invalid="ignore"):
        for before, scan, state in islice(data.run(experiment), count):
            density = None if data.densities is None else data.densities.get(scan.sensor, 0.0)
            it = experiment.tracker.expect(before, scan)
            loglik[i], expected = predictive(it, data.covers[i], density)
            if moments:
                gathering.add(it, state, expected)
            i += 1
    if i < count or not np.all(np.isfinite(loglik)):
        return None
    return Evaluated(loglik, gathering.found() if moments else None)


def _cover(sensors: Mapping[str, Sensor], seen: Mapping[str, View], scan: Scan) -> Cover:
    sensor = sensors[scan.sensor]
    if isinstance(sensor, ImagingSensor) or scan.sensor not in seen:
        return Cover(np.zeros((0, len(sensor.measurement))), 0.0)
    return seen[scan.sensor].cover(sensor if scan.pose is None else sensor.at(scan.pose), scan.pose)


def _density(view: View, name: str, scans: Sequence[Scan]) -> float:
    """Return the mean number of returns a scan over the volume of the view."""
    counts = [np.count_nonzero(scan.detections.valid) for scan in scans if scan.sensor == name]
    return float(np.mean(counts) / np.prod(view.high - view.low))
