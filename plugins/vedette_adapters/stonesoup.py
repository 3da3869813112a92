"""Detections, ground truth and tracks of Stone Soup as scans, trajectories and tracks, and back.

Stone Soup tells axes by their order, Vedette by name: a `Space` says which are which. Its times are dates; here they are s
since `start`, by default since the first.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from datetime import datetime, timedelta
from typing import Any, ClassVar, final

import numpy as np
from attrs import evolve, frozen

from vedette import fields
from vedette.errors import ConfigError, InputError
from vedette.roles import Sensor
from vedette.space import Array, Space
from vedette.supporting import Source
from vedette.types import Detections, Recording, Scan, Track, Trajectory
from vedette_adapters.libraries import foreign, needed
from vedette_adapters.stonesoup_models import own_model

Namer = Callable[[Any], str]
"""What says of which of the tracker's sensors a detection is."""


MICROSECOND = 1e-6
"""s: the dates of Python are whole ones."""


def vector(state: Any) -> Array:
    """Return the numbers (n,) of a state, also where some are angles of Stone Soup's own types."""
    return np.asarray(state.state_vector, dtype=float).ravel()


def seconds(time: datetime, start: datetime) -> float:
    """Return the s from `start` to `time`."""
    return (time - start).total_seconds()


def scans_of(
    detections: Iterable[tuple[datetime, Iterable[Any]]],
    sensor: str | Namer,
    start: datetime | None = None,
    sensors: Mapping[str, Sensor] | None = None,
) -> list[Scan]:
    """Return the scans that a reader, a detector or a list gives: pairs of a time and its detections, which may be none.

    `sensor`: the name of the tracker's sensor, or a function that says it of a detection; an empty scan is then of none. A
    set has no order: detections of a scan are sorted by their numbers, so that each run is the same. Detections that come
    with a measurement model of their own have its place, as the pose of their scan, and its noise: InputError if it is
    none of the tracker's `sensors`.
    """
    scans = []
    for time, at_time in detections:
        start = time if start is None else start
        rows: dict[tuple[str, str], list[tuple[list[float], Any]]] = {}
        poses: dict[tuple[str, str], Any] = {}
        if isinstance(sensor, str):
            rows[sensor, ""], poses[sensor, ""] = [], None
        for detection in at_time:
            name = sensor if isinstance(sensor, str) else sensor(detection)
            pose, noise = own_model(detection, (sensors or {}).get(name))
            key = name, "" if pose is None else repr(pose)
            poses[key] = pose
            rows.setdefault(key, []).append((vector(detection).tolist(), None if noise is None else noise.tolist()))
        if len(rows) > 1 and isinstance(sensor, str) and not rows[sensor, ""]:
            del rows[sensor, ""]
        for key in sorted(rows):
            ordered = sorted(rows[key], key=repr) if any(noise for _, noise in rows[key]) else sorted(rows[key])
            made = Detections.of([z for z, _ in ordered])
            if any(noise is not None for _, noise in ordered):
                made = evolve(made, noise=_noises([noise for _, noise in ordered], key[0], sensors or {}))
            scans.append(Scan(seconds(time, start), key[0], made, poses[key]))
    return scans


def _noises(given: Sequence[Any], name: str, sensors: Mapping[str, Sensor]) -> Array:
    """Return the noise (k, m, m) of returns, the sensor's own where a detection states none."""
    sensor = sensors[name]
    usual = np.asarray(sensor.noise(np.zeros(len(sensor.observes))), dtype=float)
    return np.array([usual if noise is None else noise for noise in given], dtype=float)


def trajectories_of(paths: Iterable[Any], space: Space, start: datetime) -> tuple[Trajectory, ...]:
    """Return what is true, from ground-truth paths or a reader of them; `space` names the axes of their states in order.

    Two states of one time are one, the later one. Paths are named by their order in time and place.
    """
    whole: dict[int, Any] = {}
    for given in paths:
        for path in given[1] if isinstance(given, tuple) else (given,):
            whole[id(path)] = path
    scans = []
    for path in whole.values():
        by_time = {seconds(state.timestamp, start): vector(state) for state in path}
        times = sorted(by_time)
        scans.append((times, np.array([by_time[time] for time in times])))
    scans.sort(key=lambda one: (one[0], one[1].tolist()))
    for _, states in scans:
        if states.shape[-1] != len(space):
            raise InputError(
                f"ground truth has states of {states.shape[-1]} numbers, and its space {len(space)} axes: {space}"
            )
    return tuple(Trajectory(str(i + 1), space, np.array(times), states) for i, (times, states) in enumerate(scans))


@final
@frozen(eq=False)
class StoneSoupSource(Source):
    """Scans and truth from a detection reader, a simulator or lists of Stone Soup's.

    `detections` and `truth` are read when the source is opened: a generator only once, a reader each time anew.
    """

    kind: ClassVar[str] = "stonesoup"
    draws: ClassVar[bool] = False

    detections: Any = foreign("pairs of a time and a set of detections: a reader, a detector, a list")
    sensor: str | Namer = foreign("the tracker's name of the sensor, or a function that says it of a detection")
    truth: Any = foreign("ground-truth paths, or a reader of them; default: it is not known", default=())
    space: Space | None = fields.part("axes of the truth, in the order of its states", default=None)
    start: datetime | None = foreign("the time that is 0; default: that of the first detections", default=None)

    def open(self, sensors: Mapping[str, Sensor], rng: np.random.Generator) -> Recording:
        """Return all scans in time order. InputError where a scan is of other axes than its sensor's, or there is none."""
        pairs = sorted(((time, list(found)) for time, found in self.detections), key=lambda pair: pair[0])
        if not pairs:
            raise InputError("Stone Soup gives no detections")
        start = self.start or pairs[0][0]
        scans = scans_of(pairs, self.sensor, start, sensors)
        for scan in scans:
            if scan.sensor not in sensors:
                known = ", ".join(map(repr, sensors))
                raise ConfigError.at("sensor", f"{scan.sensor!r} is no sensor of the tracker; those are {known}")
            axes, z = sensors[scan.sensor].measurement, scan.detections.z
            if len(z) and z.shape[-1] != len(axes):
                raise InputError(f"Stone Soup's detections have {z.shape[-1]} numbers, and {scan.sensor!r} measures {axes}")
        if self.truth and self.space is None:
            raise ConfigError.at("space", "must name the axes of the truth, in the order of its states")
        truth = trajectories_of(self.truth, self.space, start) if self.space is not None else ()
        return Recording(tuple(scans), truth, notes={"start of times": start.isoformat()})


CONFIRMED, SECONDS = "vedette confirmed", "vedette s"
"""What the metadata of a state says: whether the track was confirmed, and the time, finer than a date's."""


def to_stonesoup(tracks: Sequence[Track], start: datetime) -> set[Any]:
    """Return Stone Soup's tracks, of Gaussian states, from Vedette's; their metrics and plotters take them.

    Its dates are whole microseconds, and it does not know of confirmation: the states' metadata have both, for `tracks_of`.
    """
    state, track = needed("stonesoup.types.state"), needed("stonesoup.types.track")
    made = set()
    for one in tracks:
        states = [
            state.GaussianState(mean, cov, timestamp=start + timedelta(seconds=time))
            for time, mean, cov in zip(one.times.tolist(), one.mean, one.cov, strict=True)
        ]
        there = track.Track(states, id=str(one.id))
        told = zip(one.confirmed.tolist(), one.times.tolist(), strict=True)
        there.metadatas = [{CONFIRMED: confirmed, SECONDS: time} for confirmed, time in told]
        made.add(there)
    return made


def tracks_of(tracks: Iterable[Any], space: Space, start: datetime) -> tuple[Track, ...]:
    """Return Vedette's tracks from Stone Soup's, whose states are over `space`; Vedette's metrics take them.

    Of several states of one time, a prediction and an update, the last counts. What Stone Soup does not keep is unknown: no
    return is said to be the track's, and every entry is confirmed, unless the track came from `to_stonesoup`. InputError if
    its states have another number of axes.
    """
    found = []
    for one in tracks:
        by_time = dict[float, tuple[Any, bool]]()
        metadatas = list(getattr(one, "metadatas", ()))[: len(one)]
        for state, told in zip(one, [*metadatas, *[{}] * (len(one) - len(metadatas))], strict=True):
            time, confirmed = seconds(state.timestamp, start), True
            if abs(told.get(SECONDS, np.inf) - time) <= MICROSECOND:
                time, confirmed = told[SECONDS], told[CONFIRMED]
            by_time[time] = state, confirmed
        times = sorted(by_time)
        mean = np.array([np.asarray(by_time[time][0].mean, dtype=float).ravel() for time in times])
        cov = np.array([np.asarray(by_time[time][0].covar, dtype=float) for time in times])
        if times and mean.shape[-1] != len(space):
            raise InputError(f"track {one.id!r} has states of {mean.shape[-1]} numbers, and its space {len(space)}: {space}")
        found.append((times, mean, cov, [by_time[time][1] for time in times]))
    found.sort(key=lambda one: (one[0], one[1].tolist()))
    return tuple(
        Track(
            id=i,
            space=space,
            times=np.array(times),
            mean=mean,
            cov=cov,
            confirmed=np.array(confirmed, dtype=bool),
            existence=np.ones(len(times)),
            mode_prob=None,
            weights=tuple(np.ones(1) for _ in times),
            nis=np.full(len(times), np.nan),
            hit=np.zeros(len(times)),
        )
        for i, (times, mean, cov, confirmed) in enumerate(found)
    )
