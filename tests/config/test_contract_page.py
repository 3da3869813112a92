"""The page on contract 2 tells of every old name that the registry refuses, and of every key that is read as another."""

import importlib
import re

import pytest

from support.paths import DOCS
from vedette.config.contract import OLD_NAMES
from vedette.config.parameters import ROLES
from vedette.config.renames import MOVED, RENAMED

PAGE = (DOCS / "contract-2.md").read_text(encoding="utf-8")
ROWS = [[cell.strip() for cell in line.strip("| ").split(" | ")] for line in PAGE.splitlines() if line.startswith("|")]
NAMES = [(role, old, new) for role, names in OLD_NAMES.items() for old, new in names.items()]


@pytest.mark.parametrize(("role", "old", "new"), NAMES)
def test_each_old_name_stands_beside_the_new_one(role, old, new):
    rows = [row for row in ROWS if row[0] == role and re.match(rf"`{old}\b", row[1])]
    assert len(rows) == 1
    word = re.findall(r"`(\w+)`", new)[0]
    assert re.search(rf"`{word}\b", rows[0][2])


def test_the_table_has_no_other_names_and_the_new_ones_are_there():
    rows = [row for row in ROWS if row[0] in ROLES]
    assert {(row[0], re.findall(r"\w+", row[1])[0]) for row in rows} == {(role, old) for role, old, _ in NAMES}
    for role, _, new in rows:
        word = re.findall(r"`(\w+)", new)[0]
        assert (
            hasattr(ROLES["birth" if "role Birth" in new else role], word)
            or word == "vedette_files"
            or role == "reproduction"
        )


def test_each_moved_key_is_told():
    for old, new in RENAMED.items():
        assert [f"`{old}`", f"`{new}`"] in ROWS
    (row,) = [row for row in ROWS if row[0].startswith("`lifecycle.")]
    assert tuple(re.findall(r"`(?:lifecycle)?\.(\w+)`", row[0])) == MOVED


def test_modules_that_are_named_as_new_are_there_and_the_old_ones_are_gone():
    after = PAGE.index("## Roles and modules")
    for old, new in [row for row in ROWS if PAGE.index(" | ".join(row)) > after and "`vedette." in row[0]]:
        for name in re.findall(r"`(vedette\.\w+)`", old):
            with pytest.raises(ModuleNotFoundError):
                importlib.import_module(name)
        for name in re.findall(r"`(vedette\.[a-z]\w+)`", new):
            assert importlib.import_module(name).__doc__
