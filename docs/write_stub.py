"""Write the types of names that packages of the core look up when they are first used: `python docs/write_stub.py`.

They are its own, and those that entry points bring.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path

import vedette
from vedette import testing

ROOT = Path(__file__).parents[1]
CORE = ROOT / "core" / "vedette"


def stubs() -> dict[Path, str]:
    """Return the stubs by their files: a line for each name."""
    homes = [*_homes("vedette", vedette._HOME_OF), *(("vedette", room) for room in vedette._ROOMS)]
    return {
        CORE / "__init__.pyi": _stub(homes) + "\n__version__: str\n",
        CORE / "testing" / "__init__.pyi": _stub(_homes("vedette.testing", testing._HOME_OF)),
    }


def _homes(package: str, own: Mapping[str, str]) -> list[tuple[str, str]]:
    """Return module and name of each name of a package: its own, and those that entry points bring."""
    homes = [(f"{package}.{home}", name) for name, home in own.items()]
    points = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["entry-points"]
    for name, value in points[f"{package}.names"].items():
        module, _, attribute = value.partition(":")
        assert attribute == name, f"{value} must have the name {name}"
        homes.append((module, name))
    return homes


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
