"""The states of the last seconds, from which late scans are taken: a tracker steps again from the state before them."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable
from typing import final

from attrs import define, field, frozen

from vedette.errors import ScanRefused
from vedette.tracking import State, Tracker, without_bad_returns
from vedette.types import Scan


@frozen(eq=False)
class Taken:
    """A scan that was taken, without its bad returns, and the state after it."""

    scan: Scan
    state: State


@final
@define(eq=False)
class Window:
    """Takes scans in order of time, whatever the order in which they come, if none is later than `horizon` s.

    It keeps the states within the horizon, at most `most`: a scan that is late by more is refused. What has left the horizon
    is settled: `settled` hands it out, in order, once. Equal times are in the order of the sensors' names.
    """

    tracker: Tracker
    start: State
    horizon: float
    most: int
    kept: list[Taken] = field(factory=list)
    before: State = field(init=False)
    latest: float = field(init=False)
    again: int = 0
    late: int = 0

    def __attrs_post_init__(self) -> None:
        self.before, self.latest = self.start, self.start.time

    @property
    def state(self) -> State:
        """The state after the latest scan."""
        return self.kept[-1].state if self.kept else self.before

    def take(self, scans: Iterable[Scan]) -> list[tuple[Scan, str]]:
        """Take scans; return those that are refused, each with the reason. What it holds of the others is not changed."""
        refused, usable = list[tuple[Scan, str]](), list[Scan]()
        for scan in scans:
            if scan.time < self.before.time or scan.time < self.latest - self.horizon:
                told = f"is {self.latest - scan.time:.6g} s late, more than the horizon of {self.horizon:g} s"
                refused.append((scan, f"time: {told}"))
            else:
                usable.append(scan)
        if usable:
            usable.sort(key=_order)
            at = bisect_right(self.kept, _order(usable[0]), key=lambda taken: _order(taken.scan))
            former = [taken.scan for taken in self.kept[at:]]
            self.late += sum(scan.time < self.latest for scan in usable)
            self.again += len(former)
            del self.kept[at:]
            for scan in sorted([*former, *usable], key=_order):  # the sort is stable: those of equal order stay as they came
                try:
                    self.kept.append(self._step(scan))
                except ScanRefused as error:
                    refused.append((scan, str(error)))
            self.latest = max(self.latest, self.state.time)
        return refused

    def _step(self, scan: Scan) -> Taken:
        """Return the scan and the state after it; a scan with bad returns is taken without them."""
        try:
            return Taken(scan, self.tracker.step(self.state, scan))
        except ScanRefused:
            kept, problems = without_bad_returns(scan)
            if not problems:
                raise
            return Taken(kept, self.tracker.step(self.state, kept))

    def settled(self, *, all_of_it: bool = False) -> list[Taken]:
        """Return what no late scan can change any more, and forget it but for the last state."""
        end = len(self.kept)
        if not all_of_it:
            oldest = self.latest - self.horizon
            end = next((i for i, taken in enumerate(self.kept) if taken.scan.time > oldest), end)
            end = max(end, len(self.kept) - self.most)
        done, self.kept = self.kept[:end], self.kept[end:]
        if done:
            self.before = done[-1].state
        return done


def _order(scan: Scan) -> tuple[float, str]:
    return scan.time, scan.sensor
