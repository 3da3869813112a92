"""docs/config.md says what is so."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from support.paths import DOCS
from vedette import ConfigError, load
from vedette.units import in_unit, spellings
from vedette_tools.json_schema import schema

PAGE = (DOCS / "config.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)


@pytest.fixture
def coast(tmp_path: Path) -> Path:
    path = tmp_path / "coast.toml"
    path.write_text(blocks("toml")[0])
    return path


def test_its_example_builds_with_each_of_its_overrides(coast: Path) -> None:
    plain = load(coast)
    overrides = re.findall(r"^--set '?(.*?)'?$", PAGE, re.MULTILINE)
    assert len(overrides) == 5
    assert all(load(coast, overrides=[override]) != plain for override in overrides)


def test_its_errors_are_told_in_these_words(coast: Path) -> None:
    (errors,) = [block for block in blocks("text") if "must be" in block]
    wrong = ["estimator.modes[1].motion.sigma_accel=-3", "sensors.north.sigma_range=10 s", "associator.kind=pdaf"]
    coast.write_text(re.sub(r"\[lifecycle\].*?\n\n", "", coast.read_text(), flags=re.DOTALL))
    with pytest.raises(ConfigError) as caught:
        load(coast, overrides=[*wrong, "gate.probabilty=0.9"])
    told = sorted(str(caught.value).splitlines())
    # What is installed may be more than the page lists.
    assert [line.partition(" installed")[0] for line in told] == sorted(
        line.partition(" installed")[0] for line in errors.splitlines()
    )


def test_its_names_are_those_of_the_top_level() -> None:
    rows = re.findall(r"^\| `(\S+)` \| .* \| (.*) \|$", PAGE, re.MULTILINE)
    top = schema()
    assert sorted(name for name, _ in rows) == sorted(top["properties"])
    assert [name for name, needed in rows if needed == "yes"] == top["required"]


def test_its_units_are_those_that_are_understood() -> None:
    rows = re.findall(r"^\| (\S+) \| (\S+(?:, \S+)+) \|$", PAGE, re.MULTILINE)
    assert len(rows) == 13
    for unit, written in rows:
        assert spellings(unit) == tuple(written.split(", "))
        assert all(in_unit(f"1 {spelling}", unit) > 0 for spelling in spellings(unit))
