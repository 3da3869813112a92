"""No circles in the core, and nobody else imports what is private to it. The order of its rooms is in pyproject.toml."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import pytest

from support.architecture import PUBLIC, all_of_vedette, circles, core, imported, imports, lines_of_code, modules
from support.closure import closure
from support.paths import ROOT

OTHERS = {name: ROOT / name for name in ("plugins", "simulators", "examples")}


def test_no_module_of_the_core_leads_back_to_itself() -> None:
    graph = imports(core())
    assert len(graph) > 100
    assert graph["vedette.config.builder"] > {"vedette.config.registry", "vedette.errors"}
    assert circles(graph) == []


@pytest.mark.parametrize(
    "line",
    [
        "import pkg.b",
        "from pkg.b import name",
        "from pkg import b",
        "def later():\n    from pkg.b import name",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from pkg.b import name",
    ],
)
def test_a_circle_is_seen_however_it_is_closed(line: str, tmp_path: Path) -> None:
    (tmp_path / "pkg").mkdir()
    sources = {"__init__": "", "a": line, "b": "from pkg.c import name", "c": "import pkg.a", "d": "import pkg.a"}
    for name, source in sources.items():
        (tmp_path / "pkg" / f"{name}.py").write_text(source)
    assert circles(imports(modules(tmp_path))) == [["pkg.a", "pkg.b", "pkg.c"]]


@pytest.mark.parametrize("folder", OTHERS)
def test_others_import_public_modules_only(folder: str) -> None:
    known = all_of_vedette()
    seen, private = set(), []
    for path in sorted(OTHERS[folder].rglob("*.py")):
        for name in imported(path.read_text(encoding="utf-8"), known):
            seen.add(name)
            own = path.relative_to(OTHERS[folder]).parts[0]
            if name not in PUBLIC and name.partition(".")[0] != own:
                private.append(f"{path.relative_to(ROOT)} imports {name}")
    assert "vedette" in seen
    assert private == []


@pytest.mark.parametrize("name", PUBLIC)
def test_public_modules_are_there_and_say_what_they_are_for(name: str) -> None:
    module = import_module(name)
    assert module.__doc__
    for one in dir(module):
        if not one.startswith("_"):
            getattr(module, one)


@pytest.mark.parametrize(("module", "most"), [("vedette.tracking.tracker", 7_000), ("vedette.config", 11_000)])
def test_what_a_step_needs_and_what_build_needs_can_be_read(module: str, most: int) -> None:
    """The lines of code, without blanks, comments and docstrings, of a module and of all that it imports."""
    files = closure([module])
    assert len(files) > 30
    assert sum(map(lines_of_code, files)) <= most


@pytest.mark.parametrize(("room", "most"), [(".", 15_213), ("testing", 5_826)])
def test_the_core_stays_small(room: str, most: int) -> None:
    """A limit that was passed unnoticed is none: what goes beyond belongs to a plugin."""
    assert 0.9 * most < sum(map(lines_of_code, (ROOT / "core" / "vedette" / room).rglob("*.py"))) <= most
