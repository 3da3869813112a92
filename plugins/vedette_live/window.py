"""The states of the last seconds, from which late scans are taken: a tracker steps again from the state before them."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections import OrderedDict, deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import groupby
from typing import final

from attrs import define, evolve, field, frozen

from vedette.errors import Problem, ScanRefused
from vedette.supporting import Preprocessor
from vedette.tracking import State, Tracker, preprocess, without_bad_returns
from vedette.types import Scan
from vedette_live.grouping import CAME, COPIES, Formed
from vedette_live.setback import BACK, Row

LATER = 10.0
"""s by which a copy of a message may come later than its scan may: in scans of several, it would be in the next one."""
LEAP = BACK
"""s between two scans from which the later one may be wrong."""
HEARD = 3600.0
"""s after its last scan from which a sensor is out of service, and no clock is right by it any more: by hand."""
AGREE = 5
"""Late scans of other times that gainsay a leap which fewer scans bear out: by hand."""
GAINSAYING = 1000
"""Late scans, the latest, that are laid against a leap."""
Refusals = list[tuple[Formed, str]]
"""Scans that cannot be taken, each with the reason."""


@frozen(eq=False)
class Taken:
    """A scan that the tracker took, without its bad returns; the raw ones that it was made of; the state after it."""

    scan: Scan
    formed: tuple[Formed, ...]
    state: State


@frozen(eq=False)
class Leap:
    """A step far ahead: the state before it, the time and the sensors of the scans since."""

    before: State
    time: float
    sensors: frozenset[str]


@final
@define(eq=False)
class Window:
    """Takes scans in order of time, whatever the order in which they come, if none is later than `horizon` s.

    It keeps the states within the horizon, at most `most`: a scan that is late by more is refused, and one of messages that
    all `came`; that tells their scans' times. What has left the horizon is settled: `settled` hands it out, in order, once.
    Equal times are in the order of the sensors' names. A preprocessor gets all scans of one time together, however late one
    of them came.

    One wrong time far ahead would make all that follow too late. So where late scans of all sensors, those of the scans
    after a leap too, are of the time that was leapt, and more than those, the latter are given up.

    Where a row of late scans, of all sensors that were `heard` of late, comes as from clocks that were set back, `set_back`
    says so: those that follow, `left`, want a window of their own. One sensor alone is late.
    """

    tracker: Tracker
    start: State
    horizon: float
    most: int
    preprocessors: Mapping[str, Preprocessor] = field(factory=dict)
    kept: list[Taken] = field(factory=list)
    before: State = field(init=False)
    latest: float = field(init=False)
    came: OrderedDict[str, float] = field(factory=OrderedDict)
    flawed: list[tuple[tuple[Formed, ...], list[Problem]]] = field(factory=list)
    again: int = 0
    late: int = 0
    ahead: str = ""
    leap: Leap | None = None
    gave_up: str = ""
    heard: dict[str, float] = field(factory=dict)
    set_back: str = ""
    left: list[Formed] = field(factory=list)
    _behind: dict[tuple[float, str], None] = field(factory=dict)
    _row: Row = field(factory=Row)

    def __attrs_post_init__(self) -> None:
        self.before, self.latest = self.start, self.start.time

    @property
    def state(self) -> State:
        """The state after the latest scan."""
        return self.kept[-1].state if self.kept else self.before

    def take(self, formed: Iterable[Formed]) -> Refusals:
        """Take scans; return those that are refused, each with the reason. What it holds of the others is not changed.

        `flawed` then holds the scans that were stepped without bad returns, these or former ones, and what was wrong;
        `gave_up` what was wrong with the scans that were given up, "" if none was.
        """
        self.flawed.clear()
        self.gave_up = ""
        refused, waiting = Refusals(), deque(formed)
        while waiting and not self.set_back:
            self._step_all(self._usable(waiting, refused), refused)
            if self.leap is not None and self._gainsaid(self.leap):
                refused += self._give_up(self.leap)
        self.left = list(waiting)
        return refused

    def _usable(self, waiting: deque[Formed], refused: Refusals) -> list[Formed]:
        """Take from those that wait up to what may gainsay a leap; return those of them that are neither late nor copies.

        As if each came alone: what is refused does not depend on which are taken together.
        """
        usable, latest, ahead = list[Formed](), self.latest, self.ahead
        while waiting:
            one = waiting.popleft()
            time, sensor = one.scan.time, one.scan.sensor
            if time < self.before.time or time < latest - self.horizon:
                behind = f"behind the latest scan, of {ahead!r}" if ahead else "late"
                told = f"is {latest - time:.6g} s {behind}, more than the horizon of {self.horizon:g} s"
                refused.append((one, f"time: {told}"))
                self._behind[time, sensor] = None
                if len(self._behind) > GAINSAYING:
                    del self._behind[next(iter(self._behind))]
                if latest - time > BACK and self._row.add(time, one.arrived) and self._all_late(one.arrived):
                    self.set_back = f"the clocks of all sensors were set back, by {latest - time:.6g} s"
                if len(self._behind) >= AGREE or self.set_back:
                    break
            elif one.copies and all(copy in self.came for copy in one.copies):
                refused.append((one, CAME))
            else:
                self.came |= dict.fromkeys(one.copies, time)
                usable.append(one)
                self.heard[sensor], self._row = one.arrived, Row()
                self._behind.clear()
                self.late += time < latest
                latest, ahead = (latest, ahead) if time < latest else (time, sensor)
        return usable

    def _all_late(self, now: float) -> bool:
        """Return whether the scans that came late in a row are of all sensors that are in service."""
        return {name for name, came in self.heard.items() if now - came < HEARD} <= {name for _, name in self._behind}

    def _step_all(self, usable: list[Formed], refused: Refusals) -> None:
        """Step over scans, and anew over those after the first of them."""
        if not usable:
            return
        usable.sort(key=_order)
        if self.leap is not None and usable[0].scan.time < self.leap.time:
            self.leap = None  # it is stepped over anew
        at = self._place(usable[0].scan)
        former = [one for taken in self.kept[at:] for one in taken.formed]
        self.again += len(self.kept) - at
        del self.kept[at:]
        in_order = sorted([*former, *usable], key=_order)  # the sort is stable: those of equal order stay as they came
        for _, moment in groupby(in_order, key=lambda one: one.scan.time):
            for scan, of in self._made(list(moment), refused):
                try:
                    before, taken = self.state, self._step(scan, of)
                except ScanRefused as error:
                    refused += [(one, str(error)) for one in of]
                    continue
                self.kept.append(taken)
                sensors = frozenset(one.scan.sensor for one in of)
                if scan.time - before.time > LEAP:
                    self.leap = Leap(before, scan.time, sensors)
                elif self.leap is not None:
                    self.leap = evolve(self.leap, sensors=self.leap.sensors | sensors)
        if self.kept and self.state.time >= self.latest:
            self.latest, self.ahead = self.state.time, self.kept[-1].scan.sensor

    def _gainsaid(self, leap: Leap) -> bool:
        """Return whether late scans lie within a leap: of all sensors that bear it out, and more than their scans."""
        within = {(time, sensor) for time, sensor in self._behind if leap.before.time <= time < leap.time}
        count = self.state.steps - leap.before.steps
        return len(within) >= AGREE > count and leap.sensors <= {sensor for _, sensor in within}

    @property
    def settled_leap(self) -> Leap | None:
        """The latest leap, if the state after it may yet be given up and that before it is in no other state."""
        leap = self.leap
        known = leap is None or self.before.time < leap.time or self.state.steps - leap.before.steps >= AGREE
        return None if known else leap

    def _give_up(self, leap: Leap) -> Refusals:
        """Go back to before a leap; return the scans after it that are not settled."""
        last = max(time for time, _ in self._behind)
        self.gave_up = f"time: {leap.time:.6f} s is {leap.time - last:.6g} s ahead of what all sensors have told since"
        given_up = [(one, self.gave_up) for taken in self.kept if taken.scan.time >= leap.time for one in taken.formed]
        self.kept = [taken for taken in self.kept if taken.scan.time < leap.time]
        if self.before.time >= leap.time:
            self.before = leap.before
        self.latest, self.leap = leap.before.time, None
        self.came = OrderedDict((copy, time) for copy, time in self.came.items() if time < leap.time)
        self._behind.clear()
        return given_up

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
        while self.came and (len(self.came) > COPIES or next(iter(self.came.values())) < self.before.time - LATER):
            self.came.popitem(last=False)
        return done


def _order(one: Formed) -> tuple[float, str]:
    return _scan_order(one.scan)


def _scan_order(scan: Scan) -> tuple[float, str]:
    return scan.time, scan.sensor
