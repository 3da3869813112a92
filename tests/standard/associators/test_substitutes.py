"""Existence of targets that some hypotheses hold under another track: by the returns that both took last."""

import numpy as np
import pytest

from vedette.hypotheses import Hypotheses
from vedette_standard.associators.k_best import KBest

LEAVES = np.array([0, 0, 1, 2])
"""Track 0 as the heaviest hypothesis and as the other one has it; track 1, of the heaviest; track 2, of the other."""


def existence(other, last, *, own=None):
    """Of two hypotheses of .6 and .4: the heaviest holds tracks 0 and 1, the other one these leaves."""
    leaves = np.array([0, 2, *other])
    found = Hypotheses(
        np.zeros(2, dtype=int),
        np.array([0.6, 0.4]),
        np.array([0, 2, len(leaves)]),
        leaves,
        LEAVES,
        np.zeros((4, 0), dtype=int),
    )
    return KBest().existence(found, np.ones(4) if own is None else np.array(own), np.array(last))


def test_a_target_is_there_under_the_track_that_took_its_return():
    """The leaves took but one return alike: what else they gave, each hypothesis may have taken for the return of two."""
    found = existence([1, 3], [[1, 2, 5], [1, 2, 5], [3, 4, 6], [-1, 3, 7]])
    np.testing.assert_allclose(found[[0, 2]], [1.0, 1.0])


def test_tracks_may_have_changed_places():
    """The other hypothesis has track 0 where the heaviest has 1, and 2 where that has 0."""
    found = existence([1, 3], [[1, 2, 5], [3, 4, 6], [3, 4, 7], [-1, 2, 8]], own=[1.0, 0.95, 1.0, 0.9])
    np.testing.assert_allclose(found[2], 0.6 + 0.4 * 0.9)


@pytest.mark.parametrize("other", [[1], [1, 3]])
def test_no_target_exists_by_one_that_was_there_anyway(other):
    """Track 0 took in the other hypothesis what track 1 took in the heaviest; a third track is elsewhere, or is not."""
    found = existence(other, [[1, 2, 5], [3, 2, 6], [-1, 3, 7], [-1, -1, 9]])
    np.testing.assert_allclose(found[[0, 2]], [1.0, 0.6])


def test_one_track_stands_for_one_target():
    """The other hypothesis holds one target where the heaviest holds two, which shared its returns: one of them is there."""
    found = existence([3], [[1, 2, 5], [-1, -1, 4], [-1, 3, 6], [2, 3, 8]])
    np.testing.assert_allclose(np.sort(found[[0, 2]]), [0.6, 1.0])
