"""The input of a run: scans and returns of each sensor, what was refused, and what looks odd about them.

It holds counts only, so it stays as small in a run of a day as in one of a minute.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any, final

import numpy as np
from attrs import define, evolve, field, fields

from vedette.errors import LATE, InputError, Problem
from vedette.roles import Sensor
from vedette.space import Array
from vedette.tracking import state_data
from vedette.tracking.identity import strayed
from vedette.tracking.state import State
from vedette.types import Scan

_LOOKED = 200
"""Number of scans with returns that are checked against the sensor's reach: the first of each sensor."""


@final
@define
class Refused:
    """What was left out: the first `most` of it, by default all; how often, and `late`, how often a time went back."""

    most: float = math.inf
    late: int = 0
    first: list[Problem] = field(factory=list)
    count: int = 0

    def extend(self, problems: Iterable[Problem]) -> None:
        """Add to what was left out."""
        for problem in problems:
            self.count += 1
            self.late += problem.kind == LATE
            if len(self.first) < self.most:
                self.first.append(problem)

    def limit(self, most: int) -> None:
        """Name no more than this."""
        self.most = most
        del self.first[most:]


@final
@define
class Came:
    """The input of one sensor: number of scans, frames among them, returns, and how many of `looked` were out of its reach.

    `same_time`: scans at the very time of the one before; `largest` (m,): the largest size of each measured component.
    """

    scans: int = 0
    frames: int = 0
    returns: int = 0
    same_time: int = 0
    looked: int = 0
    out_of_reach: int = 0
    largest: Array = field(factory=lambda: np.zeros(0))
    _last: float = -math.inf
    _looks: int = 0

    def add(self, scan: Scan, sensor: Sensor | None) -> None:
        """Count one scan that was taken."""
        self.scans += 1
        self.same_time += scan.time == self._last
        self._last = scan.time
        if scan.frame is not None:
            self.frames += 1
            return
        seen = scan.detections
        count = int(np.count_nonzero(seen.valid))
        if not count:
            return
        self.returns += count
        known = seen.valid[..., None] if seen.missing is None else seen.valid[..., None] & ~seen.missing
        size = np.abs(np.where(known, seen.z, 0.0)).reshape(-1, seen.z.shape[-1]).max(axis=0)
        self.largest = size if not self.largest.size else np.maximum(self.largest, size)
        if sensor is not None and self._looks < _LOOKED and seen.missing is None:
            self._looks += 1
            self._ask_for_reach(scan, sensor)

    def _ask_for_reach(self, scan: Scan, sensor: Sensor) -> None:
        """Count the returns in places where the sensor states that it detects nothing."""
        seen = scan.detections
        placed = sensor.placed(scan.pose)
        try:
            spot = placed.invert(seen.z[seen.valid], seen.noise_of(seen.valid)).mean
        except NotImplementedError:
            self._looks = _LOOKED
            return
        detects = np.broadcast_to(placed.detects(spot), spot.shape[:-1])
        self.looked += detects.size
        self.out_of_reach += int(np.count_nonzero(detects == 0))


@final
@define
class Intake:
    """The input of one run over `sensors`, the tracker's.

    `times`: of the first and of the last scan taken; `tracked`: scans with returns while there were tracks; `hits`: those
    of them in which some track took a return; `doubted`: frames after which a confirmed track's existence is below one
    half, as its target is lost; `lost`: number of such tracks after the last frame; `outside`:
    returns of a code that a track bears, which it did not take.
    """

    sensors: Mapping[str, Sensor]
    refused: Refused = field(factory=Refused)
    came: dict[str, Came] = field(factory=dict)
    times: tuple[float, float] | None = None
    scans: int = 0
    tracked: int = 0
    hits: int = 0
    doubted: int = 0
    lost: int = 0
    outside: int = 0

    @property
    def returns(self) -> int:
        """Number of returns."""
        return sum(came.returns for came in self.came.values())

    @property
    def frames(self) -> int:
        """Number of camera frames."""
        return sum(came.frames for came in self.came.values())

    @classmethod
    def of(cls, sensors: Mapping[str, Sensor], scans: Iterable[Scan], refused: Iterable[Problem] = ()) -> Intake:
        """Count scans that were taken, whatever the tracks made of them."""
        intake = cls(sensors)
        intake.refused.extend(refused)
        for scan in scans:
            intake._count(scan)
        return intake

    def add(self, scan: Scan, before: State, after: State) -> None:
        """Count one scan that was taken, by the states before and after it."""
        self._count(scan)
        if len(before.ids) and after.distances.shape[-1]:
            self.tracked += 1
            # a target's first frame only shows what it looks like
            self.hits += bool(np.any((after.hit[after.ids < before.born] if scan.frame is None else after.nis) > 0))
            self.outside += _outside(scan, before, after)
        if scan.frame is not None:
            self.lost = int(np.count_nonzero(after.confirmed & (after.existence < 0.5)))
            self.doubted += self.lost > 0

    def to_data(self) -> Any:
        """Return the counts as plain data."""
        first: Any = tuple(self.refused.first)
        return state_data.to_data(evolve(self, sensors={}, refused=evolve(self.refused, first=first)))

    def restore(self, data: Any) -> None:
        """Take the counts that `to_data` wrote in place of one's own; InputError if they are none."""
        known = {state_data.name_of(cls): cls for cls in (Intake, Refused, Came, Problem)}
        try:
            counts = state_data.from_data(data, known, "intake")
            refused = evolve(counts.refused, first=list(counts.refused.first))
            if not all(isinstance(part, Came) for part in counts.came.values()) or not isinstance(counts.scans + 0, int):
                raise TypeError("counts are whole numbers")
        except (AttributeError, TypeError) as error:
            raise InputError(f"intake: cannot be read: {error}") from None
        for own, other in ((self.refused, refused), (self, evolve(counts, sensors=self.sensors, refused=self.refused))):
            for part in fields(type(own)):
                setattr(own, part.name, getattr(other, part.name))

    def _count(self, scan: Scan) -> None:
        self.scans += 1
        self.times = (scan.time if self.times is None else self.times[0], scan.time)
        self.came.setdefault(scan.sensor, Came()).add(scan, self.sensors.get(scan.sensor))


def _outside(scan: Scan, before: State, after: State) -> int:
    """Return how many returns of a scan bear a code of a track that none took: it is wrong, or the track is."""
    codes, names = scan.detections.identity, before.names
    if codes is None or names is None or codes.ndim > 1:
        return 0
    if after.returns is None:
        claims: Array = np.sum(after.weights[..., 1:], axis=0)
    else:
        there = after.returns >= 0
        claims = np.bincount(after.returns[there], after.weights[:, 1:][there], len(codes)).astype(float)
    return int(np.count_nonzero(strayed(names, codes, claims)))
