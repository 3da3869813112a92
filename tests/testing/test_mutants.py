"""The laws bite: components with one thing wrong, each caught by the law that is named for it."""

from collections import Counter

import pytest

from support.mutants.table import MUTANTS, mutant, tried
from vedette.config.parameters import role_of


@pytest.mark.parametrize(
    ("what", "base", "law", "methods", "strategies"), MUTANTS, ids=[f"{row[1].__name__}: {row[0]}" for row in MUTANTS]
)
def test_a_mutant_is_caught_by_the_law_named_for_it(what, base, law, methods, strategies):
    assert tried(mutant(base, methods), law, strategies).verdict == "failed"


UNMUTATED = sorted({(row[1], row[2], i) for i, row in enumerate(MUTANTS)}, key=lambda row: row[2])
FIRST = {(base, law): i for base, law, i in reversed(UNMUTATED)}


@pytest.mark.parametrize(("base", "law", "row"), [(*pair, i) for pair, i in FIRST.items() if "long" not in pair[1]])
def test_the_unmutated_component_passes(base, law, row):
    outcome = tried(base, law, MUTANTS[row][4])
    assert outcome.verdict in ("held", "skipped"), outcome.text  # skipped: the mutant declares what its base does not


def test_there_are_sixty_mutants_over_all_roles():
    roles = Counter(role_of(row[1]) for row in MUTANTS)
    assert sum(roles.values()) >= 60
    assert set(roles) == {"motion", "sensor", "associator", "estimator", "lifecycle", "preprocessor", "source", "birth"}
