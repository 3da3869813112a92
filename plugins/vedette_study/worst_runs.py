"""The worst runs of a study, and each of them run anew with its own seed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from attrs import frozen

from vedette import Array, ConfigError, Progress
from vedette_report.figures import figures
from vedette_report.page import write_page
from vedette_report.running.files import write_files
from vedette_report.series.recorder import recorded_run
from vedette_report.summary.words import summary
from vedette_study.chunk import study_figures
from vedette_study.outcome import Outcome
from vedette_study.rerun import open_again

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
        recorded = recorded_run(experiment, open_again(plan, bad.point, bad.run, progress))
        result, score, target = recorded.result, recorded.judged.score, folder / FOLDER / bad.name
        if result.interrupted:
            raise KeyboardInterrupt
        told = summary(experiment, result, score, recorded.judged.bands)
        words = f"Run {bad.run} of point {bad.point}: {plan.points[bad.point].name}\n\n{told}"
        write_files(target, experiment, recorded, figures(experiment, result, score), words)
        write_page(target, target / "report.html")
