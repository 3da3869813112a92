"""The worst runs of a study, and each of them run anew with its own seed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from attrs import evolve, frozen

from vedette import Array, ConfigError, Experiment, InputError, Progress, Recording, Scan, Trajectory
from vedette.experiment import Steps
from vedette.tracking import take
from vedette_report.figures import figures
from vedette_report.page import write_page
from vedette_report.running.files import write_files
from vedette_report.series.recorder import recorded_run
from vedette_report.summary.words import summary
from vedette_study.chunk import recorded, study_figures
from vedette_study.outcome import Outcome
from vedette_study.plan import Plan
from vedette_study.scenes import DrawsTogether
from vedette_study.seeds import RunSeeds, sequence

JUDGED_BY = ("gospa", "position_rmse")
"""The figures that say which run is worse, the first that a study has: GOSPA counts what is missed, too."""
FOLDER = "worst"


@frozen
class Bad:
    """A run: its point in the grid, its number, and its figure; None where no track covered anything."""

    point: int
    run: int
    value: float | None

    @property
    def name(self) -> str:
        """How the command line and the folder call it."""
        return f"{self.point}-{self.run}"


def whole(outcome: Outcome) -> Outcome:
    """Return the result at every point of the grid, also where the study averages over some."""
    return outcome if outcome.parts is None else outcome.parts


def judged_by(outcome: Outcome) -> str | None:
    """Return the figure by which runs are compared; None if there is no truth."""
    return next((name for name in JUDGED_BY if name in outcome.figures and np.isfinite(outcome.figures[name]).any()), None)


def worst(outcome: Outcome, most: int) -> list[list[Bad]]:
    """Return of each point its worst runs, the worst first."""
    outcome = whole(outcome)
    name = judged_by(outcome)
    if name is None:
        return [[] for _ in outcome.plan.points]
    values = outcome.figures[name]
    values = np.sqrt(values) if study_figures()[name].squared else values
    return [
        [Bad(i, run, float(at[run]) if np.isfinite(at[run]) else None) for run in _order(at)[:most]]
        for i, at in enumerate(values)
    ]


def _order(values: Array) -> list[int]:
    """Return the runs from the worst to the best, those without a figure first."""
    return np.argsort(-np.nan_to_num(values, nan=np.inf), kind="stable").tolist()


def read_run(text: str, outcome: Outcome) -> Bad:
    """Return the run that the command line names, as '3-217'. ConfigError if the study has none of that name."""
    outcome = whole(outcome)
    point, dash, run = text.partition("-")
    points, runs = len(outcome.plan.points), outcome.runs
    if not (dash and point.isdecimal() and run.isdecimal() and int(point) < points and int(run) < runs):
        usual = f"must be POINT-RUN with a point from 0 to {points - 1} and a run from 0 to {runs - 1}, got {text!r}"
        raise ConfigError.at("--run", usual)
    return Bad(int(point), int(run), None)


def run_anew(folder: Path, outcome: Outcome, runs: Sequence[Bad], progress: Progress) -> None:
    """Run some runs of the study in `folder` again, with the draws that they had; write the files and the page of each."""
    plan = whole(outcome).plan
    for bad in runs:
        experiment = plan.points[bad.point].experiment
        made = recorded_run(experiment, open_again(plan, bad.point, bad.run, progress))
        result, score, target = made.result, made.judged.score, folder / FOLDER / bad.name
        if result.interrupted:
            raise KeyboardInterrupt
        told = summary(experiment, result, score, made.judged.bands)
        words = f"Run {bad.run} of point {bad.point}: {plan.points[bad.point].name}\n\n{told}"
        write_files(target, experiment, made, figures(experiment, result, score), words)
        write_page(target, target / "report.html")


def open_again(plan: Plan, point: int, run: int, progress: Progress) -> Steps:
    """Open a run at a point of the grid; its steps give what it gave in the study, in lock-step or not."""
    experiment = plan.points[point].experiment
    if not plan.together:
        redraw = plan.redraw if recorded(experiment) else None
        return experiment.steps(seeds=sequence(plan.seed, run), redraw=redraw, named=np.inf, progress=progress)
    recording = _scene(experiment, RunSeeds(plan.seed, (run,)))
    given = experiment.tracker.given(recording)
    seeds = sequence(plan.seed, run, (1,))
    return Steps(experiment, recording, given, seeds, strict=False, progress=progress, named=np.inf)


def _scene(experiment: Experiment, seeds: RunSeeds) -> Recording:
    """Return the scene that one run in lock-step has, as a recording."""
    source = experiment.source
    scenes = (
        source.open_together(experiment.tracker.sensors, seeds.generators()) if isinstance(source, DrawsTogether) else None
    )
    if scenes is None:
        raise InputError("the study: its scenes are no longer drawn in lock-step; run it anew")
    times, first = np.unique([scan.time for scan in scenes.scans], return_index=True)
    truth = Trajectory("target", scenes.space, times, scenes.states[0, first])
    return Recording(tuple(_alone(scan) for scan in scenes.scans), (truth,))


def _alone(scan: Scan) -> Scan:
    """Return the scan of the first run, without what pads it."""
    first = take(scan.detections, 0, 0)
    return evolve(scan, detections=take(first, first.valid, 0))
