"""A table as it is read: what the returns of each sensor show, the chains of targets among them, and their noise."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from math import log, sqrt
from typing import Any

import numpy as np
from attrs import evolve, frozen

from vedette.config import load
from vedette.experiment import Experiment
from vedette.space import Array
from vedette.tracking import preprocess, take
from vedette.types import Recording, Scan
from vedette_files import CsvSource
from vedette_standard import GroupedReturns
from vedette_tools.drafting.chains import Chain, unbroken
from vedette_tools.drafting.noise import Noise, Windows, estimated, loglik
from vedette_tools.drafting.seen import Seen, follow, usual_speed
from vedette_tools.drafting.table import Table

MOST_SCANS = 1500
"""So many scans of a sensor tell its noise."""

JUMP = 3.5
"""A second difference of so many usual ones is taken as a jump to another target: noise alone makes one in 5,000."""

SURER, REPORTED = 0.1, 5.0
"""m: the least and the largest deviation along an axis of positions which objects report of themselves; what would look like
a larger one, as a jitter of their times, is motion. Chosen by hand, seen on one recording of aircraft."""

LARGER = 3.0
"""Errors that are so many times as large as the second differences of returns tell are doubted. By hand, on one storm."""

TRACKER: dict[str, Any] = {
    "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 1.0}},
    "associator": {"kind": "jpda"},
    "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
    "lifecycle": {"kind": "existence"},
}


def read(table: Table) -> Reading:
    return Reading.of(table, opened(table))


def opened(table: Table) -> Recording:
    experiment = _experiment(table)
    sensors, source = experiment.tracker.sensors, experiment.source
    assert isinstance(source, CsvSource)
    if table.frame_table is not None:
        recording = source.open_frame(table.frame_table.frame, sensors)
    else:
        recording = source.open(sensors, np.random.default_rng(0))
    if not table.links:
        return recording
    groups = {name: GroupedReturns({name: sensors[name]}, link) for name, link in table.links.items()}
    return evolve(recording, scans=tuple(preprocess(recording.scans, groups, [], strict=False)))


def _experiment(table: Table) -> Experiment:
    parts = dict(TRACKER)
    if table.upward:
        motion = {"kind": "constant_velocity", "sigma_accel": 1.0, "axes": ["x", "y", "z"]}
        parts |= {
            "estimator": {"kind": "ekf", "motion": motion},
            "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0, "vz": 10.0}},
        }
    return load(parts | {"sensors": {name: table.of(name).sensor() for name in table.sensors}, "source": table.source()})


@frozen(eq=False)
class Reading:
    """One way to read a table: what it gives, what each sensor's returns show, and their noise."""

    table: Table
    recording: Recording
    seen: dict[str, Seen]
    noise: dict[str, Noise]

    @classmethod
    def of(cls, table: Table, recording: Recording) -> Reading:
        """Read it."""
        seen = {name: _of_targets(table.of(name), each) for name, each in _seen(table, recording).items()}
        return cls(table, recording, seen, {name: _noise(table.of(name), sensor) for name, sensor in seen.items()})

    @property
    def followed(self) -> int:
        """How many returns the chains hold."""
        return sum(len(chain.times) for seen in self.seen.values() for chain in seen.chains)

    @property
    def returns(self) -> int:
        """How many returns the sensors gave in the scans that were looked at."""
        return sum(len(places) for seen in self.seen.values() for places in seen.spots)

    @property
    def lone(self) -> bool:
        """Whether there is one return at a time."""
        return len(self.seen) == 1 and all(len(places) <= 1 for seen in self.seen.values() for places in seen.spots)

    @property
    def evidence(self) -> float:
        """How likely the returns are so: those that no chain holds lie anywhere."""
        loose = [(count, seen) for seen in self.seen.values() if (count := _loose(seen))]
        return sum(noise.evidence for noise in self.noise.values()) - sum(count * log(_area(seen)) for count, seen in loose)


def _seen(table: Table, recording: Recording) -> dict[str, Seen]:
    sensors = _experiment(table).tracker.sensors
    by_sensor = {}
    for name, sensor in sensors.items():
        scans = [scan for scan in recording.scans if scan.sensor == name][:MOST_SCANS]
        if scans:
            codes = [scan.detections.identity for scan in scans if scan.detections.identity is not None]
            place = np.array(table.stands.get(name, (0.0, 0.0)))
            stands = np.array([place if scan.pose is None else scan.pose.position[:2] for scan in scans])
            times = np.array([scan.time for scan in scans])
            places = tuple(sensor.placed(scan.pose).invert(scan.detections.z).mean[..., :2] for scan in scans)
            named = np.concatenate(codes) if codes else None
            followed = follow(
                times, places, stands, named, partial(_likely, table.of(name)), reported=table.of(name).reported
            )
            followed = evolve(followed, chains=tuple(_timed(chain, scans) for chain in followed.chains))
            thirds = tuple(scan.detections.z[:, 2] for scan in scans) if table.of(name).third else ()
            by_sensor[name] = evolve(followed, thirds=thirds)
    return by_sensor


def midst(table: Table, scans: Sequence[Scan], most: int) -> list[Scan]:
    """Return scans with their returns in a square around the usual place, as wide as holds so many of all."""
    sensors = _experiment(table).tracker.sensors
    places = [sensors[scan.sensor].placed(scan.pose).invert(scan.detections.z).mean[..., :2] for scan in scans]
    every = np.concatenate(places)
    around = every[np.nanargmin(np.linalg.norm(every - np.nanmedian(every, axis=0), axis=-1))]
    off = [np.max(np.abs(each - around), axis=-1) for each in places]
    reach = np.sort(np.concatenate(off))[min(most, len(every)) - 1]
    inside = zip(scans, off, strict=True)
    return [evolve(scan, detections=take(scan.detections, each <= reach, 0)) for scan, each in inside]


def _timed(chain: Chain, scans: Sequence[Scan]) -> Chain:
    """Return a chain at its returns' own times, where they have such."""
    times = [scans[i].detections.time for i in chain.scans.tolist()]
    told = [chain.times[i] if each is None else each[chain.returns[i]] for i, each in enumerate(times)]
    return evolve(chain, times=np.array(told)) if np.all(np.diff(told) > 0) else chain


def _noise(table: Table, seen: Seen) -> Noise:
    """Return the noise of one sensor and the targets that it saw; a guess by the extent if it shows none."""
    speed = usual_speed([seen])
    apart = [places - stand for places, stand in zip(seen.spots, seen.stands, strict=True)]
    far = float(np.median(np.linalg.norm(np.concatenate(apart), axis=-1))) if len(np.concatenate(apart)) else 1e3
    sigma = max(seen.error if seen.chains else far / 100, 1e-9)
    guess = (sigma, sigma / max(far, 1e-6)) if table.polar else (sigma,)
    if not seen.chains:
        return Noise(guess, 0.05 * speed / seen.period)
    windows = _windows(table, seen, [piece for chain in seen.chains for piece in unbroken(chain, JUMP * seen.rough)])
    low, high = (SURER, REPORTED) if table.reported else (0.0, np.inf)
    least = np.maximum(low, table.floors)
    most = np.maximum(high, 4.0 * least)
    start = (*np.clip(guess, 2 * least, most / 2).tolist(), 0.05 * speed / seen.period)  # where both ways change something

    def free(sigmas: Array) -> Array:
        return _along_lines(table, np.clip(sigmas, least, most))

    noise = estimated(windows, start, speed, free)
    if noise.sensor[0] > LARGER * guess[0]:  # its targets turn from return to return: what looks like errors is motion
        sharp = estimated(windows, (*start[:-1], speed / sqrt(seen.period)), speed, free)
        noise = max(noise, sharp, key=lambda each: each.evidence)
    return evolve(noise, sensor=tuple(np.clip(noise.sensor, least, most).tolist()))


def _windows(table: Table, seen: Seen, pieces: Sequence[Chain]) -> Windows:
    lines = []
    for chain in pieces:
        line = np.tile(np.eye(2), (len(chain.times), 1, 1))
        if table.polar:
            along = chain.spots - seen.stands[chain.scans]
            r = np.maximum(np.linalg.norm(along, axis=-1), 1e-9)
            line[..., 0] = along / r[:, None]
            line[..., 1] = np.stack([-along[:, 1], along[:, 0]], axis=-1)
        lines.append(line)
    return Windows.of(pieces, lines)


def _along_lines(table: Table, sigmas: Array) -> Array:
    return sigmas if table.polar else np.repeat(sigmas, 2)


def _of_targets(table: Table, seen: Seen) -> Seen:
    """Return what a sensor shows without the chains that returns of no target make by chance: they would pass for noise."""
    loose = _loose(seen)
    return _likely(table, seen, loose) if loose >= len(seen.times) else seen


def _loose(seen: Seen) -> int:
    """Return how many returns no chain holds."""
    return sum(map(len, seen.spots)) - sum(len(chain.times) for chain in seen.chains)


def _area(seen: Seen) -> float:
    """Return the area in m^2 that returns lie in."""
    return float(np.prod(np.maximum(np.ptp(np.percentile(np.concatenate(seen.spots), [1, 99], axis=0), axis=0), 1e-9)))


def _likely(table: Table, seen: Seen, loose: int) -> Seen:
    """Return what a sensor shows without the chains that are no likelier than returns anywhere, of which `loose` are so.

    With the noise of the longest chains, those of targets are likelier (the track score of Sittler, 1964), looks without a
    return counted, by more than one in all returns is by chance.
    """
    if len(seen.chains) < 2 or loose <= 0:
        return seen
    longest = max(len(chain.times) for chain in seen.chains)
    sure = evolve(seen, chains=tuple(chain for chain in seen.chains if 2 * len(chain.times) >= longest))
    noise, speed = _noise(table, sure), usual_speed([sure])
    sigmas = _along_lines(table, np.array(noise.sensor))
    anywhere = log(loose / len(seen.times) / _area(seen))

    def score(chain: Chain) -> float:
        looks = _in_looks(len(chain.times), chain.looks)
        return loglik(_windows(table, seen, [chain]), sigmas, noise.accel, speed) + looks - (len(chain.times) - 1) * anywhere

    kept = tuple(chain for chain in seen.chains if score(chain) > log(sum(map(len, seen.spots))))
    return evolve(seen, chains=kept) if kept else sure


def _in_looks(hits: int, looks: int) -> float:
    """Return how likely it is, in logarithms, that just these looks have a return, if as many do."""
    return sum(count * log(count / looks) for count in (hits, looks - hits) if count)
