"""The best joint associations of hypotheses, and marginals of them: equal to enumeration, in both twins."""

import numpy as np
import pytest
import scipy.optimize  # noqa: F401  the reference imports it when first called, which must not count as a test's time
from hypothesis import given
from hypothesis import strategies as st

from support.joint import drawn_scores, joint_associations, marginals
from vedette import kernels
from vedette.kernels import assignment
from vedette_standard.associators.marginals import marginals_of_table

TWINS = [pytest.param(kernels.best_joint, id="running"), pytest.param(assignment.best_joint, id="reference")]
seeds = st.integers(0, 2**32 - 1)
ALL = 2000
"""More than there are joint associations of 5 tracks and 5 returns: 1,546."""


@pytest.mark.parametrize("best_joint", TWINS)
@given(seeds, st.integers(0, 4), st.integers(0, 4), st.integers(1, 3))
@pytest.mark.by_turns
def test_each_hypothesis_has_the_best_of_its_own_associations(best_joint, seed, t, k, h):
    rng = np.random.default_rng(seed)
    scores = drawn_scores(rng, max(2 * t, 1), k)
    leaves = rng.integers(-1, 2, (h, t)) + 2 * np.arange(t)
    leaves = np.where(rng.random((h, t)) < 0.2, -1, np.maximum(leaves, 0))
    wanted = rng.integers(1, 30, h)
    origin, choice, total = best_joint(scores, leaves, wanted)
    assert choice.shape == (len(origin), t)
    for row in range(h):
        there = leaves[row] >= 0
        _, every = joint_associations(scores[leaves[row, there]])
        own = origin == row
        np.testing.assert_allclose(total[own], np.sort(every)[::-1][: wanted[row]], rtol=1e-12, atol=1e-12)
        assert not choice[own][:, ~there].any()
        for one, score in zip(choice[own], total[own], strict=True):
            used = scores[leaves[row, there], one[there]]
            assert np.isclose(used.sum(), score, rtol=1e-12, atol=1e-12)
            assert len(set(one[one > 0])) == np.count_nonzero(one)
        assert len({tuple(one) for one in choice[own]}) == own.sum()


@pytest.mark.parametrize("best_joint", TWINS)
def test_two_tracks_alike_at_two_returns_alike_come_to_an_end(best_joint):
    """As where a return is there twice: by rounding, the way back to a free return led through itself, for ever."""
    alike = [-3.9, 0.6, 5.3, 0.6]
    scores = np.array([alike, [-3.5, 2.0, -0.4, 2.0], [-2.8, -4.0, -4.5, -4.0], alike])
    _, choice, total = best_joint(scores, np.arange(4)[None], np.array([ALL]))
    np.testing.assert_allclose(total, np.sort(joint_associations(scores)[1])[::-1])
    assert len({tuple(one) for one in choice}) == len(total)


@pytest.mark.parametrize("best_joint", TWINS)
def test_an_impossible_miss_is_taken_only_where_nothing_else_is_left(best_joint):
    scores = np.array([[-np.inf, 1.0], [-2500.0, 2.0]])
    _, choice, total = best_joint(scores, np.array([[0, 1]]), np.array([5]))
    assert choice.tolist() == [[1, 0], [0, 1], [0, 0]]
    assert np.all(np.isfinite(total))
    assert np.all(np.diff(total[1:]) < -1000)


@given(seeds, st.integers(0, 5), st.integers(0, 5))
def test_all_of_them_give_the_marginals_of_the_enumeration(seed, t, k):
    scores = drawn_scores(np.random.default_rng(seed), t, k)
    np.testing.assert_allclose(marginals_of_table(scores, ALL)[0], marginals(scores), rtol=1e-12, atol=1e-12)


def test_few_of_them_are_weighted_as_if_there_were_no_others():
    scores = np.log(np.array([[0.1, 0.6, 0.3], [0.2, 0.5, 0.3]]))
    choices, totals = joint_associations(scores)
    best = np.argsort(-totals)[:2]
    likely = np.exp(totals[best])
    expected = np.zeros((2, 3))
    for choice, share in zip(choices[best], likely / likely.sum(), strict=True):
        expected[range(2), choice] += share
    np.testing.assert_allclose(marginals_of_table(scores, 2)[0], expected, rtol=1e-12)
    np.testing.assert_allclose(marginals_of_table(np.stack([scores, scores]), 2)[0][1], expected, rtol=1e-12)


def test_a_joint_association_that_is_all_but_impossible_weighs_nothing():
    scores = np.stack([[[-offset, 0.0]] for offset in np.linspace(700.0, 760.0, 121)])
    weights = marginals_of_table(scores, ALL)[0]
    assert not np.any((weights > 0) & (weights < np.finfo(float).tiny))
    assert np.any(weights[:, 0, 0] > 0)
    assert np.any(weights[:, 0, 0] == 0)
