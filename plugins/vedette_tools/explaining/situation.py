"""All that the rules and the words ask of one experiment, computed once from its components and its source."""

from __future__ import annotations

from functools import partial

import numpy as np
from attrs import frozen

from vedette import Array, Experiment, ImagingSensor, MotionModel, Recording, Sensor, Space
from vedette.tracking import check_again, parts
from vedette_tools.explaining.lifetimes import Lives, lives
from vedette_tools.explaining.source import Came, Opened, opened
from vedette_tools.explaining.steady_state import FAR, Settled, reach, settle, together

NONE = Came(None, None, np.zeros((0, 0)), (), None)


@frozen(eq=False)
class Seen:
    """One sensor: its scan interval `dt` in s (None: unknown), what came of it, how a track settles, what becomes of tracks.

    `far`: the distance in m up to which it detects, None without limit. `boxed`: the volume that its returns span, in the
    measurement's units, and `stated`: the clutter density that the sensor states, the mean over the returns.
    """

    name: str
    sensor: Sensor
    dt: float | None
    came: Came
    settled: Settled | None
    lives: Lives | None
    far: float | None
    boxed: float | None
    stated: float | None

    @property
    def place(self) -> str:
        """Where the config has it."""
        return f"sensors.{self.name}"


@frozen(eq=False)
class Situation:
    """An experiment, what its source tells, its sensors, and its motion models by place, those inside of others left out."""

    experiment: Experiment
    opened: Opened
    sensors: tuple[Seen, ...]
    motions: tuple[tuple[str, MotionModel], ...]

    @property
    def state(self) -> Space:
        return self.experiment.tracker.state

    def true_speed(self) -> float | None:
        """Return the speed in m/s that true objects exceed a tenth of the time, or None without truth."""
        recording = self.opened.recording
        speeds = []
        for one in recording.truth if recording is not None else ():
            where = [i for i, axis in enumerate(one.space.axes) if axis.unit == "m" and axis in self.state.axes]
            gaps = np.diff(one.times)
            if where and np.any(gaps > 0):
                steps = np.linalg.norm(np.diff(one.states[:, where], axis=0), axis=-1)
                speeds.append(np.quantile(steps[gaps > 0] / gaps[gaps > 0], 0.9))
        return float(max(speeds)) if speeds else None


def fused(it: Situation) -> dict[str, float] | None:
    """Return how well all sensors together know a track's position, in m, and after how many s; None of fewer than two."""
    where, tracker = positions(it.state), it.experiment.tracker
    some = [(each, each.settled, each.dt) for each in it.sensors if each.settled is not None and each.dt]
    if len(some) < 2 or not where:
        return None
    starts = [settled.start for seen, settled, _ in some if seen.name in tracker.starters] or [some[0][1].start]
    looks = [(seen.sensor.placed(seen.came.pose), dt, seen.came.lacks) for seen, _, dt in some]
    time, cov = together(tracker, looks, starts[0])
    first, then = deviation(starts[0].cov[0], where), deviation(cov, where)
    return {"after_s": time, "first_position_error_m": first, "position_error_m": then}


def situation(experiment: Experiment, interval: float | None = None) -> Situation:
    """Return the situation of an experiment; `interval` in s replaces the time from scan to scan that its source has."""
    source, tracker = opened(experiment), experiment.tracker
    seen = []
    for name, sensor in tracker.sensors.items():
        came = source.came.get(name, NONE)
        dt = interval if interval is not None else came.interval
        settled = None if dt is None else _settled(experiment, name, dt, source.recording, came)
        far = None if isinstance(sensor, ImagingSensor) else reach(sensor)[1]
        boxed, stated = _clutter(sensor, came)
        seen.append(
            Seen(
                name, sensor, dt, came, settled, _lives(experiment, name, settled, dt),
                None if far is None or not far < FAR else far, boxed, stated,
            )
        )  # fmt: skip
    motions = [(place, part) for place, part in parts(tracker.estimator, "estimator") if isinstance(part, MotionModel)]
    outer = [(place, part) for place, part in motions if not any(place.startswith(f"{other}.") for other, _ in motions)]
    return Situation(experiment, source, tuple(seen), tuple(outer))


def _settled(experiment: Experiment, name: str, dt: float, recording: Recording | None, came: Came) -> Settled | None:
    """Return how a track settles; PluginError if a component makes it nan, None if it is nan and none is at fault."""
    again = partial(settle, experiment.tracker, name, dt, recording, came.returns, came.pose, came.lacks)
    settled = again()
    if settled is None or (np.isfinite(settled.mean).all() and np.isfinite(settled.S).all()):
        return settled
    check_again(experiment, again)
    return None


def positions(state: Space) -> list[int]:
    """Return the indices of the axes in m."""
    return [i for i, axis in enumerate(state.axes) if axis.unit == "m"]


def deviation(cov: Array, where: list[int]) -> float:
    """Return the largest standard deviation over some axes; 0 of none."""
    return float(np.sqrt(max(np.linalg.eigvalsh(cov[np.ix_(where, where)])[-1], 0.0))) if where else 0.0


def _clutter(sensor: Sensor, came: Came) -> tuple[float | None, float | None]:
    if isinstance(sensor, ImagingSensor) or len(came.returns) < 20:
        return None, None
    boxed = float(np.prod(np.quantile(came.returns, 0.98, axis=0) - np.quantile(came.returns, 0.02, axis=0)))
    return boxed, float(np.mean(sensor.clutter(came.returns)))


def _lives(experiment: Experiment, name: str, settled: Settled | None, dt: float | None) -> Lives | None:
    """Draw the lives of tracks that this sensor alone starts and sees, where clutter is stated."""
    tracker = experiment.tracker
    alone = len(tracker.sensors) == 1 and name in tracker.starters and tracker.gate.clutter == "sensor"
    if not alone or settled is None or dt is None or not (settled.density > 0 and settled.detects > 0):
        return None
    initial = None if tracker.birth is None else tracker.birth.initial_existence
    if initial is None and not tracker.lifecycle.certain:
        return None
    where = positions(tracker.state)
    spread = np.array([deviation(cov, where) for cov in settled.updated])
    threshold = tracker.gate.for_sensor(tracker.sensors[name]).threshold
    if not np.isfinite(threshold):
        return None
    return lives(tracker.lifecycle, initial or 1.0, settled, dt, tracker.gate.probability, threshold, spread)
