"""`vedette completions`: what a shell offers after TAB, written out by shtab from the arguments of the commands."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace, _SubParsersAction
from typing import Any

import shtab

from vedette.commands import DONE
from vedette.config import APART, Registry

CONFIGS: Any = shtab.glob("*.toml", "*.yaml", "*.yml", "*.json")
FILES: dict[str, Any] = {
    "CONFIG": CONFIGS,
    "STUDY": CONFIGS,
    "DATA": shtab.glob("*.csv", "*.parquet"),
    "RUN_DIR": shtab.glob("*.npz"),
    "FILE": shtab.glob("*.toml", "*.json", "*.html", "*.mplstyle", "*.geojson"),
    "DIR": shtab.DIRECTORY,
}
"""What is offered where an argument's metavar stands: files by their endings, and folders always."""


def run(arguments: Namespace) -> int:
    """Print the script of a shell."""
    print(completion_script(arguments.parser, arguments.shell))
    return DONE


def completion_script(parser: ArgumentParser, shell: str) -> str:
    """Return the script that makes a shell complete the commands of a parser, with the kinds that are installed.

    Parameters
    ----------
    parser
        The command line's; its actions are marked with what is offered, so it is of no other use afterwards.
    shell
        "bash", "zsh" or "fish".
    """
    kinds: dict[str, list[str]] = {}
    for entry in Registry.installed():
        kinds.setdefault(entry.role, []).append(entry.kind)
    papers = sorted(kinds.get("reproduction", []))
    components = sorted({kind for role, names in kinds.items() if role not in APART for kind in names})
    words = {"PAPER": papers, "ROLE_OR_KIND": [*dict.fromkeys([*kinds, *components])]}
    _mark(parser, FILES | {"WHAT": _or_config(components)}, words)
    return str(shtab.complete(parser, shell))


def _mark(parser: ArgumentParser, files: dict[str, Any], words: dict[str, list[str]]) -> None:
    for action in parser._actions:
        if isinstance(action, _SubParsersAction):
            for listed in action._choices_actions:
                # shtab tells a command's description, which is too long for a list of commands
                action.choices[listed.dest].description = listed.help
            for below in action.choices.values():
                _mark(below, files, words)
        elif action.choices is None and action.metavar in words:
            action.choices = words[action.metavar]
        elif action.choices is None and action.metavar in files:
            action.complete = files[action.metavar]  # type: ignore[attr-defined]


def _or_config(words: list[str]) -> dict[str, Any]:
    """Return what offers words, and configs beside them."""
    listed, preamble = " ".join(words), CONFIGS["preamble"]
    function = f'_vedette_glob() {{ compgen -W \'{listed}\' -- "$1"; {CONFIGS["bash"]} "$1"; }}'
    return {
        "bash": "_vedette_glob",
        "zsh": f"{{compadd -- {listed}; {CONFIGS['zsh']}}}",
        "fish": f"{listed} {CONFIGS['fish']}",
        "preamble": {**preamble, "bash": f"{preamble['bash']}\n{function}"},
    }
