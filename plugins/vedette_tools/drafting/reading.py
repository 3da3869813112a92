"""A table as it is read: what the returns of each sensor show, the chains of targets among them, and their noise."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import log
from typing import Any

import numpy as np
from attrs import evolve, frozen

from vedette.config import load
from vedette.experiment import Experiment
from vedette.space import Array, Indices
from vedette.types import Recording, Scan
from vedette_files import CsvSource
from vedette_tools.drafting.chains import LEAST, START, Chain, chains, spacing, unbroken
from vedette_tools.drafting.noise import Noise, Windows, estimated, loglik
from vedette_tools.drafting.reports import in_turn, of_owners
from vedette_tools.drafting.several import FLAT
from vedette_tools.drafting.table import Table

MOST_SCANS = 1500
"""So many scans of a sensor tell its noise."""

JUMP = 3.5
"""A second difference of so many usual ones is taken as a jump to another target: noise alone makes one in 5,000."""

ALL = 0.5
"""Targets that give returns in fewer of the scans than this report in turn."""

TOGETHER, MOST_REPORTS = 3.0, 6000
"""Where more returns come at a time, they are a look at all targets; of what objects report, so many are followed."""

LOOSE = 0.1
"""Where chains leave more returns than this part, some are false, and the tighter chains are believed. By hand."""

NOISELESS = 0.1
"""Velocities are told by returns of which the errors make less than this part of their mean square."""

SURER, REPORTED = 0.1, 5.0
"""m: the least and the largest deviation along an axis of positions which objects report of themselves; what would look like
a larger one, as a jitter of their times, is motion. Chosen by hand, seen on one recording of aircraft."""

FORGETTING = 100
"""A target whose course is as good as straight is still drafted with process noise that is felt after so many scans."""

TRACKER: dict[str, Any] = {
    "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 1.0}},
    "associator": {"kind": "jpda"},
    "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
    "lifecycle": {"kind": "existence"},
}


@frozen(eq=False)
class Seen:
    """What one sensor's returns show: its scans' times, the positions of its returns, where it stood, the chains, and what
    else it measured.
    """

    times: Array
    spots: tuple[Array, ...]
    stands: Array
    chains: tuple[Chain, ...]
    thirds: tuple[Array, ...] = ()

    @property
    def in_turn(self) -> bool:
        """Whether a scan is a look at a few targets only."""
        looks = sum(chain.looks for chain in self.chains)
        return sum(len(chain.times) for chain in self.chains) < ALL * looks

    @property
    def pieces(self) -> int:
        """How many chains there are, and returns in none: as many targets or false returns it takes to explain all."""
        return len(self.chains) + sum(map(len, self.spots)) - sum(len(chain.times) for chain in self.chains)

    @property
    def rough(self) -> float:
        """The usual second difference along the chains, in m; inf without any."""
        seconds = [np.linalg.norm(np.diff(chain.spots, 2, axis=0), axis=-1) for chain in self.chains]
        return float(np.median(np.concatenate(seconds))) if seconds else np.inf

    @property
    def period(self) -> float:
        """The usual time between scans, in s, or between reports of a target; 1 for a single one."""
        if self.in_turn:
            return float(np.median(np.concatenate([np.diff(chain.times) for chain in self.chains])))
        return float(np.median(np.diff(np.unique(self.times)))) if len(self.times) > 1 else 1.0

    @property
    def least_accel(self) -> float:
        """Return the acceleration noise, m/s^2, that moves a target by the sensor's own error in `FORGETTING` scans.

        Over t s that is accel t^1.5 / sqrt(3). With less, the filter believes its prediction for ever.
        """
        return float(np.sqrt(3) * self.error / (FORGETTING * self.period) ** 1.5) if self.chains else 0.0

    @property
    def least_felt(self) -> float:
        """The acceleration noise that moves a target, over the longest chain, as far as so many returns tell its place.

        With less, the data themselves do not tell it from none; with more, targets that keep their courses are doubted.
        """
        longest = max(chain.looks for chain in self.chains)
        return self.least_accel * float((FORGETTING / longest) ** 1.5 / np.sqrt(longest))

    @property
    def error(self) -> float:
        """The error of a return along an axis, in m, by the usual second difference, whose median is 2.9 times that."""
        return self.rough / 2.9


def read(table: Table) -> Reading:
    return Reading.of(table, opened(table))


def opened(table: Table) -> Recording:
    experiment = _experiment(table)
    sensors, source = experiment.tracker.sensors, experiment.source
    assert isinstance(source, CsvSource)
    if table.frame_table is not None:
        return source.open_frame(table.frame_table.frame, sensors)
    return source.open(sensors, np.random.default_rng(0))


def _experiment(table: Table) -> Experiment:
    parts = dict(TRACKER)
    if table.third and not table.polar:
        motion = {"kind": "constant_velocity", "sigma_accel": 1.0, "axes": ["x", "y", "z"]}
        parts |= {
            "estimator": {"kind": "ekf", "motion": motion},
            "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0, "vz": 10.0}},
        }
    return load(parts | {"sensors": {name: _sensor(table.of(name)) for name in table.sensors}, "source": table.source()})


def _sensor(table: Table) -> dict[str, Any]:
    """Return the config of a sensor whose errors are not known yet."""
    polar: dict[str, Any] = {"sigma_range": 1.0, "sigma_bearing": 1e-3}
    polar |= dict(zip(FLAT, table.stands[table.sensors[0]], strict=True)) if table.sensors[0] in table.stands else {}
    if table.third == "range_rate":
        return {"kind": "range_bearing_rate", **polar, "sigma_rate": 1.0}
    if table.polar:
        return {"kind": "range_bearing", **polar}
    if table.third:
        return {"kind": "linear", "axes": ["x", "y", "z"], "R": np.eye(3).tolist()}
    return {"kind": "cartesian_position", "sigma": 1.0}


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
        """How likely the returns are so."""
        return sum(noise.evidence for noise in self.noise.values())


def _seen(table: Table, recording: Recording) -> dict[str, Seen]:
    sensors = _experiment(table).tracker.sensors
    by_sensor = {}
    for name, sensor in sensors.items():
        scans = [scan for scan in recording.scans if scan.sensor == name][:MOST_SCANS]

        def spots(scan: Scan) -> Array:
            placed = sensor if scan.pose is None else sensor.at(scan.pose)  # noqa: B023
            return placed.invert(scan.detections.z).mean[..., :2]

        if scans:
            codes = [scan.detections.identity for scan in scans if scan.detections.identity is not None]
            place = np.array(table.stands.get(name, (0.0, 0.0)))
            stands = np.array([place if scan.pose is None else scan.pose.position[:2] for scan in scans])
            times, places = np.array([scan.time for scan in scans]), tuple(map(spots, scans))
            named = np.concatenate(codes) if codes else None
            followed = _followed(times, places, stands, named, reported=table.of(name).reported)
            followed = evolve(followed, chains=tuple(_timed(chain, scans) for chain in followed.chains))
            thirds = tuple(scan.detections.z[:, 2] for scan in scans) if table.of(name).third else ()
            by_sensor[name] = evolve(followed, thirds=thirds)
    return by_sensor


def _timed(chain: Chain, scans: Sequence[Scan]) -> Chain:
    """Return a chain at its returns' own times, where they have such."""
    times = [scans[i].detections.time for i in chain.scans.tolist()]
    told = [chain.times[i] if each is None else each[chain.returns[i]] for i, each in enumerate(times)]
    return evolve(chain, times=np.array(told)) if np.all(np.diff(told) > 0) else chain


def _followed(
    times: Array, spots: tuple[Array, ...], stands: Array, named: Indices | None = None, *, reported: bool = False
) -> Seen:
    """Follow the returns by the names of their objects (n,), if they have any.

    Else twice, first within what their spacing allows, then within what the first time showed, unless that only cuts chains
    where targets turn; or one by one in time, if few come at once, and more can be followed so, or more steadily. What is
    `reported` by the objects comes one by one unless that follows less than half as much.
    """
    if named is not None and np.any(named >= 0):
        return Seen(times, spots, stands, tuple(of_owners(times, spots, named)))
    width = spacing(spots)
    seen = Seen(times, spots, stands, tuple(chains(times, spots, width)))
    if seen.chains:
        # a target may be fast and its returns precise: it still moves as far between two
        narrow = min(width, 4.0 * max(seen.rough, 1e-6))
        tight = evolve(seen, chains=tuple(chains(times, spots, narrow, START * width)) or seen.chains)
        seen = tight if tight.pieces <= seen.pieces or seen.pieces > LOOSE * sum(map(len, spots)) else seen
    first = int(np.searchsorted(np.cumsum([len(places) for places in spots]), MOST_REPORTS, side="right"))
    count, held = sum(map(len, spots[:first])), sum(int(np.sum(chain.scans < first)) for chain in seen.chains)
    few = count < TOGETHER * first
    if count >= LEAST:
        single = evolve(seen, chains=tuple(in_turn(times[:first], spots[:first])))
        more = sum(len(chain.times) for chain in single.chains) - held
        least = -0.2 * count if few else 0.8 * count - held  # false returns of scans make no steady chains
        steadier = more > least and single.rough < 0.5 * seen.rough
        if steadier or ((few or reported) and more > 0.1 * count) or (reported and few and more > -0.5 * held):
            return single
    return seen


def usual_speed(seen: Iterable[Seen]) -> float:
    """Return how fast targets move along an axis, in m/s, where they do; a guess without any chain.

    Between returns so far apart in time that the errors of their positions hardly count, and no farther: they may turn.
    """
    paces = [np.abs(_paces(chain, each.error)) for each in seen for chain in each.chains]
    every = np.concatenate(paces) if paces else np.full(1, 10.0)
    fast = np.percentile(every, 99)  # a return under a wrong name would be faster than all that is tracked
    return max(float(np.sqrt(np.mean(np.minimum(every, fast) ** 2))), 0.5 * float(np.percentile(every, 95)), 1e-3)


def _paces(chain: Chain, error: float) -> Array:
    """Return the velocities (s, 2) along a chain."""
    for lag in (2**i for i in range(len(chain.times).bit_length())):
        if lag >= len(chain.times):
            break
        dt = (chain.times[lag:] - chain.times[:-lag])[:, None]
        paces: Array = (chain.spots[lag:] - chain.spots[:-lag]) / dt
        if np.mean(2.0 * (error / dt) ** 2) < NOISELESS * np.mean(paces**2):
            return paces
    net: Array = (chain.spots[-1:] - chain.spots[:1]) / (chain.times[-1] - chain.times[0])
    return net


def _noise(table: Table, seen: Seen) -> Noise:
    """Return the noise of one sensor and the targets that it saw; a guess by the extent if it shows none."""
    speed = usual_speed([seen])
    apart = [places - stand for places, stand in zip(seen.spots, seen.stands, strict=True)]
    far = float(np.median(np.linalg.norm(np.concatenate(apart), axis=-1))) if len(np.concatenate(apart)) else 1e3
    sigma = max(seen.error if seen.chains else far / 100, 1e-6)
    guess = (sigma, sigma / max(far, 1e-6)) if table.polar else (sigma,)
    if not seen.chains:
        return Noise(guess, 0.05 * speed / seen.period)
    windows = _windows(table, seen, [piece for chain in seen.chains for piece in unbroken(chain, JUMP * seen.rough)])
    least, most = (SURER, REPORTED) if table.reported else (0.0, np.inf)
    start = (*np.clip(guess, 2 * least, most / 2).tolist(), 0.05 * speed / seen.period)  # where both ways change something
    noise = estimated(windows, start, speed, lambda sigmas: _along_lines(table, np.clip(sigmas, least, most)))
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
    """Return what a sensor shows without the chains that returns of no target make by chance: they would pass for noise.

    With the noise of the longest chains, those of targets are likelier than returns anywhere (the track score of Sittler,
    1964), by more than one in all returns is by chance.
    """
    every = np.concatenate(seen.spots) if seen.spots else np.zeros((0, 2))
    loose = len(every) - sum(len(chain.times) for chain in seen.chains)
    if len(seen.chains) < 2 or loose < len(seen.times):
        return seen
    longest = max(len(chain.times) for chain in seen.chains)
    sure = evolve(seen, chains=tuple(chain for chain in seen.chains if 2 * len(chain.times) >= longest))
    noise, speed = _noise(table, sure), usual_speed([sure])
    sigmas = _along_lines(table, np.array(noise.sensor))
    area = float(np.prod(np.maximum(np.ptp(np.percentile(every, [1, 99], axis=0), axis=0), 1e-9)))
    anywhere = log(loose / len(seen.times) / area)

    def score(chain: Chain) -> float:
        return loglik(_windows(table, seen, [chain]), sigmas, noise.accel, speed) - (len(chain.times) - 1) * anywhere

    kept = tuple(chain for chain in seen.chains if score(chain) > log(len(every)))
    return evolve(seen, chains=kept) if kept else sure
