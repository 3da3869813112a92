"""Smoothing while a run goes: each state as the scans of up to a lag later tell it, once these have come."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path
from types import TracebackType
from typing import Any, Self, final

from vedette import Experiment, InputError, Recording, Scan, Tracker, smoothed
from vedette.metrics import Score
from vedette.tracking import State
from vedette_files import Tables
from vedette_report.running.track_files import TrackFiles
from vedette_report.series.recorder import Recorder, SmoothedSteps

SMOOTHED_SERIES = "smoothed.npz"


@final
class FixedLag:
    """Takes the states of a run as they come and gives each back, smoothed by those of up to `lag` s later.

    A state is due once one that is later by more has come: the window is what lies between. What comes out is what
    `vedette.smoothed` yields.
    """

    def __init__(self, tracker: Tracker, lag: float, seed: int = 0) -> None:
        self._tracker, self._lag, self._seed = tracker, lag, seed
        self._window: list[State] = []

    @property
    def waiting(self) -> tuple[State, ...]:
        """The states that are not due."""
        return tuple(self._window)

    def go_on(self, waiting: Iterable[State]) -> None:
        """Wait with these states."""
        self._window = list(waiting)

    def push(self, state: State) -> list[State]:
        """Take a state; return those that are due, in order."""
        due = sum(waits.time + self._lag < state.time for waits in self._window)
        told = list(islice(smoothed(self._tracker, self._window.copy(), self._lag, self._seed), due)) if due else []
        del self._window[:due]
        self._window.append(state)
        return told

    def finish(self) -> list[State]:
        """Return the states that wait, as nothing later comes."""
        told = list(smoothed(self._tracker, self._window, self._lag, self._seed))
        self._window = []
        return told


@final
class SmoothedFiles:
    """`smoothed.csv`, `smoothed.jsonl` and `smoothed.npz` of a run that keeps nothing, written and judged as it goes."""

    def __init__(self, folder: Path, experiment: Experiment, recording: Recording, before: State, lag: float) -> None:
        tracker = experiment.tracker
        self.lag, self._tracker = lag, tracker
        self._lagged = FixedLag(tracker, lag, experiment.seed)
        self._waiting = deque[tuple[Scan, State]]()
        self._recorder = Recorder(folder / SMOOTHED_SERIES, experiment, SmoothedSteps(recording, before), kept=False)
        extra = () if before.links is None else ("link",)
        self._tracks = TrackFiles(
            folder, tracker.state, recording.notes, self._recorder.modes, stem="smoothed", extra=extra, grows=True
        )
        self.names = [*self._tracks.names, SMOOTHED_SERIES]

    @property
    def none(self) -> Tables:
        """The tables of a run that nobody has judged, without rows."""
        return self._recorder.none

    def add(self, scan: Scan, before: State, state: State) -> None:
        """Take a scan with the states before and after it."""
        self._waiting.append((scan, before))
        self._record(self._lagged.push(state))

    def to_data(self) -> dict[str, Any]:
        """Return what a run that goes on from here needs: the lag, and the states from before the first scan that waits."""
        states = [*([self._waiting[0][1]] if self._waiting else []), *self._lagged.waiting]
        return {"lag": self.lag, "states": [state.to_data() for state in states]}

    def again(self, scan: Scan, before: State, rows: Iterator[dict[str, dict[str, Any]]]) -> None:
        """Take a scan that a run took before this one, and of those due by then the next of the rows that it wrote."""
        while self._waiting and self._waiting[0][0].time + self.lag < scan.time:
            if (told := next(rows, None)) is None:
                raise InputError(f"{SMOOTHED_SERIES}: has no scan at {self._waiting[0][0].time} s, which was due")
            self._recorder.again(self._waiting.popleft()[0], told)
        self._waiting.append((scan, before))

    def go_on(self, told: Any) -> None:
        """Go on from what `to_data` gave; InputError if that is of other scans than those that wait."""
        states = [self._tracker.state_from(state) for state in told["states"]]
        if [state.time for state in states[1:]] != [scan.time for scan, _ in self._waiting]:
            raise InputError("the states that wait to be smoothed are none of the run's last scans")
        self._waiting = deque((scan, before) for (scan, _), before in zip(self._waiting, states, strict=False))
        self._lagged.go_on(states[1:])

    def write(self, *, all_of_it: bool = False) -> None:
        """Judge and write what is due, or what is left; let others see it."""
        if all_of_it:
            self._record(self._lagged.finish())
        self._recorder.finish_block()
        self._tracks.write(self._recorder.tracks.hand_out())
        self._recorder.flush()

    def score(self) -> Score:
        """Return what the judge says of all."""
        self._recorder.close()
        return self._recorder.judge.score()

    def _record(self, told: list[State]) -> None:
        for state in told:
            scan, before = self._waiting.popleft()
            estimate, modes = self._tracker.estimate(state), self._tracker.estimator.mode_prob(state.belief)
            self._recorder.add(scan, before, state, estimate, modes)

    def __enter__(self) -> Self:
        self._tracks.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> bool | None:
        return self._tracks.__exit__(kind, error, trace)
