"""The states of the last seconds, from which late scans are taken: a tracker steps again from the state before them."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Iterator, Mapping, Sequence
from hashlib import blake2b
from itertools import groupby
from typing import final

from attrs import define, field, frozen

from vedette.errors import Problem, ScanRefused
from vedette.supporting import Preprocessor
from vedette.tracking import State, Tracker, preprocess, without_bad_returns
from vedette.types import Scan
from vedette_live.grouping import Formed

COPIES = 10_000
"""Latest scans of which copies are recognised: of a clock that stands still none would be forgotten."""

Copy = tuple[float, str, str]
"""What two copies of a scan have in common: time, sensor, and the hash of its returns."""
Refusals = list[tuple[Formed, str]]
"""Scans that cannot be taken, each with the reason."""


@frozen(eq=False)
class Taken:
    """A scan that the tracker took, without its bad returns; the raw ones that it was made of; the state after it."""

    scan: Scan
    formed: tuple[Formed, ...]
    state: State


@final
@define(eq=False)
class Window:
    """Takes scans in order of time, whatever the order in which they come, if none is later than `horizon` s.

    It keeps the states within the horizon, at most `most`: a scan that is late by more is refused, and one that comes again
    with the same returns. What has left the horizon is settled: `settled` hands it out, in order, once. Equal times are in
    the order of the sensors' names. A preprocessor gets all scans of one time together, however late one of them came.
    """

    tracker: Tracker
    start: State
    horizon: float
    most: int
    preprocessors: Mapping[str, Preprocessor] = field(factory=dict)
    kept: list[Taken] = field(factory=list)
    before: State = field(init=False)
    latest: float = field(init=False)
    came: dict[Copy, None] = field(factory=dict)
    flawed: list[tuple[tuple[Formed, ...], list[Problem]]] = field(factory=list)
    again: int = 0
    late: int = 0

    def __attrs_post_init__(self) -> None:
        self.before, self.latest = self.start, self.start.time

    @property
    def settled_copies(self) -> list[Copy]:
        """What a restart needs, beside the scans it keeps, to recognise those that may just be late enough to come again."""
        return [copy for copy in self.came if copy[0] <= self.before.time]

    @property
    def state(self) -> State:
        """The state after the latest scan."""
        return self.kept[-1].state if self.kept else self.before

    def take(self, formed: Iterable[Formed]) -> Refusals:
        """Take scans; return those that are refused, each with the reason. What it holds of the others is not changed.

        `flawed` then holds the scans that were stepped without bad returns, these or former ones, and what was wrong.
        """
        self.flawed.clear()
        refused, usable = Refusals(), list[Formed]()
        latest = self.latest
        for one in formed:  # as if each came alone: what is refused does not depend on which are taken together
            if one.scan.time < self.before.time or one.scan.time < latest - self.horizon:
                told = f"is {latest - one.scan.time:.6g} s late, more than the horizon of {self.horizon:g} s"
                refused.append((one, f"time: {told}"))
            elif (copy := _copy_of(one.scan)) in self.came:
                refused.append((one, "came already, with the same returns"))
            else:
                if copy is not None:
                    self.came[copy] = None
                usable.append(one)
                self.late += one.scan.time < latest
                latest = max(latest, one.scan.time)
        if usable:
            usable.sort(key=_order)
            at = self._place(usable[0].scan)
            former = [one for taken in self.kept[at:] for one in taken.formed]
            self.again += len(self.kept) - at
            del self.kept[at:]
            in_order = sorted([*former, *usable], key=_order)  # the sort is stable: those of equal order stay as they came
            for _, moment in groupby(in_order, key=lambda one: one.scan.time):
                for scan, of in self._made(list(moment), refused):
                    try:
                        self.kept.append(self._step(scan, of))
                    except ScanRefused as error:
                        refused += [(one, str(error)) for one in of]
            self.latest = max(self.latest, self.state.time)
        return refused

    def _place(self, first: Scan) -> int:
        """Return the place of the first scan that is to be taken again, or for the first time."""
        if self.preprocessors:
            return bisect_left(self.kept, first.time, key=lambda taken: taken.scan.time)
        return bisect_right(self.kept, _scan_order(first), key=lambda taken: _scan_order(taken.scan))

    def _made(self, moment: Sequence[Formed], refused: Refusals) -> Iterator[tuple[Scan, tuple[Formed, ...]]]:
        """Yield the tracker's scans of one time, each with the raw ones that it was made of."""
        if not self.preprocessors:
            yield from ((one.scan, (one,)) for one in moment)
            return
        problems, raw = list[Problem](), {id(one.scan): one for one in moment}
        try:
            made = list(preprocess([one.scan for one in moment], self.preprocessors, problems, strict=False))
        except Exception as error:  # a plugin's: it costs these scans, not the service
            refused += [(one, f"preprocessors: {type(error).__name__}: {error}") for one in moment]
            return
        for scan in made:
            plain = raw.pop(id(scan), None)
            takes = () if plain is not None else self.preprocessors[scan.sensor].sensors
            of = [key for key, one in raw.items() if one.scan.sensor in takes]
            yield scan, (plain,) if plain is not None else tuple(raw.pop(key) for key in of)
        if problems and not raw:
            self.flawed.append((tuple(moment), problems))
        refused += [(one, "; ".join(map(str, problems)) or "no scan was made of it") for one in raw.values()]

    def _step(self, scan: Scan, formed: tuple[Formed, ...]) -> Taken:
        """Return the scan and the state after it; a scan with bad returns is taken without them."""
        try:
            return Taken(scan, formed, self.tracker.step(self.state, scan))
        except ScanRefused:
            kept, problems = without_bad_returns(scan)
            if not problems:
                raise
            self.flawed.append((formed, problems))
            return Taken(kept, formed, self.tracker.step(self.state, kept))

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
            came = [copy for copy in self.came if copy[0] >= self.before.time]
            self.came = dict.fromkeys(came[-COPIES:])
        return done


def _copy_of(scan: Scan) -> Copy | None:
    """Return what two copies of a scan have in common; None of one without returns, which may well be like another."""
    z = scan.detections.z
    return (scan.time, scan.sensor, blake2b(z.tobytes(), digest_size=16).hexdigest()) if len(z) else None


def _order(one: Formed) -> tuple[float, str]:
    return _scan_order(one.scan)


def _scan_order(scan: Scan) -> tuple[float, str]:
    return scan.time, scan.sensor
