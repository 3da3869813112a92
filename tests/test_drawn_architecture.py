"""The picture of the architecture shows the imports that are in the code today, and the page names what is public."""

import importlib.util
import re

import pytest

from support.architecture import PUBLIC
from support.paths import DOCS, ROOT

SPEC = importlib.util.spec_from_file_location("draw_architecture", DOCS / "draw_architecture.py")
DRAWING = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(DRAWING)

OUTSIDE = {("plugins", "core")}
PAGE = (DOCS / "architecture.md").read_text(encoding="utf-8")


def drawn():
    """Return the arrows in the picture, which are groups with the names of both rooms as their id."""
    return set(re.findall(r'<g id="(\w+)\.(\w+)"', DRAWING.PICTURE.read_text(encoding="utf-8")))


@pytest.mark.costly
def test_the_arrows_in_the_picture_are_the_imports_in_the_code():
    assert drawn() == DRAWING.arrows() | DRAWING.arrows_of_plugins() | OUTSIDE, (
        "the imports have changed: run `python docs/draw_architecture.py`"
    )


def test_every_room_has_a_place_and_every_place_a_room():
    rooms = {DRAWING.room(f"vedette.{path.stem}") for path in (ROOT / "core/vedette").iterdir() if is_room(path)}
    assert rooms == set(DRAWING.PLACES)


def is_room(path):
    return (path.is_dir() and (path / "__init__.py").exists()) or (path.suffix == ".py" and path.name != "__init__.py")


@pytest.mark.parametrize("above", DRAWING.PLACES)
def test_arrows_point_down(above):
    level = {name: y for name, (_, y, _) in DRAWING.PLACES.items()}
    assert [there for here, there in DRAWING.arrows() if here == above and level[there] >= level[here]] == []


def test_imports_are_found_wherever_they_stand():
    source = """
import vedette.config.builder
from vedette import kernels, Gate
from typing import TYPE_CHECKING
if TYPE_CHECKING:
    from vedette.metrics import Judge
def later():
    from vedette.tracking.state import State
"""
    found = {DRAWING.room(name) for name in DRAWING.imported(DRAWING.ast.parse(source), DRAWING.homes())}
    assert found == {"config", "kernels", "tracking", "metrics"}


def test_an_arrow_that_others_go_along_is_not_needed():
    assert DRAWING.needed({("a", "b"), ("b", "c"), ("a", "c"), ("c", "d"), ("a", "d"), ("e", "d")}) == {
        ("a", "b"),
        ("b", "c"),
        ("c", "d"),
        ("e", "d"),
    }


def test_the_page_names_the_public_modules_and_no_other():
    (table,) = re.findall(r"## What is public\n.*?\n((?:\|.*\n)+)", PAGE, re.S)
    assert set(re.findall(r"^\| `(vedette[\w.]*)` \|", table, re.M)) == set(PUBLIC)


def test_the_page_names_every_room():
    rooms = {name for name in DRAWING.PLACES if name != "ground"} | set(DRAWING.GROUND)
    assert [name for name in sorted(rooms) if not re.search(rf"^\s+{name}(/|\.py)", PAGE, re.M)] == []


def test_the_files_and_names_that_the_walks_pass_are_there():
    paths = re.findall(r"`((?:core|plugins|examples|tests|docs|simulators)/[\w./-]+\.\w+)`", PAGE)
    assert len(paths) > 10
    assert [path for path in paths if not (ROOT / path).exists()] == []
    for path, names in re.findall(r"\| `(core/[\w/]+\.py)` \| ((?:`\w+`(?:, )?)+) \|", PAGE):
        source = (ROOT / path).read_text(encoding="utf-8")
        for name in re.findall(r"`(\w+)`", names):
            assert re.search(rf"(def|class) {name}\b|^{name}\b", source, re.M), f"{path} has no {name}"
