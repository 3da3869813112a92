"""Associators that keep hypotheses, a scan at a time: held against enumeration and against each other."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.joint import drawn_scores, joint_associations
from vedette import Gaussian, Space
from vedette_standard.associators.hypotheses import GlobalHypotheses
from vedette_standard.associators.k_best import KBest
from vedette_standard.associators.lmb import LabelledMultiBernoulli
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
    return GlobalHypotheses(weights, leaves), drawn_scores(rng, len(used), int(rng.integers(0, 5)))


def in_words(branching, hypotheses):
    """Each hypothesis as a set of (leaf before, return) and (-1, return) for tracks that begin, with its weight."""
    found = {}
    for weight, leaves in zip(hypotheses.weights, hypotheses.leaves, strict=True):
        parts = frozenset((int(branching.parent[i]), int(branching.choice[i])) for i in leaves[leaves >= 0])
        found[parts] = found.get(parts, 0.0) + float(weight)
    return found


@given(seeds, st.integers(0, 3), st.integers(1, 4))
def test_many_hypotheses_grow_into_all_joint_associations(seed, tracks, count):
    rng = np.random.default_rng(seed)
    hypotheses, scores = drawn_hypotheses(rng, tracks, count)
    begins = rng.random(scores.shape[1] - 1) < 0.7
    expected = {}
    for weight, leaves in zip(hypotheses.weights, hypotheses.leaves, strict=True):
        there = leaves[leaves >= 0]
        for choice, score in zip(*joint_associations(scores[there]), strict=True):
            new = {(-1, 1 + j) for j in np.flatnonzero(begins) if 1 + j not in choice}
            parts = frozenset(new | set(zip(there.tolist(), choice.tolist(), strict=True)))
            expected[parts] = expected.get(parts, 0.0) + weight * np.exp(score)
    total = sum(expected.values())
    branching = KBest(MANY, 0.0).branch(hypotheses, scores, begins)
    found = in_words(branching, branching.hypotheses)
    assert found.keys() == expected.keys()
    for parts, weight in found.items():
        assert weight == pytest.approx(expected[parts] / total, rel=1e-11, abs=1e-14)
    old = branching.parent >= 0
    assert np.all(np.diff(old.astype(int)) <= 0)
    probability = KBest().probability(branching.hypotheses)
    for leaf, (parent, choice) in enumerate(zip(branching.parent.tolist(), branching.choice.tolist(), strict=True)):
        assert probability[leaf] == pytest.approx(
            sum(w for parts, w in found.items() if (parent, choice) in parts), abs=1e-12
        )


@given(seeds, st.integers(1, 4), st.integers(1, 6))
def test_few_are_the_heaviest_and_light_ones_go(seed, most, count):
    hypotheses, scores = drawn_hypotheses(np.random.default_rng(seed), 3, count)
    begins = np.ones(scores.shape[1] - 1, dtype=bool)
    every = KBest(MANY, 0.0).branch(hypotheses, scores, begins).hypotheses.weights
    few = KBest(most, 0.05).branch(hypotheses, scores, begins).hypotheses.weights
    assert len(few) <= most
    assert few[0] >= every[0] * (1 - 1e-9)
    assert np.all(np.diff(few) <= 0)
    assert few.sum() == pytest.approx(1.0)


def test_leaves_that_end_leave_equal_hypotheses_which_are_merged():
    hypotheses = GlobalHypotheses(np.array([0.4, 0.35, 0.25]), np.array([[0, 2], [1, 2], [0, 3]]))
    kept, rows = KBest().keep(hypotheses, np.array([True, True, False, False]))
    assert rows.tolist() == [0, 1]
    np.testing.assert_allclose(kept.weights, [0.65, 0.35])
    assert kept.leaves.tolist() == [[0], [1]]
    nothing, rows = KBest().keep(hypotheses, np.zeros(4, dtype=bool))
    assert rows.tolist() == []
    assert (nothing.weights.tolist(), nothing.leaves.shape) == ([1.0], (1, 0))


def scan_by_scan(associator, scans):
    """Feed scores scan by scan to two given tracks, whose leaves all score alike, and return what is left at the end."""
    hypotheses = associator.initial_hypotheses(2)
    track = np.arange(2)
    for scores in scans:
        branching = associator.branch(hypotheses, scores[track], np.zeros(scores.shape[1] - 1, dtype=bool))
        track = track[branching.parent]
        hypotheses, rows = associator.keep(branching.hypotheses, np.ones(len(track), dtype=bool))
        track = track[rows]
    return hypotheses, track


CROSSED = [np.log(np.array([[0.1, 0.5, 0.4], [0.1, 0.45, 0.45]]))] * 4


def test_associations_of_n_scans_ago_are_those_of_the_best_hypothesis():
    free, _ = scan_by_scan(KBest(MANY, 0.0), CROSSED)
    wide, _ = scan_by_scan(NScan(9, MANY, 0.0), CROSSED)
    np.testing.assert_allclose(wide.hypotheses.weights, free.weights, rtol=1e-12)
    # 7 ways a scan to share out two returns: those of the first three scans are decided, those of the last one are open.
    narrow, _ = scan_by_scan(NScan(1, MANY, 0.0), CROSSED)
    assert (len(free.weights), len(narrow.hypotheses.weights)) == (7**4, 7)
    assert len({tuple(row) for row in narrow.past[:, 0][narrow.hypotheses.leaves].tolist()}) == 1


def test_a_track_that_began_within_the_window_is_not_decided_yet():
    associator, scans_open = NScan(2, 100, 0.0), []
    first = associator.branch(associator.initial_hypotheses(1), np.log(np.array([[0.4, 0.6]])), np.ones(1, dtype=bool))
    hypotheses, rows = associator.keep(first.hypotheses, np.ones(len(first.parent), dtype=bool))
    for _ in range(3):
        count = len(rows)
        missed = associator.branch(hypotheses, np.log(np.full((count, 1), 0.5)), np.zeros(0, dtype=bool))
        hypotheses, rows = associator.keep(missed.hypotheses, np.ones(count, dtype=bool))
        scans_open.append(len(hypotheses.hypotheses.weights))
    assert scans_open == [2, 1, 1]


@given(seeds)
def test_one_track_alone_is_the_same_mixture_under_every_kind(seed):
    rng = np.random.default_rng(seed)
    scans = [drawn_scores(rng, 1, int(rng.integers(0, 4)), 0.2) for _ in range(3)]
    ends = []
    for associator in (KBest(MANY, 0.0), LabelledMultiBernoulli(MANY, 0.0, MANY), NScan(5, MANY, 0.0)):
        hypotheses = associator.initial_hypotheses(1)
        for scores in scans:
            count = len(associator.probability(hypotheses))
            branching = associator.branch(
                hypotheses, np.repeat(scores, count, axis=0), np.zeros(scores.shape[1] - 1, dtype=bool)
            )
            hypotheses, _ = associator.keep(branching.hypotheses, np.ones(len(branching.parent), dtype=bool))
        ends.append(np.sort(associator.probability(hypotheses)))
    np.testing.assert_allclose(ends[1], ends[0], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(ends[2], ends[0], rtol=1e-9, atol=1e-12)


@given(seeds, st.integers(1, 4))
def test_a_labelled_multi_bernoulli_has_the_marginals_of_its_tracks(seed, tracks):
    rng = np.random.default_rng(seed)
    associator, scores = LabelledMultiBernoulli(100, 0.0, 10000), drawn_scores(rng, tracks, 3)
    branching = associator.branch(associator.initial_hypotheses(tracks), scores, np.ones(3, dtype=bool))
    weights = np.zeros((tracks, 4))
    old = branching.parent >= 0
    probability = associator.probability(branching.hypotheses)
    weights[branching.parent[old], branching.choice[old]] = probability[old]
    expected = associator.associate(scores, None)
    np.testing.assert_allclose(weights, expected, atol=1e-12)
    free = 1.0 - expected[:, 1:].sum(axis=0)
    np.testing.assert_allclose(probability[~old], free[branching.choice[~old] - 1], atol=1e-12)
    judged = associator.judged(branching.hypotheses, np.ones(len(old)))
    np.testing.assert_allclose(judged[old], 1.0)
    np.testing.assert_allclose(judged[~old], probability[~old])


def test_of_a_track_the_heaviest_leaves_are_kept_with_its_whole_weight():
    associator = LabelledMultiBernoulli(leaves=2)
    scores = np.log(np.array([[0.1, 0.2, 0.3, 0.4]]))
    branching = associator.branch(associator.initial_hypotheses(1), scores, np.zeros(3, dtype=bool))
    kept, rows = associator.keep(branching.hypotheses, np.ones(4, dtype=bool))
    assert branching.choice[rows].tolist() == [2, 3]
    np.testing.assert_allclose(kept.weights, [3 / 7, 4 / 7])
    own = branching.hypotheses
    assert branching.choice[associator.reported(own, np.ones(4))].tolist() == [3]
    assert branching.choice[associator.reported(own, np.array([1.0, 1.0, 1.0, 0.1]))].tolist() == [2]


def two_that_swap():
    """Two targets at -5 and 5, and hypotheses that disagree about which of them is which."""
    leaves = Gaussian(np.array([[-5.0], [5.0], [5.2], [-5.2]]), np.ones((4, 1, 1)))
    return GlobalHypotheses(np.array([0.6, 0.4]), np.array([[0, 1], [2, 3]])), leaves


def test_targets_that_swapped_names_stay_two_targets():
    hypotheses, leaves = two_that_swap()
    shares = recombined(hypotheses, leaves, np.ones(4), LINE)
    np.testing.assert_allclose(shares, [[0.6, 0, 0, 0.4], [0, 0.6, 0.4, 0]])
    merging = Variational().merge(hypotheses, leaves, np.ones(4), LINE)
    assert merging.own.tolist() == [0, 1]
    assert merging.hypotheses.leaves.tolist() == [[0, 1]]


def divergence(shares, hypotheses, leaves, existence):
    """The part of the divergence that depends on the targets: minus the mean log density over hypotheses, names free."""
    mass = shares * existence
    r = np.clip(mass.sum(axis=1), 1e-12, 1 - 1e-12)
    mean = (mass @ leaves.mean[:, 0]) / mass.sum(axis=1)
    var = (mass @ (leaves.cov[:, 0, 0] + leaves.mean[:, 0] ** 2)) / mass.sum(axis=1) - mean**2
    total = 0.0
    for weight, own in zip(hypotheses.weights, hypotheses.leaves, strict=True):
        cost = np.zeros((len(own), len(own)))
        for i, leaf in enumerate(own):
            spread = leaves.cov[leaf, 0, 0] + (leaves.mean[leaf, 0] - mean) ** 2
            density = np.log(r) - 0.5 * (spread / var + np.log(2 * np.pi * var))
            cost[i] = -existence[leaf] * density - (1 - existence[leaf]) * np.log1p(-r)
        from scipy.optimize import linear_sum_assignment

        total += weight * cost[linear_sum_assignment(cost)].sum()
    return total


@given(seeds)
def test_the_search_never_ends_worse_than_the_tracks_names_would(seed):
    rng = np.random.default_rng(seed)
    leaves = Gaussian(rng.normal(0, 4, (6, 1)), rng.uniform(0.5, 2, (6, 1, 1)))
    existence = rng.uniform(0.05, 0.95, 6)
    hypotheses = GlobalHypotheses(np.sort(rng.dirichlet(np.ones(4)))[::-1], 2 * np.arange(3) + rng.integers(0, 2, (4, 3)))
    shares = recombined(hypotheses, leaves, existence, LINE)
    np.testing.assert_allclose(shares.sum(axis=1), 1.0)
    settled = divergence(shares, hypotheses, leaves, existence)
    heaviest = np.zeros((3, 6))
    heaviest[range(3), hypotheses.leaves[0]] = 1.0
    assert settled <= divergence(heaviest, hypotheses, leaves, existence) + 1e-9
