"""`vedette report`: the page of a run, from the files that it left."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from vedette.commands.ending import DONE
from vedette.errors import ConfigError, Problem
from vedette.io.geodesy import Origin
from vedette.report.page.build import write_page
from vedette.report.page.geography import read_origin


def run(arguments: Namespace) -> int:
    """Write the page and tell where it is."""
    folder = Path(arguments.run)
    target = Path(arguments.out) if arguments.out else folder / "report.html"
    if target.is_dir():
        raise ConfigError([Problem("--out", f"must be a file, and {str(target)!r} is a folder")])
    write_page(folder, target, Path(arguments.underlay) if arguments.underlay else None, _origin(arguments.origin))
    print(f"{target}: {target.stat().st_size / 1e6:.2g} MB")
    return DONE


def _origin(text: str | None) -> Origin | None:
    try:
        return None if text is None else read_origin(text)
    except ValueError as error:
        raise ConfigError([Problem("--origin", str(error))]) from None
