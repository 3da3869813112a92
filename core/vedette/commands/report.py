"""`vedette report`: the page of a run, of several side by side, or of a study, from the files that they left."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from vedette.commands import asked
from vedette.commands.ending import DONE
from vedette.errors import ConfigError, Problem
from vedette.montecarlo.kept import is_study, read_outcome
from vedette.progress import on_terminal
from vedette.report.page.build import write_comparison, write_page
from vedette.report.page.geography import read_origin
from vedette.report.page.study import write_study_page
from vedette.report.worst import read_run, run_anew, worst


def run(arguments: Namespace) -> int:
    """Write the page and tell where it is."""
    folders = [Path(name) for name in arguments.runs]
    if len(folders) == 1 and is_study(folders[0]):
        return _study(folders[0], arguments)
    if arguments.worst is not None or arguments.again:
        option = "--run" if arguments.again else "--worst"
        raise ConfigError([Problem(option, f"runs a study's runs anew, and {str(folders[0])!r} is no study's folder")])
    underlay = Path(arguments.underlay) if arguments.underlay else None
    origin = asked.read("--origin", arguments.origin, read_origin)
    beside = folders[0].parent if folders[0].suffix == ".npz" else folders[0]
    if len(folders) == 1:
        name = "report" if beside == folders[0] else folders[0].stem
        target = _target(arguments.out, beside / f"{name}.html")
        write_page(folders[0], target, underlay, origin)
    else:
        target = _target(arguments.out, beside / "compare.html")
        write_comparison(folders, target, underlay, origin)
    return _tell(target)


def _study(folder: Path, arguments: Namespace) -> int:
    """Run anew what is asked for, and write the study's page."""
    target, most = _target(arguments.out, folder / "report.html"), asked.whole("--worst", arguments.worst, 0)
    outcome = read_outcome(folder)
    chosen = [read_run(text, outcome) for text in arguments.again]
    chosen += [bad for runs in worst(outcome, most) for bad in runs]
    with on_terminal() as progress:
        run_anew(folder, outcome, chosen, progress)
    write_study_page(folder, outcome, target)
    return _tell(target)


def _tell(target: Path) -> int:
    print(f"{target}: {target.stat().st_size / 1e6:.2g} MB")
    return DONE


def _target(given: str | None, usual: Path) -> Path:
    target = Path(given) if given else usual
    if target.is_dir():
        raise ConfigError([Problem("--out", f"must be a file, and {str(target)!r} is a folder")])
    return target
