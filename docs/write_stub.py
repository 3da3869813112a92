"""Write the types of names that packages of the core look up when they are first used: `python docs/write_stub.py`.

Those of `vedette` are its own, and those that entry points bring.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from pathlib import Path

import vedette
from vedette import testing

ROOT = Path(__file__).parents[1]
CORE = ROOT / "core" / "vedette"


def stubs() -> dict[Path, str]:
    """Return the stubs by their files: a line for each name."""
    document = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    homes = [(f"vedette.{home}", name) for name, home in vedette._HOME_OF.items()]
    for name, value in document["project"]["entry-points"]["vedette.names"].items():
        module, _, attribute = value.partition(":")
        assert attribute == name, f"{value} must have the name {name}"
        homes.append((module, name))
    homes += [("vedette", room) for room in vedette._ROOMS]
    of_testing = [(f"vedette.testing.{home}", name) for name, home in testing._HOME_OF.items()]
    return {
        CORE / "__init__.pyi": _stub(homes) + "\n__version__: str\n",
        CORE / "testing" / "__init__.pyi": _stub(of_testing),
    }


def _stub(homes: Iterable[tuple[str, str]]) -> str:
    lines = [f"from {module} import {name} as {name}" for module, name in sorted(homes, key=_order)]
    return "\n".join(['"""Written by docs/write_stub.py."""', "", *lines, ""])


def _order(home: tuple[str, str]) -> tuple[str, bool, bool, str]:
    """Return where ruff sorts an import: of one module constants, then classes, then functions."""
    module, name = home
    return module, not name.isupper(), not name[0].isupper(), name


if __name__ == "__main__":
    for path, text in stubs().items():
        path.write_text(text, encoding="utf-8")
