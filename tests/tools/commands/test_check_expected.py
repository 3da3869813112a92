"""`vedette check` on kinds that break a law on purpose, and on parameters that name what to try."""

import hypothesis
import pytest
from attrs import frozen

from vedette import fields
from vedette.cli import main
from vedette.testing import conformance
from vedette.testing.law import Profile
from vedette.testing.strategies import components
from vedette_flir.lifecycles.reappearing import ReappearingTarget
from vedette_tools.commands.check import check


@pytest.mark.costly
def test_laws_broken_on_purpose_are_told_and_fail_nothing(capsys):
    assert main(["check", "reappearing_target"]) == 0
    told = capsys.readouterr().out
    assert "unseen_tracks_end" in told
    assert "broken  on purpose: the given targets are kept to the end, lost or not" in told


@pytest.mark.costly
def test_a_law_declared_broken_that_holds_is_a_failure(capsys, monkeypatch):
    monkeypatch.setattr(ReappearingTarget, "known_failures", {"pure": "no reason at all"})
    found = check(ReappearingTarget, Profile.named("fast", 0))
    capsys.readouterr()
    verdicts = {law["law"]: (law["verdict"], law["text"]) for law in found["laws"]}
    assert verdicts["pure"] == ("failed", "it holds, and is declared to be broken on purpose: no reason at all")
    assert verdicts["unseen_tracks_end"][0] == "failed"
    assert found["failed"]


def test_declared_failures_are_expected_by_the_tests_of_the_kit():
    marks = [mark.name for mark in conformance(ReappearingTarget).test_unseen_tracks_end.pytestmark]
    assert "xfail" in marks


@frozen
class Chosen:
    """What has one number and one table, with values for the kit."""

    gain: float = fields.quantity("1", "a gain", above=0, tried=(0.5, 2.0))
    weight: dict[str, float] = fields.table("axis to its weight", tried=({"x": 1.0},))


def test_the_kit_tries_the_values_that_a_parameter_names():
    seen = set()

    @hypothesis.settings(max_examples=30, database=None)
    @hypothesis.given(components(Chosen))
    def look(one):
        seen.add((one.gain, tuple(one.weight.items())))

    look()
    assert seen == {(0.5, (("x", 1.0),)), (2.0, (("x", 1.0),))}
