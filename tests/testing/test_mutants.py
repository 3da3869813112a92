"""The laws bite: components with one thing wrong, each caught by the law that is named for it."""

import re
from collections import Counter

import pytest

from support.mutants.table import MUTANTS, mutant, tried
from vedette.config.parameters import role_of
from vedette.config.registry import Registry

OF_LAWS = {row[2]: row[0] for row in reversed(MUTANTS)}
"""A mutant of each law is tried by day, the others of it by turns."""

CASES = [
    pytest.param(*row, id=f"{row[1].__name__}: {row[0]}", marks=() if OF_LAWS[row[2]] == row[0] else pytest.mark.by_turns)
    for row in MUTANTS
]


MISMADE = re.compile(r"AttributeError|NameError|TypeError: (?!rng\.)")
"""What a mutant raises that its base has outgrown: it would be caught whatever the law says."""


@pytest.mark.parametrize(("what", "base", "law", "methods", "strategies"), CASES)
def test_a_mutant_is_caught_by_the_law_named_for_it(what, base, law, methods, strategies):
    outcome = tried(mutant(base, methods), law, strategies)
    assert outcome.verdict == "failed"
    assert not MISMADE.search(outcome.text), outcome.text


FIRST = {(base, law): strategies for _, base, law, _, strategies in reversed(MUTANTS)}
INSTALLED = {entry.cls for entry in Registry.installed()}
RIGHT = [
    pytest.param(base, law, strategies, marks=pytest.mark.kind.with_args(base), id=f"{base.__name__}: {law}")
    for (base, law), strategies in FIRST.items()
    if not (base in INSTALLED and strategies == {}) and "long" not in law  # `test_conformance` tries those
]


@pytest.mark.parametrize(("base", "law", "strategies"), RIGHT)
def test_the_unmutated_component_passes(base, law, strategies):
    outcome = tried(base, law, strategies)
    assert outcome.verdict in ("held", "skipped"), outcome.text  # skipped: the mutant declares what its base does not


def test_there_are_sixty_mutants_over_all_roles():
    roles = Counter(role_of(row[1]) for row in MUTANTS)
    assert sum(roles.values()) >= 60
    assert set(roles) == {
        "motion",
        "sensor",
        "associator",
        "estimator",
        "lifecycle",
        "preprocessor",
        "source",
        "birth",
        "format",
    }
