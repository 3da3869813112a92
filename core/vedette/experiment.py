"""A tracker, the source of its scans, and how its tracks are compared with the truth: what one config file describes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Protocol, final

import numpy as np
from attrs import Factory, evolve, frozen

from vedette import fields
from vedette.display import parameters_html
from vedette.errors import ConfigError, Problem, ScanRefused
from vedette.metrics import Judge, Score, judge
from vedette.names import look_up
from vedette.progress import Progress, silent
from vedette.space import Array, Space
from vedette.supporting import Preprocessor, Source
from vedette.tracking.faults import check_again, explain_run
from vedette.tracking.history import History, from_the_start
from vedette.tracking.intake import Intake
from vedette.tracking.preprocessing import check_preprocessors, open_source
from vedette.tracking.state import State
from vedette.tracking.steps import Steps as Steps
from vedette.tracking.tracker import Tracker
from vedette.types import Gaussian, LazyScans, Recording, Scan, Track, Trajectory, come_once

Watch = Callable[[Scan, State, State, Gaussian, Array | None], None]
"""Is told of a scan, the states before and after it, and that one's estimates (t,) and mode probabilities (t, r), if any."""

NAMED = 100
"""The greatest number of refused parts that a streamed run names; all are counted."""

LOOKED_AT = 20
"""First scans of a run without any confirmed track that are tracked once more, to see whether a component is at fault."""


class Redraw(Protocol):
    """Draws a run's own version of a recording, from the run's seeds: of many runs over it no two are the same."""

    def recording(self, whole: Recording, seeds: np.random.SeedSequence, /) -> Recording:
        """Return the recording as this run meets it."""

    def start(
        self, given: Gaussian | None, space: Space, truth: Sequence[Trajectory], seeds: np.random.SeedSequence, /
    ) -> Gaussian | None:
        """Return the tracks (t, n) over `space` that are given before the first scan."""


@frozen(eq=False, repr=False)
class Result:
    """The result of a run: tracks that were ever confirmed, in the order of their ids.

    `begun` counts all tracks, tentative ones included; `approximated` those whose association weights were not exact, once a
    scan, and `lost` the probability that truncated hypotheses lack of each of these, in sum; `scans` holds those
    taken, without their bad returns; `refused` holds what was not taken, and why; `seconds` is the CPU time of the tracker
    alone; `states` holds the state after each scan, if it was to be kept; `intake` counts what came
    in. `framed` holds the scans taken that brought a frame, with it: lazily where the recording is lazy, and `scans` then
    lacks the frames, as not all fit into memory; it is empty where frames come once. `judged` is what a judge said as the
    run went, if one did; `offsets` are those that all tracks share, after the last scan.
    """

    tracks: tuple[Track, ...]
    recording: Recording
    scans: tuple[Scan, ...]
    refused: tuple[Problem, ...]
    begun: int
    seconds: float
    interrupted: bool
    approximated: int = 0
    lost: float = 0.0
    states: tuple[State, ...] = ()
    framed: Sequence[Scan] = ()
    intake: Intake = Factory(lambda self: Intake.of({}, self.scans, self.refused), takes_self=True)
    experiment: Experiment | None = None
    judged: Any = None
    offsets: Gaussian | None = None

    def to_dataframe(self, what: str = "tracks") -> Any:
        """Return a data frame of pandas: "tracks" as in tracks.csv, "detections", "truth", or "metrics" in one row."""
        return look_up("tabulate_result")(self, what)

    def plot(self, axes: Any = None) -> Any:
        """Draw the map of the run on axes of matplotlib, by default new ones; return them."""
        return look_up("draw_result")(self, axes)

    def score(self) -> Score:
        """Judge the tracks against the truth, as the config says; figures that do not exist are None.

        Raises
        ------
        ConfigError : the result was not made by a run, so its tracker is not known
        """
        made_by = self.made_by
        gate, truth = made_by.tracker.gate.probability, self.recording.truth
        nobody = self.recording.nobody
        return judge(self.tracks, truth, self.scans, made_by.judge, gate, made_by.tracker.sensors, nobody=nobody)

    @property
    def made_by(self) -> Experiment:
        """The experiment; ConfigError if the result was not made by a run, so that it is not known."""
        if self.experiment is None:
            raise ConfigError.at("experiment", "the result was not made by a run, so its tracker is not known")
        return self.experiment

    def __repr__(self) -> str:
        came = self.intake
        return f"Result({len(self.tracks)} tracks, {came.scans} scans, {came.returns} returns, {came.refused.count} refused)"

    def _repr_html_(self) -> str:
        return str(look_up("result_html")(self))


@final
@frozen(repr=False)
class Experiment:
    """One config: a tracker, its source, and the judge of its result against the truth."""

    tracker: Tracker = fields.part("what turns scans into tracks")
    source: Source | None = fields.part("where the scans come from", default=None)
    preprocessors: dict[str, Preprocessor] = fields.part(
        "tracker's sensor to what makes its scans of raw ones; default: its scans come as they are", default=Factory(dict)
    )
    judge: Judge = fields.part("how tracks are judged against the truth", default=Judge())
    title: str = fields.text("one line that says what this is", default="")
    seed: int = fields.integer("of everything random", default=0)
    retroactive: bool = fields.flag(
        "whether a track counts as confirmed from its first scan on, once it is: its record says when that was",
        default=False,
    )

    def __repr__(self) -> str:
        return f"Experiment({self.title!r}, {self.tracker!r}, source {'none' if self.source is None else self.source.kind})"

    def _repr_html_(self) -> str:
        return parameters_html(self)

    def __attrs_post_init__(self) -> None:
        check_preprocessors(self.preprocessors, self.tracker.sensors)
        if self.judge.sensor is not None and self.judge.sensor not in self.tracker.sensors:
            known = ", ".join(map(repr, self.tracker.sensors))
            raise ValueError(f"judge.sensor: must be one of {known}, got {self.judge.sensor!r}")
        if self.judge.bound is not None:
            space = self.judge.bound.motion.state
            for name, sensor in self.tracker.sensors.items():
                if lacking := [axis.name for axis in sensor.observes.axes if axis not in space.axes]:
                    text = f"must have the axis {lacking[0]} that sensor {name!r} observes, has {space}"
                    raise ValueError(f"judge.bound.motion: {text}")

    def steps(
        self,
        *,
        strict: bool = False,
        progress: Progress = silent,
        seeds: np.random.SeedSequence | None = None,
        redraw: Redraw | None = None,
        named: float = NAMED,
    ) -> Steps:
        """Open the source and return the run over it, scan by scan, for a run of any length: it keeps nothing.

        >>> for scan, state in experiment.steps():                               # doctest: +SKIP
        ...     print(scan.time, experiment.tracker.estimate(state).mean)

        A scan or a return that the tracker cannot take is left out and listed in `intake.refused`, the first `named` of them
        in words; with `strict` it raises ScanRefused. `progress` wraps the scans, to show how far the run is. `seeds`
        replace `seed`, and `redraw` says what is drawn of a recording, for one of many runs.
        """
        if self.source is None:
            raise ConfigError.at("source", "is missing: there are no scans to run on")
        seeds = np.random.SeedSequence(self.seed) if seeds is None else seeds
        for_source, for_tracker = seeds.spawn(2)
        rng = np.random.default_rng(for_source)
        recording = open_source(self.source, self.preprocessors, self.tracker.sensors, rng)
        if strict and recording.refused:
            raise ScanRefused(str(recording.refused[0]))
        if redraw is not None:
            recording = redraw.recording(recording, seeds)
        try:
            given = self.tracker.given(recording)
        except ValueError as error:
            raise ConfigError.at("", str(error)) from None
        if redraw is not None:
            given = redraw.start(given, self.tracker.state, recording.truth, seeds)
        return Steps(self, recording, given, for_tracker, strict=strict, progress=progress, named=named)

    def run(
        self,
        *,
        strict: bool = False,
        progress: Progress = silent,
        keep_states: bool = False,
        seeds: np.random.SeedSequence | None = None,
        redraw: Redraw | None = None,
    ) -> Result:
        """Run the tracker over all scans, and keep them and the history of every track; `steps` keeps nothing.

        A scan or a return that the tracker cannot take is left out and listed in `refused`; with `strict` it raises
        ScanRefused. `progress` wraps the scans, to show how far the run is. `keep_states` leaves the states in the result,
        for `vedette.smooth`. `seeds` replace `seed`, and `redraw` says what is drawn of a recording, for one of many runs.
        Ctrl-C ends the run between two scans and keeps what is done.
        """
        steps = self.steps(strict=strict, progress=progress, seeds=seeds, redraw=redraw, named=np.inf)
        return self.finish(steps, keep_states=keep_states)

    def finish(self, steps: Steps, *, keep_states: bool = False, watch: Watch | None = None) -> Result:
        """Make all steps of a run that was opened, and keep them, as `run` does. `watch` is called after each."""
        history, taken, states, interrupted = History(self.tracker), list[Scan](), list[State](), False
        given, framed, lazy = steps.recording.scans, list[int](), isinstance(steps.recording.scans, LazyScans)
        try:
            for scan, state in steps.apart():
                if steps.place is not None:
                    framed.append(steps.place)
                taken.append(evolve(scan, frame=None) if lazy and scan.frame is not None else scan)
                estimate, modes = history.add(state)
                if watch is not None:
                    watch(scan, steps.before, state, estimate, modes)
                if keep_states:
                    states.append(state)
        except KeyboardInterrupt:
            interrupted = True
        except Exception as error:
            explain_run(error, self, partial(steps.again, [*taken, steps.latest]))
            raise
        tracks = history.tracks()
        if not tracks:
            check_again(self, partial(steps.again, taken[:LOOKED_AT]))
        return evolve(
            self.outcome(steps, interrupted=interrupted),
            tracks=tuple(map(from_the_start, tracks)) if self.retroactive else tracks,
            scans=tuple(taken),
            states=tuple(states),
            framed=() if come_once(given) else LazyScans(len(framed), lambda k: given[framed[k]]),
        )

    def outcome(self, steps: Steps, *, interrupted: bool) -> Result:
        """Return what the steps of a run leave, without its tracks and scans, which whoever made the steps has kept."""
        state = steps.state
        return Result(
            tracks=(),
            recording=steps.recording,
            scans=(),
            refused=tuple(steps.intake.refused.first),
            begun=state.born,
            seconds=steps.seconds,
            interrupted=interrupted,
            approximated=state.approximated,
            lost=state.lost,
            intake=steps.intake,
            experiment=self,
            offsets=state.offsets,
        )
