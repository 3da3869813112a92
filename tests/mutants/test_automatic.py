"""The frozen mutants are many of each role."""

from collections import Counter

from mutants.automatic.draw import COUNTS, frozen


def test_there_are_at_least_fifty_of_each_role_and_no_site_twice():
    mutants = frozen()
    assert Counter(mutant.role for mutant in mutants) == COUNTS
    assert len({(mutant.role, mutant.file, mutant.function, mutant.site) for mutant in mutants}) == len(mutants) == 570
