"""`vedette report`: the page of a run, of several side by side, or of a study, from the files that they left."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from vedette.commands import DONE, options
from vedette.config import answers
from vedette.errors import ConfigError, Problem
from vedette_report.page.build import target_of, write_comparison, write_page
from vedette_report.page.geography import read_origin


def run(arguments: Namespace) -> int:
    """Write the page and tell where it is."""
    folders = [Path(name) for name in arguments.runs]
    if len(folders) == 1:
        for _, page in answers("vedette_page", folder=folders[0], arguments=arguments):
            if page is not None:
                return _tell(page)
    if arguments.worst is not None or arguments.again:
        option = "--run" if arguments.again else "--worst"
        raise ConfigError([Problem(option, f"runs a study's runs anew, and {str(folders[0])!r} is no study's folder")])
    underlay = Path(arguments.underlay) if arguments.underlay else None
    origin = options.read("--origin", arguments.origin, read_origin)
    beside = folders[0].parent if folders[0].suffix == ".npz" else folders[0]
    if len(folders) == 1:
        name = "report" if beside == folders[0] else folders[0].stem
        target = target_of(arguments.out, beside / f"{name}.html")
        write_page(folders[0], target, underlay, origin)
    else:
        target = target_of(arguments.out, beside / "compare.html")
        write_comparison(folders, target, underlay, origin)
    return _tell(target)


def _tell(target: Path) -> int:
    print(f"{target}: {target.stat().st_size / 1e6:.2g} MB")
    return DONE
