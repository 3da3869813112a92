"""The frozen mutants are many of each role; those that were measured stay caught, and those that lived were judged."""

import json
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from attrs import evolve

from mutants.automatic import measure
from mutants.automatic.draw import DRAWS, FROZEN, ROLES, frozen
from vedette.testing import FAST

MEASURED = json.loads(Path(FROZEN).with_name("measured.json").read_text())
"""Verdicts by name on all of them."""

JUDGED = json.loads(Path(FROZEN).with_name("judged.json").read_text())
"""Those that live, with a word and why: judged by reading the code. One of another model fails the component's own tests."""


def test_there_are_at_least_fifty_of_each_role_and_no_site_twice():
    mutants = frozen()
    assert Counter(mutant.role for mutant in mutants) == sum(map(Counter, DRAWS.values()), Counter())
    assert len({(mutant.role, mutant.file, mutant.function, mutant.site) for mutant in mutants}) == len(mutants) == 1165


def test_each_is_measured_and_each_that_lives_is_judged():
    assert set(MEASURED) == {mutant.name for mutant in frozen()}
    assert {name for name, verdict in MEASURED.items() if verdict == "lives"} == set(JUDGED)
    assert {word for word, _ in JUDGED.values()} <= {"alike", "below power", "other model", "gap"}


@pytest.mark.nightly("350 mutants, each of which costs 2 s")
@pytest.mark.parametrize("role", ROLES)
def test_those_that_were_caught_are(role):
    from testing.test_conformance import GIVEN

    np.seterr(all="ignore")
    caught = [one for one in frozen() if one.role == role and MEASURED.get(one.name) == "caught"]
    assert caught
    found = {one.name: measure.apart(one, evolve(FAST, shrink=False), GIVEN, [])["verdict"] for one in caught}
    assert {name for name, verdict in found.items() if verdict not in ("caught", "gone")} == set()
