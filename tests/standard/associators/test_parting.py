"""Clusters that part where truncation would change more: what that changes, against enumeration."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.hypotheses import together
from support.joint import drawn_scores, joint_associations, marginals
from vedette.hypotheses import JointHypotheses, LeafScores
from vedette_standard.associators import parting
from vedette_standard.associators.k_best import KBest

seeds = st.integers(0, 2**32 - 1)
MANY = 10**9


def joint(scores):
    """What each track takes in every joint association, with its probability."""
    choices, totals = joint_associations(scores)
    likely = np.exp(totals - totals.max())
    return dict(zip(map(tuple, choices.tolist()), (likely / likely.sum()).tolist(), strict=True))


def alone(scores):
    """The probability of each choice of each track, were it alone."""
    likely = np.exp(scores)
    return likely / likely.sum(axis=-1, keepdims=True)


def told(branching, tracks):
    """What each track takes, with its probability, over the products of all clusters."""
    found = {}
    for weight, leaves in together(branching.hypotheses):
        taken = [0] * tracks
        for leaf in leaves:
            taken[branching.parent[leaf]] = int(branching.choice[leaf])
        found[tuple(taken)] = found.get(tuple(taken), 0.0) + weight
    return found


def grown(scores, most):
    """Tracks, each a cluster of its own, that part where that changes no more than `most`; none of them begins."""
    hypotheses = JointHypotheses.of(len(scores))
    apart, returns = parting.parted(hypotheses, LeafScores.of(scores), np.full(len(scores), most))
    after = hypotheses.grown(apart, np.zeros(apart.k, dtype=bool), MANY, 0.0)
    return after, np.append(0, 1 + returns)[after.choice]


@given(seeds, st.integers(2, 4), st.integers(1, 3), st.sampled_from([0.01, 0.1, 0.4]))
def test_what_parting_changes_is_within_its_bound(seed, tracks, k, most):
    """Total variation: at most the links that were cut, over the probability that no part contradicts itself."""
    scores = drawn_scores(np.random.default_rng(seed), tracks, k)
    after, choice = grown(scores, most)
    part = after.hypotheses.cluster_of[np.searchsorted(after.parent, range(tracks))]
    own, exact = alone(scores), joint(scores)
    both = own[:, 1:] @ own[:, 1:].T
    cut = part[:, None] != part[None, :]
    assert np.all(both[cut] < most)
    consistent = 1.0
    for one in np.unique(part):
        rows = np.flatnonzero(part == one)
        ways, _ = joint_associations(scores[rows])
        consistent *= float(np.sum(np.prod(own[rows, ways], axis=-1)))
    found = told(type(after)(after.parent, choice, after.hypotheses), tracks)
    changed = sum(max(0.0, weight - exact.get(taken, 0.0)) for taken, weight in found.items())
    assert changed <= 0.5 * float(np.sum(both[cut])) / consistent + 1e-9


@given(seeds, st.integers(2, 4), st.integers(1, 3))
def test_where_nothing_may_change_none_part(seed, tracks, k):
    scores = drawn_scores(np.random.default_rng(seed), tracks, k)
    scores[:, 1:] -= 400.0
    apart, returns = parting.parted(JointHypotheses.of(tracks), LeafScores.of(scores), np.zeros(tracks))
    assert apart.k == k
    np.testing.assert_array_equal(returns, np.arange(k))
    np.testing.assert_array_equal(apart.returns, LeafScores.of(scores).returns)


def crowd(tracks=40):
    """A row of tracks, each with a return of its own and a tenth as likely that of the next: hypotheses beyond counting."""
    scores = np.full((tracks, 1 + tracks), -np.inf)
    scores[:, 0] = 0.0
    scores[range(tracks), range(1, 1 + tracks)] = np.log(2.0)
    scores[range(tracks - 1), range(2, 1 + tracks)] = np.log(0.2)
    return scores


def share_of_a_miss(branching, hypotheses, tracks):
    """The probability that each track took nothing."""
    missed = branching.choice == 0
    return np.bincount(branching.parent[missed], hypotheses.probability[missed], tracks)


def test_the_tracks_of_a_crowd_are_as_certain_as_all_associations_say(monkeypatch):
    """The hundred best associations of forty tracks hold one thing alike of most of them."""
    scores = crowd()
    exact = marginals(crowd(5))[2, 0]  # of one in the middle: what is farther away counts for next to nothing
    errors = []
    for less in (parting.LESS, 0.0):
        monkeypatch.setattr(parting, "LESS", less)
        found = KBest().branch(JointHypotheses.of(len(scores)), LeafScores.of(scores), np.zeros(len(scores), dtype=bool))
        errors.append(np.abs(share_of_a_miss(found, found.hypotheses, len(scores))[2:-2] - exact).max())
    assert errors[0] < 0.05 < 0.2 < errors[1], errors


def test_a_track_begins_once_at_a_return_that_parts_share():
    scores = crowd()
    begins = np.ones(len(scores), dtype=bool)
    found = KBest().branch(JointHypotheses.of(len(scores)), LeafScores.of(scores), begins)
    begun = found.choice[found.parent < 0]
    assert len(np.unique(begun)) == len(begun)
    assert np.max(found.choice) <= len(scores)
    assert found.hypotheses.cluster[-1] > 10


def test_few_associations_are_grown_as_ever(monkeypatch):
    monkeypatch.setattr(parting, "parted", pytest.fail)
    scores = drawn_scores(np.random.default_rng(3), 3, 3)
    KBest(MANY, 0.0).branch(JointHypotheses.of(3), LeafScores.of(scores), np.ones(3, dtype=bool))


def test_a_cluster_that_is_driven_from_its_return_stays_with_whom_it_then_meets():
    """The first would take the second return, which the second surely has; so it wants the first, which the third has."""
    likely = np.array([[1e-3, 1e-3, 1.0], [1e-9, 0.0, 1.0], [1e-9, 1.0, 0.0]])
    with np.errstate(divide="ignore"):
        apart, _ = parting.parted(JointHypotheses.of(3), LeafScores.of(np.log(likely)), np.full(3, 0.1))
    assert apart.k == 2
