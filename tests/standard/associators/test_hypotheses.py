"""Associators that keep hypotheses, a scan at a time: held against enumeration and against each other."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.hypotheses import clusters, one_cluster, together
from support.joint import drawn_scores, joint_associations
from vedette import Gaussian, Space
from vedette.hypotheses import JointHypotheses, LeafScores
from vedette_standard.associators import recombined as recombining
from vedette_standard.associators.jpda import Jpda
from vedette_standard.associators.k_best import KBest
from vedette_standard.associators.lmb import LabelledMultiBernoulli
from vedette_standard.associators.marginals import best_marginals
from vedette_standard.associators.n_scan import NScan
from vedette_standard.associators.recombined import recombined
from vedette_standard.associators.variational import Variational

seeds = st.integers(0, 2**32 - 1)
LINE = Space.of(x="m")
MANY = 10**9


def drawn_hypotheses(rng, tracks, count):
    """Hypotheses over two leaves a track, and log scores of the leaves against 0 to 4 returns."""
    leaves = 2 * np.arange(tracks) + rng.integers(0, 2, (count, tracks))
    leaves = np.unique(np.where(rng.random((count, tracks)) < 0.2, -1, leaves), axis=0)
    weights = np.sort(rng.dirichlet(np.ones(len(leaves))))[::-1]
    used = np.unique(leaves[leaves >= 0])
    leaves = np.where(leaves >= 0, np.searchsorted(used, leaves), -1)
    return one_cluster(weights, leaves), drawn_scores(rng, len(used), int(rng.integers(0, 5)))


def in_words(branching, hypotheses):
    """Each hypothesis as a set of (leaf before, return) and (-1, return) for tracks that begin, with its weight."""
    held = {}
    for weight, leaves in together(hypotheses):
        parts = frozenset((int(branching.parent[i]), int(branching.choice[i])) for i in leaves)
        held[parts] = held.get(parts, 0.0) + weight
    return held


@given(seeds, st.integers(0, 3), st.integers(1, 4))
def test_many_hypotheses_grow_into_all_joint_associations(seed, tracks, count):
    rng = np.random.default_rng(seed)
    hypotheses, scores = drawn_hypotheses(rng, tracks, count)
    begins = rng.random(scores.shape[1] - 1) < 0.7
    expected = {}
    for weight, held in clusters(hypotheses)[0]:
        there = np.array(held, dtype=np.int64)
        for choice, score in zip(*joint_associations(scores[there]), strict=True):
            new = {(-1, 1 + j) for j in np.flatnonzero(begins) if 1 + j not in choice}
            parts = frozenset(new | set(zip(there.tolist(), choice.tolist(), strict=True)))
            expected[parts] = expected.get(parts, 0.0) + weight * np.exp(score)
    total = sum(expected.values())
    branching = KBest(MANY, 0.0).branch(hypotheses, LeafScores.of(scores), begins)
    words = in_words(branching, branching.hypotheses)
    assert words.keys() == expected.keys()
    for parts, weight in words.items():
        assert weight == pytest.approx(expected[parts] / total, rel=1e-11, abs=1e-14)
    old = branching.parent >= 0
    assert np.all(np.diff(old.astype(int)) <= 0)
    probability = KBest().probability(branching.hypotheses)
    for leaf, (parent, choice) in enumerate(zip(branching.parent.tolist(), branching.choice.tolist(), strict=True)):
        assert probability[leaf] == pytest.approx(
            sum(w for parts, w in words.items() if (parent, choice) in parts), abs=1e-12
        )


@given(seeds, st.integers(1, 4), st.integers(1, 6))
def test_few_are_the_heaviest_and_light_ones_go(seed, most, count):
    hypotheses, scores = drawn_hypotheses(np.random.default_rng(seed), 3, count)
    begins = np.zeros(scores.shape[1] - 1, dtype=bool)
    every = KBest(MANY, 0.0).branch(hypotheses, LeafScores.of(scores), begins)
    few = KBest(most, 0.05).branch(hypotheses, LeafScores.of(scores), begins)
    assert few.lost is None or np.all((few.lost > 0) & (few.lost < 1))
    assert every.lost is None
    every, few = every.hypotheses.weights, few.hypotheses.weights
    assert len(few) <= most
    assert few[0] >= every[0] * (1 - 1e-9)
    assert np.all(np.diff(few) <= 0)
    assert few.sum() == pytest.approx(1.0)


def test_what_is_dropped_is_counted():
    """Two hypotheses of three associations each, of which one and two are computed, and two in all kept."""
    hypotheses = one_cluster([0.6, 0.4], [[0], [1]])
    scores = LeafScores.of(np.log(np.array([[0.5, 0.3, 0.2], [0.1, 0.2, 0.7]])))
    branching = KBest(2, 0.0).branch(hypotheses, scores, np.zeros(2, dtype=bool))
    # Of .6 x (.5, .3, .2) the first two, of .4 x (.1, .2, .7) the best; of .3, .18 and .28 the two heaviest stay.
    np.testing.assert_allclose(branching.hypotheses.weights, [0.3 / 0.58, 0.28 / 0.58])
    np.testing.assert_allclose(branching.lost, 1.0 - 0.58)


def test_leaves_that_end_leave_equal_hypotheses_which_are_merged():
    hypotheses = one_cluster([0.4, 0.35, 0.25], [[0, 2], [1, 2], [0, 3]])
    kept, rows = KBest().keep(hypotheses, np.array([True, True, False, False]))
    assert rows.tolist() == [0, 1]
    np.testing.assert_allclose(kept.weights, [0.65, 0.35])
    assert clusters(kept)[0][0][1] == (0,)
    nothing, rows = KBest().keep(hypotheses, np.zeros(4, dtype=bool))
    assert (rows.tolist(), clusters(nothing)) == ([], [])


def scan_by_scan(associator, scans):
    """Feed scores scan by scan to two given tracks, whose leaves all score alike, and return what is left at the end."""
    hypotheses = associator.initial_hypotheses(2)
    track = np.arange(2)
    for scores in scans:
        branching = associator.branch(hypotheses, LeafScores.of(scores[track]), np.zeros(scores.shape[1] - 1, dtype=bool))
        track = track[branching.parent]
        hypotheses, rows = associator.keep(branching.hypotheses, np.ones(len(track), dtype=bool))
        track = track[rows]
    return hypotheses, track


CROSSED = [np.log(np.array([[0.1, 0.5, 0.4], [0.1, 0.45, 0.45]]))] * 4


def test_associations_of_n_scans_ago_are_those_of_the_best_hypothesis():
    free, _ = scan_by_scan(KBest(MANY, 0.0), CROSSED)
    wide, _ = scan_by_scan(NScan(9, MANY, 0.0), CROSSED)
    np.testing.assert_allclose(wide.weights, free.weights, rtol=1e-12)
    # 7 ways a scan to share out two returns: those of the first three scans are decided, those of the last one are open.
    narrow, _ = scan_by_scan(NScan(1, MANY, 0.0), CROSSED)
    assert (len(free.weights), len(narrow.weights)) == (7**4, 7)
    assert len({tuple(narrow.past[list(held), 0].tolist()) for _, held in clusters(narrow)[0]}) == 1


def test_what_decisions_drop_is_told_as_lost():
    first, _ = scan_by_scan(NScan(1, MANY, 0.0), CROSSED[:1])
    scores = CROSSED[0][first.track]
    after = NScan(1, MANY, 0.0).branch(first, LeafScores.of(scores), np.zeros(2, dtype=bool))
    assert 0.3 < first.weights[0] < 0.7
    np.testing.assert_allclose(after.lost, 1.0 - first.weights[0], rtol=1e-9)
    assert (
        NScan(2, MANY, 0.0).branch(JointHypotheses.of(2, 2), LeafScores.of(CROSSED[0]), np.zeros(2, dtype=bool)).lost is None
    )


def test_a_track_that_began_within_the_window_is_not_decided_yet():
    associator, scans_open = NScan(2, 100, 0.0), []
    scores = LeafScores.of(np.log(np.array([[0.4, 0.6]])))
    first = associator.branch(associator.initial_hypotheses(1), scores, np.ones(1, dtype=bool))
    hypotheses, rows = associator.keep(first.hypotheses, np.ones(len(first.parent), dtype=bool))
    for _ in range(3):
        count = len(rows)
        missed = associator.branch(hypotheses, LeafScores.of(np.log(np.full((count, 1), 0.5))), np.zeros(0, dtype=bool))
        hypotheses, rows = associator.keep(missed.hypotheses, np.ones(count, dtype=bool))
        scans_open.append(len(together(hypotheses)))
    assert scans_open == [2, 1, 1]


@given(seeds)
@pytest.mark.costly
def test_one_track_alone_is_the_same_mixture_under_every_kind(seed):
    rng = np.random.default_rng(seed)
    scans = [drawn_scores(rng, 1, int(rng.integers(0, 4)), 0.2) for _ in range(3)]
    ends = []
    for associator in (KBest(MANY, 0.0), LabelledMultiBernoulli(MANY, 0.0), NScan(5, MANY, 0.0)):
        hypotheses = associator.initial_hypotheses(1)
        for scores in scans:
            count = len(associator.probability(hypotheses))
            each = LeafScores.of(np.repeat(scores, count, axis=0))
            branching = associator.branch(hypotheses, each, np.zeros(scores.shape[1] - 1, dtype=bool))
            hypotheses, _ = associator.keep(branching.hypotheses, np.ones(len(branching.parent), dtype=bool))
        ends.append(np.sort(associator.probability(hypotheses)))
    np.testing.assert_allclose(ends[1], ends[0], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(ends[2], ends[0], rtol=1e-9, atol=1e-12)


@given(seeds, st.integers(1, 4))
def test_a_labelled_multi_bernoulli_has_the_marginals_of_its_tracks(seed, tracks):
    rng = np.random.default_rng(seed)
    associator, scores = LabelledMultiBernoulli(100, 0.0), drawn_scores(rng, tracks, 3)
    branching = associator.branch(associator.initial_hypotheses(tracks), LeafScores.of(scores), np.ones(3, dtype=bool))
    weights = np.zeros((tracks, 4))
    old = branching.parent >= 0
    probability = associator.probability(branching.hypotheses)
    weights[branching.parent[old], branching.choice[old]] = probability[old]
    expected = associator.associate(scores, None)
    np.testing.assert_allclose(weights, expected, atol=1e-12)
    free = 1.0 - expected[:, 1:].sum(axis=0)
    np.testing.assert_allclose(probability[~old], free[branching.choice[~old] - 1], atol=1e-12)
    judged = associator.existence(branching.hypotheses, np.ones(len(old)), np.full((len(old), 3), -1))
    np.testing.assert_allclose(judged[old], 1.0)
    np.testing.assert_allclose(judged[~old], probability[~old])


def chain(count, rng):
    """Scores of tracks of which each shares a return with the next, so that all are one cluster of many associations."""
    scores = np.full((count, 2 + count), -np.inf)
    scores[:, 0] = rng.standard_normal(count)
    scores[range(count), range(1, 1 + count)] = rng.standard_normal(count)
    scores[range(count), range(2, 2 + count)] = rng.standard_normal(count)
    return scores


def test_a_labelled_multi_bernoulli_counts_all_associations_of_a_long_cluster():
    """The best 200 of some 1e20 would state many a miss as 0 or 1."""
    scores, begins = chain(60, np.random.default_rng(1)), np.zeros(61, dtype=bool)
    exact, wide = LabelledMultiBernoulli(least=0.0), LabelledMultiBernoulli(least=0.0, exact=1)
    branching = exact.branch(exact.initial_hypotheses(60), LeafScores.of(scores), begins)
    misses = exact.probability(branching.hypotheses)[branching.choice == 0]
    np.testing.assert_allclose(misses, Jpda().associate(scores, None)[:, 0], rtol=1e-9)
    assert branching.inexact is None
    told = wide.branch(wide.initial_hypotheses(60), LeafScores.of(scores), begins)
    assert told.inexact.all()
    np.testing.assert_allclose(wide.probability(told.hypotheses), exact.probability(branching.hypotheses), rtol=1e-6)
    assert np.max(np.abs(best_marginals(LeafScores.of(scores), 200)[0] - misses)) > 0.1  # as it was


def test_of_a_track_the_heaviest_leaves_are_kept_with_its_whole_weight():
    associator = LabelledMultiBernoulli(leaves=2)
    scores = np.log(np.array([[0.1, 0.2, 0.3, 0.4]]))
    branching = associator.branch(associator.initial_hypotheses(1), LeafScores.of(scores), np.zeros(3, dtype=bool))
    kept, rows = associator.keep(branching.hypotheses, np.ones(4, dtype=bool))
    assert branching.choice[rows].tolist() == [2, 3]
    np.testing.assert_allclose(kept.weights, [3 / 7, 4 / 7])
    own = branching.hypotheses
    assert branching.choice[associator.reported(own, np.ones(4))].tolist() == [3]
    assert branching.choice[associator.reported(own, np.array([1.0, 1.0, 1.0, 0.1]))].tolist() == [2]


def two_that_swap():
    """Two targets at -5 and 5, and hypotheses that disagree about which of them is which."""
    leaves = Gaussian(np.array([[-5.0], [5.0], [5.2], [-5.2]]), np.ones((4, 1, 1)))
    return one_cluster([0.6, 0.4], [[0, 1], [2, 3]]), leaves


def shares_of(hypotheses, leaves, existence, state=LINE):
    """The shares (t, l) in which targets are made up of leaves."""
    into, leaf, share = recombined(hypotheses, leaves, existence, state)
    table = np.zeros((1 + int(hypotheses.track.max()), len(hypotheses.track)))
    table[into, leaf] = share
    return table


def test_targets_that_swapped_names_stay_two_targets():
    hypotheses, leaves = two_that_swap()
    shares = shares_of(hypotheses, leaves, np.ones(4))
    np.testing.assert_allclose(shares, [[0.6, 0, 0, 0.4], [0, 0.6, 0.4, 0]])
    merging = Variational().merge(hypotheses, leaves, np.ones(4), LINE)
    assert merging.own.tolist() == [0, 1]
    assert clusters(merging.hypotheses) == [[(1.0, (0,))], [(1.0, (1,))]]


def test_leaves_of_a_cluster_too_large_stay_their_tracks(monkeypatch):
    """As `jpda` has them: each target is all of its track's leaves, by the hypotheses' weights."""
    monkeypatch.setattr(recombining, "LARGEST", 15)  # two hypotheses of two tracks are 16
    np.testing.assert_allclose(shares_of(*two_that_swap(), np.ones(4)), [[0.6, 0, 0.4, 0], [0, 0.6, 0, 0.4]])
    monkeypatch.setattr(recombining, "LARGEST", 16)
    np.testing.assert_allclose(shares_of(*two_that_swap(), np.ones(4)), [[0.6, 0, 0, 0.4], [0, 0.6, 0.4, 0]])


def divergence(shares, hypotheses, leaves, existence):
    """The part of the divergence that depends on the targets: minus the mean log density over hypotheses, names free."""
    mass = shares * existence
    r = np.clip(mass.sum(axis=1), 1e-12, 1 - 1e-12)
    mean = (mass @ leaves.mean[:, 0]) / mass.sum(axis=1)
    var = (mass @ (leaves.cov[:, 0, 0] + leaves.mean[:, 0] ** 2)) / mass.sum(axis=1) - mean**2
    total = 0.0
    for weight, own in clusters(hypotheses)[0]:
        cost = np.zeros((len(own), len(own)))
        for i, leaf in enumerate(own):
            spread = leaves.cov[leaf, 0, 0] + (leaves.mean[leaf, 0] - mean) ** 2
            density = np.log(r) - 0.5 * (spread / var + np.log(2 * np.pi * var))
            cost[i] = -existence[leaf] * density - (1 - existence[leaf]) * np.log1p(-r)
        from scipy.optimize import linear_sum_assignment

        total += weight * cost[linear_sum_assignment(cost)].sum()
    return total


@pytest.mark.parametrize(
    "cov", [np.diag([1.0, 0.0]), np.full((2, 2), 4.0), np.zeros((2, 2))], ids=["known", "line", "point"]
)
def test_targets_that_swapped_names_are_found_by_singular_covariances(cov):
    """An axis without variance, or two that are one, once ended in a LinAlgError."""
    hypotheses, leaves = two_that_swap()
    flat = Gaussian(np.concatenate([leaves.mean, leaves.mean], axis=-1), np.broadcast_to(cov, (4, 2, 2)))
    shares = shares_of(hypotheses, flat, np.ones(4), Space.of(x="m", y="m"))
    assert np.isfinite(shares).all()
    if cov[0, 0]:
        np.testing.assert_allclose(shares, [[0.6, 0, 0, 0.4], [0, 0.6, 0.4, 0]])


@given(seeds)
@pytest.mark.costly
def test_the_search_never_ends_worse_than_the_tracks_names_would(seed):
    rng = np.random.default_rng(seed)
    leaves = Gaussian(rng.normal(0, 4, (6, 1)), rng.uniform(0.5, 2, (6, 1, 1)))
    existence = rng.uniform(0.05, 0.95, 6)
    table = 2 * np.arange(3) + rng.integers(0, 2, (4, 3))
    used, table = np.unique(table, return_inverse=True)
    hypotheses = one_cluster(np.sort(rng.dirichlet(np.ones(4)))[::-1], table.reshape(4, 3))
    leaves, existence = Gaussian(leaves.mean[used], leaves.cov[used]), existence[used]
    shares = shares_of(hypotheses, leaves, existence)
    np.testing.assert_allclose(shares.sum(axis=1), 1.0)
    settled = divergence(shares, hypotheses, leaves, existence)
    heaviest = np.zeros((3, len(used)))
    heaviest[range(3), hypotheses.leaves[:3]] = 1.0
    assert settled <= divergence(heaviest, hypotheses, leaves, existence) + 1e-9
