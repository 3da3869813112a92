"""`vedette report`: the page of a run, of several side by side, or of a study, from the files that they left."""

from __future__ import annotations

import sys
from argparse import Namespace
from pathlib import Path

from vedette.commands import DONE, options
from vedette.config import answers
from vedette.errors import ConfigError
from vedette_files.files_read import Inputs
from vedette_files.results import finished, unfinished_runs
from vedette_report.page.build import target_of, write_comparison, write_page
from vedette_report.page.geography import read_origin
from vedette_report.running.files import NAMES, SERIES
from vedette_report.running.resuming import not_ended


def run(arguments: Namespace) -> int:
    """Write the page and tell where it is."""
    folders = [Path(name) for name in arguments.runs]
    if len(folders) == 1:
        places = [folders[0], *filter(None, (arguments.out, arguments.underlay))]
        for _, page in answers("vedette_page", places, folder=folders[0], arguments=arguments):
            if page is not None:
                return _tell(page)
    if arguments.worst is not None or arguments.again:
        option = "--run" if arguments.again else "--worst"
        raise ConfigError.at(option, f"runs a study's runs anew, and {str(folders[0])!r} is no study's folder")
    underlay = Path(arguments.underlay) if arguments.underlay else None
    origin = options.read("--origin", arguments.origin, read_origin)
    shown = [_with_results(path) for path in folders]
    beside = folders[0].parent if folders[0].suffix == ".npz" else folders[0]
    if len(folders) == 1:
        name = "report" if beside == folders[0] else folders[0].stem
        target = target_of(arguments.out, beside / f"{name}.html")
        _check(target, shown, arguments)
        write_page(shown[0], target, underlay, origin)
    else:
        target = target_of(arguments.out, beside / "compare.html")
        _check(target, shown, arguments)
        write_comparison(shown, target, underlay, origin)
    return _tell(target)


def _with_results(path: Path) -> Path:
    """Return the run to show: that of a folder, or where it has none, the one in it that did not come to its end."""
    left = unfinished_runs(finished(path)) if path.suffix != ".npz" else []
    if not left:
        if (path / "consistency.json").exists() and not (path / SERIES).exists():
            seen = ", ".join(sorted(one.name for one in path.glob("consistency.*")))
            told = f"{path} is what `vedette consistency` left: look at {seen}; a page shows what `vedette run --out` leaves"
            raise ConfigError.at("RUN_DIR", told)
        return path
    if (path / SERIES).exists():
        print(f"vedette: {path}: this is its finished run; {left[-1].name} in it is one that did not end", file=sys.stderr)
        return path
    if not (left[-1] / SERIES).exists():
        raise ConfigError.at("RUN_DIR", not_ended(path))
    print(f"vedette: {path}: the run did not end; {left[-1].name} is shown up to its last complete block", file=sys.stderr)
    return left[-1]


def _check(target: Path, runs: list[Path], arguments: Namespace) -> None:
    """Raise ConfigError if the page would take the place of what it is made of."""
    files = [path / name for path in runs if path.is_dir() for name in NAMES if name != "report.html"]
    Inputs.of(arguments.underlay, [path for path in runs if path.is_file()], files).check(target)


def _tell(target: Path) -> int:
    print(f"{target}: {target.stat().st_size / 1e6:.2g} MB")
    return DONE
