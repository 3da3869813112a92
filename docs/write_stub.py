"""Write the types of `vedette`'s names, its own and those that entry points bring: `python docs/write_stub.py`."""

from __future__ import annotations

import tomllib
from pathlib import Path

import vedette

ROOT = Path(__file__).parents[1]
STUB = ROOT / "core" / "vedette" / "__init__.pyi"


def stub() -> str:
    """Return the stub: a line for each name."""
    document = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    homes = [(f"vedette.{home}", name) for name, home in vedette._HOME_OF.items()]
    for name, value in document["project"]["entry-points"]["vedette.names"].items():
        module, _, attribute = value.partition(":")
        assert attribute == name, f"{value} must have the name {name}"
        homes.append((module, name))
    homes += [("vedette", room) for room in vedette._ROOMS]
    lines = [f"from {module} import {name} as {name}" for module, name in sorted(homes)]
    return "\n".join(['"""Written by docs/write_stub.py."""', "", *lines, "", "__version__: str", ""])


if __name__ == "__main__":
    STUB.write_text(stub(), encoding="utf-8")
