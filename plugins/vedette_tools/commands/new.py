"""`vedette new`: a config for one's own data, a package for one's own plugin."""

from __future__ import annotations

import sys
from argparse import Namespace
from pathlib import Path
from shlex import quote

from vedette.commands import DONE, UNFIT
from vedette.config import draft_of, load
from vedette.errors import ConfigError, InputError
from vedette_files.writing import write_text
from vedette_report.progress import on_terminal
from vedette_tools.drafting.config import drafted
from vedette_tools.drafting.package import distribution_name, draft_package
from vedette_tools.drafting.regions import Region, commands
from vedette_tools.drafting.wishes import Wishes

CONFIGS = (".toml", ".yaml", ".yml")
"""How the names of configs end, and those of no table."""


def run(arguments: Namespace) -> int:
    """Write what is asked for, and say what to do with it."""
    return _config(arguments) if arguments.what == "config" else _plugin(arguments)


def _config(arguments: Namespace) -> int:
    data = Path(arguments.data)
    path = Path(arguments.out) if arguments.out else Path(f"{data.stem}.toml")
    if arguments.out and path.suffix != ".toml":
        raise ConfigError.at("--out", f"must end in .toml, got {str(path)!r}")
    if data.suffix in CONFIGS:
        raise InputError(f"{data}: is a config, not data; `vedette run` runs it")
    if path.exists():
        raise ConfigError.at("--out", f"{str(path)!r} exists already: delete it, or name another file")
    if arguments.pick and arguments.box:
        raise ConfigError.at("--pick", "is to draw the box that --box states: give one of the two")
    wishes = {"box": arguments.box} if arguments.box else {"pick": True} if arguments.pick else {}
    text, failure, others = draft_of(data, wishes), "", tuple[Region, ...]()
    if text is None:
        if wishes:
            raise InputError(f"{data}: is no video or folder of images, in which --{next(iter(wishes))} could mark a target")
        stated = (arguments.time, arguments.rate, arguments.columns, arguments.units, arguments.dates)
        wanted = Wishes.of(*stated, arguments.scan, arguments.platform)
        with on_terminal() as progress:
            draft = drafted(data, arguments.identity, wanted, progress)
        text, failure, others = draft.text, draft.failure, draft.others
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, text)
    load(path)
    print(text)
    print(f"written to {path}; run it: vedette run {quote(str(path))}")
    for command in commands(others, path):
        print(f"for rows that this plane does not reach: {command}")
    if failure:
        print(f"{data}: {failure}", file=sys.stderr)
        return UNFIT
    return DONE


def _plugin(arguments: Namespace) -> int:
    folder = Path(arguments.out or distribution_name(arguments.name))
    for path in draft_package(arguments.name, folder, arguments.role):
        print(path)
    print(f"install and test it: cd {quote(str(folder))}; pip install -e '.[test]'; python -m pytest")
    print("to add a component, type the same with another --role")
    return DONE
