"""A run in progress, scan by scan."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from itertools import islice
from signal import SIGINT, default_int_handler, getsignal, signal
from threading import current_thread, main_thread
from time import process_time
from typing import Any, Protocol, final

import numpy as np
from attrs import evolve

from vedette.errors import LATE, Problem, ScanRefused
from vedette.progress import Progress
from vedette.supporting import Preprocessor
from vedette.tracking.faults import check_made, read
from vedette.tracking.intake import Intake, Refused
from vedette.tracking.preprocessing import noted, preprocess, still_to_run
from vedette.tracking.state import State
from vedette.tracking.tracker import Tracker
from vedette.tracking.validation import with_axes, without_bad_returns
from vedette.types import Gaussian, Recording, Scan


class Tracked(Protocol):
    """What a run is of: an experiment."""

    @property
    def tracker(self) -> Tracker:
        """What takes the scans."""

    @property
    def preprocessors(self) -> dict[str, Preprocessor]:
        """What makes its scans."""


@final
class Steps:
    """A run in progress: iterating over it gives each scan that was taken, without its bad returns, and the state after it.

    It does not grow with the number of scans. `recording` is what the source delivered, `intake` counts the input,
    `seconds` is the CPU time of the tracker alone, `state` the last one and `before` the one before it, `drawn` how many
    scans came; `place`, if the scan that came last has a frame, is where it stands in the recording.
    """

    def __init__(
        self,
        experiment: Tracked,
        recording: Recording,
        given: Gaussian | None,
        seeds: np.random.SeedSequence,
        *,
        strict: bool,
        progress: Progress,
        named: float,
    ) -> None:
        self.recording, self.seconds, self.drawn = recording, 0.0, 0
        self.intake = Intake(experiment.tracker.sensors, Refused(named))
        self.intake.refused.extend(recording.refused)
        self._tracker, self._given, self._seeds, self._strict = experiment.tracker, given, seeds, strict
        self.latest: Scan | None = None
        self.place: int | None = None
        self._frames = deque[tuple[float, str, int]]()
        scans = noted(progress(recording.scans, "tracking"), self._frames)
        self._makers = still_to_run(experiment.preprocessors, self.intake.sensors, recording)
        self._scans = read(
            preprocess(scans, self._makers, self.intake.refused, strict=strict, own=self.intake.sensors), experiment
        )
        self.state = self.before = self.begin(-np.inf)

    def __iter__(self) -> Iterator[tuple[Scan, State]]:
        for scan in self._scans:
            if not self.drawn:
                self.state = self.begin(scan.time)
            self.drawn += 1
            self.latest = scan = with_axes(scan, self.intake.sensors)
            before = process_time()
            after, kept, problems = self._step(self.state, scan)
            self.seconds += process_time() - before
            if problems:
                self.intake.refused.extend(evolve(one, place=f"scan {self.drawn - 1}, {one.place}") for one in problems)
            if after is not None:
                self.intake.add(kept, self.state, after)
                self.before, self.state = self.state, after
                self.place = self._place_of(scan)
                yield kept, after

    def apart(self) -> Iterator[tuple[Scan, State]]:
        """Iterate; Ctrl-C ends the run between two scans, so that one that was counted is dealt with whole.

        It raises KeyboardInterrupt at once while the next is waited for. Threads are not interrupted, and where Python's own
        handler was replaced, that stays.
        """
        done, asked = self.intake.scans, False

        def interrupted(number: int, frame: Any) -> None:
            nonlocal asked
            asked = True
            if self.intake.scans == done:
                raise KeyboardInterrupt

        held = current_thread() is main_thread() and getsignal(SIGINT) is default_int_handler
        if held:
            signal(SIGINT, interrupted)
        try:
            for step in self:
                yield step
                done = self.intake.scans
                if asked:
                    raise KeyboardInterrupt
        finally:
            if held:
                signal(SIGINT, default_int_handler)

    def skip(self, count: int) -> Iterator[Scan]:
        """Yield the next scans as they come, those that `go_on` says were tracked already."""
        for scan in islice(self._scans, count):
            self.drawn += 1
            self._place_of(scan)
            yield with_axes(scan, self.intake.sensors)

    def go_on(self, state: Any, intake: Any, seconds: float) -> None:
        """Go on from what `State.to_data` and `Intake.to_data` wrote; InputError if they are none of this run."""
        self.state = self._tracker.state_from(state)
        self.intake.restore(intake)
        self.seconds = seconds

    def begin(self, time: float) -> State:
        """Return the state at the time of the first scan."""
        return self._tracker.start(self._given, -np.inf if self._given is None else time, self._seeds)

    def again(self, scans: Sequence[Scan | None]) -> None:
        """Make the first steps, over these scans, once more."""
        intake, after = Intake(self.intake.sensors), self.begin(-np.inf if scans[0] is None else scans[0].time)
        for scan in filter(None, scans):
            before, after = after, self._tracker.step(after, scan)
            intake.add(scan, before, after)
            self._tracker.estimate(after)

    def _place_of(self, scan: Scan) -> int | None:
        """Return where a scan with a frame stands in the recording, and forget the frames before its time."""
        while self._frames and self._frames[0][0] < scan.time:
            self._frames.popleft()
        if scan.frame is None:
            return None
        return next(place for time, sensor, place in self._frames if (time, sensor) == (scan.time, scan.sensor))

    def _step(self, state: State, scan: Scan) -> tuple[State | None, Scan, list[Problem]]:
        """Return the next state (None if the scan is refused), the scan without bad returns, and what was left out."""
        try:
            return self._tracker.step(state, scan), scan, []
        except ScanRefused as error:
            if self._strict:
                raise ScanRefused(f"scan of {scan.sensor!r} at {scan.time:.6f} s: {error}") from None
        kept, problems = without_bad_returns(scan)
        try:
            return self._tracker.step(state, kept), kept, problems
        except ScanRefused as error:
            if scan.sensor in self._makers:
                check_made(self._makers[scan.sensor], "process", scan.detections, {"preprocessors": self._makers})
            return None, kept, [Problem("left out whole", str(error), kind=LATE if scan.time < state.time else "")]
