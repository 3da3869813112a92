"""A tracker, the scans it is to run on, and how the result is judged: what one config file describes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from time import process_time
from typing import final

import numpy as np
from attrs import Factory, evolve, frozen

from vedette import fields
from vedette.errors import ConfigError, Problem, ScanRefused
from vedette.metrics import Judge
from vedette.progress import Progress, silent
from vedette.roles import Preprocessor, Source
from vedette.tracking.history import History
from vedette.tracking.preprocessing import check_preprocessors, preprocess, raw_sensors
from vedette.tracking.state import State
from vedette.tracking.tracker import Tracker
from vedette.tracking.validation import without_bad_returns
from vedette.types import LazyScans, Recording, Scan, Track


@frozen(eq=False)
class Result:
    """What came of a run: tracks that were ever confirmed, in the order of their ids.

    `begun` counts all tracks, tentative ones included; `scans` holds those taken, without their bad returns; `refused` holds
    what was not taken, and why; `seconds` is the CPU time of the tracker alone; `states` holds what each scan left, if
    it was to be kept. `framed` holds those taken that brought a frame, with it: lazily, where the recording is lazy, and
    `scans` then lacks the frames, as not all fit into memory.
    """

    tracks: tuple[Track, ...]
    recording: Recording
    scans: tuple[Scan, ...]
    refused: tuple[Problem, ...]
    begun: int
    seconds: float
    interrupted: bool
    states: tuple[State, ...] = ()
    framed: Sequence[Scan] = ()


@final
@frozen
class Experiment:
    """One config: a tracker, its source, and the judge of its result against the truth."""

    tracker: Tracker = fields.part("what turns scans into tracks")
    source: Source | None = fields.part("where the scans come from", default=None)
    preprocessors: dict[str, Preprocessor] = fields.part(
        "tracker's sensor to what makes its scans of raw ones; default: its scans come as they are", default=Factory(dict)
    )
    judge: Judge = fields.part("how tracks are held against the truth", default=Judge())
    title: str = fields.text("one line that says what this is", default="")
    seed: int = fields.integer("of everything random", default=0)

    def __attrs_post_init__(self) -> None:
        check_preprocessors(self.preprocessors, self.tracker.sensors)
        if self.judge.sensor is not None and self.judge.sensor not in self.tracker.sensors:
            known = ", ".join(map(repr, self.tracker.sensors))
            raise ValueError(f"judge.sensor: must be one of {known}, got {self.judge.sensor!r}")

    def run(
        self,
        *,
        strict: bool = False,
        progress: Progress = silent,
        keep_states: bool = False,
        seeds: np.random.SeedSequence | None = None,
    ) -> Result:
        """Run the tracker over all scans.

        A scan or a return that the tracker cannot take is left out and told in `refused`; with `strict` it raises
        ScanRefused. `progress` wraps the scans, to show how far the run is. `keep_states` leaves the states in the result,
        for `vedette.smooth`. `seeds` take the place of `seed`, for one of many runs. Ctrl-C ends the run and keeps what is
        done.
        """
        if self.source is None:
            raise ConfigError([Problem("source", "is missing: there are no scans to run on")])
        for_source, for_tracker = (np.random.SeedSequence(self.seed) if seeds is None else seeds).spawn(2)
        try:
            recording = self.source.open(
                raw_sensors(self.preprocessors, self.tracker.sensors), np.random.default_rng(for_source)
            )
        except ConfigError as error:
            raise error.within("source") from None
        if strict and recording.refused:
            raise ScanRefused(str(recording.refused[0]))
        try:
            given = self.tracker.given(recording)
        except ValueError as error:
            raise ConfigError([Problem("", str(error))]) from None
        refused, taken, seconds, interrupted = [*recording.refused], [], 0.0, False
        scans_given, places = recording.scans, dict[tuple[float, str], int]()
        shown = _noted(progress(scans_given, "tracking"), places)
        scans = preprocess(shown, self.preprocessors, refused, strict=strict)
        lazy, framed = isinstance(scans_given, LazyScans), list[int]()
        history = History(self.tracker)
        state = self.tracker.start(given, -np.inf, for_tracker)
        states: list[State] = []
        try:
            for i, scan in enumerate(scans):
                if i == 0 and given is not None:
                    state = self.tracker.start(given, scan.time, for_tracker)
                before = process_time()
                after, kept, problems = self._step(state, scan, strict)
                seconds += process_time() - before
                refused += [Problem(f"scan {i}, {problem.place}", problem.text) for problem in problems]
                if after is not None:
                    state = after
                    if kept.frame is not None:
                        framed.append(places[kept.time, kept.sensor])
                        kept = evolve(kept, frame=None) if lazy else kept
                    taken.append(kept)
                    history.add(state)
                    if keep_states:
                        states.append(state)
        except KeyboardInterrupt:
            interrupted = True
        return Result(
            history.tracks(),
            recording,
            tuple(taken),
            tuple(refused),
            state.born,
            seconds,
            interrupted,
            tuple(states),
            LazyScans(len(framed), lambda k: scans_given[framed[k]]),
        )

    def _step(self, state: State, scan: Scan, strict: bool) -> tuple[State | None, Scan, list[Problem]]:
        """The next state, None if the scan is refused as a whole; the scan without bad returns; what was left out."""
        try:
            return self.tracker.step(state, scan), scan, []
        except ScanRefused as error:
            if strict:
                raise ScanRefused(f"scan of {scan.sensor!r} at {scan.time:.6f} s: {error}") from None
        kept, problems = without_bad_returns(scan)
        try:
            return self.tracker.step(state, kept), kept, problems
        except ScanRefused as error:
            return None, kept, [Problem("left out whole", str(error))]


def _noted(scans: Iterable[Scan], places: dict[tuple[float, str], int]) -> Iterator[Scan]:
    """Yield the scans, and note where those with a frame stand."""
    for i, scan in enumerate(scans):
        if scan.frame is not None:
            places[scan.time, scan.sensor] = i
        yield scan
