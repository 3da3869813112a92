"""The example of a third-party plugin: the page quotes its files, it is as short as said, and it keeps the laws."""

import importlib.util
import sys

import pytest

import vedette
from support.paths import ROOT
from vedette.config.registry import Registry
from vedette.testing import FAST, consistency, examine, laws_of
from vedette.testing.strategies import components

TEMPLATE = ROOT / "examples/plugin_template"
FILES = ["pyproject.toml", "src/vedette_clothoid/__init__.py", "tests/test_clothoid.py", "road.toml"]


@pytest.fixture(scope="module")
def clothoid():
    spec = importlib.util.spec_from_file_location("vedette_clothoid", TEMPLATE / FILES[1])
    module = importlib.util.module_from_spec(spec)
    sys.modules["vedette_clothoid"] = module
    spec.loader.exec_module(module)
    yield module.Clothoid
    del sys.modules["vedette_clothoid"]


@pytest.mark.parametrize("name", FILES)
def test_the_page_quotes_the_file_as_it_is(name):
    page = (ROOT / "docs/write-a-plugin.md").read_text()
    language = "python" if name.endswith(".py") else "toml"
    assert f"`{name}`:\n\n```{language}\n{(TEMPLATE / name).read_text()}```\n" in page


def test_it_is_shorter_than_forty_lines():
    lines = [line for name in FILES for line in (TEMPLATE / name).read_text().splitlines() if line.strip()]
    assert len(lines) < 40


def test_it_keeps_the_laws(clothoid):
    drawn = components(clothoid)
    outcomes = [examine(clothoid, law, drawn, FAST) for law in laws_of(clothoid)]
    assert [outcome.law.name for outcome in outcomes if outcome.verdict == "failed"] == []
    assert sum(outcome.verdict == "held" for outcome in outcomes) == 10


def test_it_works_in_a_config(clothoid):
    registry = Registry.of(clothoid, *(entry.cls for entry in Registry.installed()))
    experiment = vedette.load(TEMPLATE / "road.toml", registry)
    result = experiment.run()
    assert len(result.tracks) == 1
    prior = {"x": (0, 3), "y": (0, 3), "heading": (0, 0.05), "speed": (15, 1), "curvature": (0, 2), "sharpness": (0, 1)}
    assert consistency(experiment.tracker, prior=prior, runs=100, scans=20, interval=0.5).consistent
