"""`vedette report` of a study's folder."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from vedette.commands import options
from vedette_report.page import target_of
from vedette_report.progress import on_terminal
from vedette_study.page import write_study_page
from vedette_study.results import is_study, read_outcome
from vedette_study.worst_runs import read_run, run_anew, worst


def page_asked_for(folder: Path, arguments: Namespace) -> Path | None:
    """Write the page of a study's folder, after runs that are asked for were made anew; None if it is no study's."""
    if not is_study(folder):
        return None
    target, most = target_of(arguments.out, folder / "report.html"), options.whole("--worst", arguments.worst, 0)
    outcome = read_outcome(folder)
    chosen = [read_run(text, outcome) for text in arguments.again]
    chosen += [bad for runs in worst(outcome, most) for bad in runs]
    with on_terminal() as progress:
        run_anew(folder, outcome, chosen, progress)
    write_study_page(folder, outcome, target)
    return target
