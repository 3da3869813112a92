"""`vedette report`: the page of a run, or of several side by side, from the files that they left."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from vedette.commands.ending import DONE
from vedette.errors import ConfigError, Problem
from vedette.io.geodesy import Origin
from vedette.report.page.build import write_comparison, write_page
from vedette.report.page.geography import read_origin


def run(arguments: Namespace) -> int:
    """Write the page and tell where it is."""
    runs = [Path(name) for name in arguments.runs]
    underlay, origin = Path(arguments.underlay) if arguments.underlay else None, _origin(arguments.origin)
    if len(runs) == 1:
        target = _target(arguments.out, _folder(runs[0]) / f"{'report' if runs[0].suffix != '.npz' else runs[0].stem}.html")
        write_page(runs[0], target, underlay, origin)
    else:
        target = _target(arguments.out, _folder(runs[0]) / "compare.html")
        write_comparison(runs, target, underlay, origin)
    print(f"{target}: {target.stat().st_size / 1e6:.2g} MB")
    return DONE


def _folder(run: Path) -> Path:
    """Return the folder of a run that is named by itself or by series in it."""
    return run.parent if run.suffix == ".npz" else run


def _target(given: str | None, usual: Path) -> Path:
    target = Path(given) if given else usual
    if target.is_dir():
        raise ConfigError([Problem("--out", f"must be a file, and {str(target)!r} is a folder")])
    return target


def _origin(text: str | None) -> Origin | None:
    try:
        return None if text is None else read_origin(text)
    except ValueError as error:
        raise ConfigError([Problem("--origin", str(error))]) from None
