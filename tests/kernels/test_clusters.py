"""Hypotheses of clusters: joined where returns are shared, split where independent; both twins, against enumeration."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.hypotheses import clusters, one_cluster, together
from support.joint import drawn_scores, joint_associations
from vedette import kernels
from vedette.hypotheses import JointHypotheses, LeafScores
from vedette.kernels import clusters as reference

GROW = [pytest.param(kernels.grow, id="running"), pytest.param(reference.grow, id="reference")]
SHED = [pytest.param(kernels.shed, id="running"), pytest.param(reference.shed, id="reference")]
seeds = st.integers(0, 2**32 - 1)
MANY = 10**6


def drawn(rng, sizes, most=4):
    """Clusters of so many tracks, of two leaves each, with up to `most` hypotheses."""
    parts = []
    for tracks in sizes:
        leaves = 2 * np.arange(tracks) + rng.integers(0, 2, (int(rng.integers(1, most + 1)), tracks))
        leaves = np.unique(np.where(rng.random(leaves.shape) < 0.2, -1, leaves), axis=0)
        if not (leaves >= 0).any():
            leaves[0, 0] = 0
        _, number = np.unique(leaves[leaves >= 0], return_inverse=True)
        leaves[leaves >= 0] = number
        parts.append(one_cluster(np.sort(rng.dirichlet(np.ones(len(leaves))))[::-1], leaves))
    return joined(parts)


def joined(parts):
    """Clusters side by side."""
    columns = {"cluster": [], "weights": [], "starts": [np.zeros(1, np.int64)], "leaves": [], "track": [], "past": []}
    rows = tracks = held = 0
    for number, part in enumerate(parts):
        columns["cluster"].append(np.full(len(part.weights), number))
        columns["weights"].append(part.weights)
        columns["starts"].append(part.starts[1:] + held)
        columns["leaves"].append(part.leaves + rows)
        columns["track"].append(part.track + tracks)
        columns["past"].append(part.past)
        rows, tracks, held = rows + len(part.track), tracks + int(part.track.max()) + 1, held + len(part.leaves)
    return JointHypotheses(**{name: np.concatenate(column) for name, column in columns.items()})


def flat(hypotheses):
    return hypotheses.cluster, hypotheses.weights, hypotheses.starts, hypotheses.leaves


def grown(grow, hypotheses, scores, begins, most=MANY, least=0.0):
    pairs = LeafScores.of(scores)
    return grow(*flat(hypotheses), pairs.miss, pairs.ends, pairs.returns, pairs.scores, begins, most, least)


def told(cluster, weights, starts, leaves, codes):
    """Each cluster's hypotheses, by codes, with their weights."""
    held = [{} for _ in range(int(cluster.max(initial=-1)) + 1)]
    for i, (number, weight) in enumerate(zip(cluster.tolist(), weights.tolist(), strict=True)):
        held[number][frozenset(codes[leaves[starts[i] : starts[i + 1]]].tolist())] = weight
    return held


@given(seeds, st.lists(st.integers(1, 3), min_size=0, max_size=4), st.integers(0, 4), st.integers(1, 40))
@pytest.mark.costly
def test_the_twins_grow_the_same(seed, sizes, k, most):
    rng = np.random.default_rng(seed)
    hypotheses = drawn(rng, sizes) if sizes else JointHypotheses.of(0)
    scores, begins = drawn_scores(rng, len(hypotheses.track), k), rng.random(k) < 0.6
    one, other = (grown(grow, hypotheses, scores, begins, most, 1e-3) for grow in (kernels.grow, reference.grow))
    assert [sorted(map(sorted, held)) for held in told(*one[:5])] == [sorted(map(sorted, held)) for held in told(*other[:5])]
    for held, others in zip(told(*one[:5]), told(*other[:5]), strict=True):
        assert held == pytest.approx(others, rel=1e-10)
    np.testing.assert_allclose(one[5], other[5], atol=1e-12)


@pytest.mark.parametrize("grow", GROW)
@given(seeds, st.lists(st.integers(1, 2), min_size=1, max_size=3), st.integers(0, 3))
@pytest.mark.by_turns
def test_clusters_grow_into_what_all_of_them_as_one_grow_into(grow, seed, sizes, k):
    rng = np.random.default_rng(seed)
    hypotheses = drawn(rng, sizes, 3)
    scores = drawn_scores(rng, len(hypotheses.track), k)
    expected = {}
    for weight, held in together(hypotheses):
        there = np.array(held, dtype=np.int64)
        for choice, score in zip(*joint_associations(scores[there]), strict=True):
            codes = frozenset((there * (1 + k) + np.array(choice, dtype=np.int64)).tolist())
            expected[codes] = expected.get(codes, 0.0) + weight * np.exp(score)
    total = sum(expected.values())
    parts = told(*grown(grow, hypotheses, scores, np.zeros(k, dtype=bool))[:5])
    product = {frozenset(): 1.0}
    for held in parts:
        product = {own | more: w * v for own, w in product.items() for more, v in held.items()}
    assert product == pytest.approx({own: weight / total for own, weight in expected.items()}, rel=1e-9)


@pytest.mark.parametrize("grow", GROW)
@given(seeds, st.integers(1, 3), st.integers(1, 3), st.integers(1, 5))
@pytest.mark.by_turns
def test_what_is_lost_is_the_share_of_all_associations_that_are_not_kept(grow, seed, tracks, k, most):
    rng = np.random.default_rng(seed)
    hypotheses = drawn(rng, [tracks], 3)
    scores = drawn_scores(rng, len(hypotheses.track), k)
    every, kept = {}, 0.0
    for weight, held in clusters(hypotheses)[0]:
        there = np.array(held, dtype=np.int64)
        for choice, score in zip(*joint_associations(scores[there]), strict=True):
            every[frozenset((there * (1 + k) + np.array(choice, dtype=np.int64)).tolist())] = weight * np.exp(score)
    after = grown(grow, hypotheses, scores, np.zeros(k, dtype=bool), most)
    kept = sum(every[own] for held in told(*after[:5]) for own in held)
    if len(after[5]) == 1:  # else the tracks of the one cluster have none
        np.testing.assert_allclose(after[5], 1.0 - kept / sum(every.values()), atol=1e-9)


@pytest.mark.parametrize("grow", GROW)
def test_clusters_are_joined_by_the_returns_in_any_of_their_leaves_gates(grow):
    """Three tracks; the first two share the second return, which the first takes in its lighter leaf alone."""
    hypotheses = joined([one_cluster([0.7, 0.3], [[0], [1]]), one_cluster([1.0], [[0]]), one_cluster([1.0], [[0]])])
    scores = np.full((4, 4), -np.inf)
    scores[:, 0], scores[0, 1], scores[1, 2], scores[2, 2], scores[3, 3] = 0.0, 1.0, 1.0, 1.0, 1.0
    after = grown(grow, hypotheses, scores, np.zeros(3, dtype=bool))
    held = told(*after[:5])
    assert len(held) == 2
    assert {len(own) for own in held[0]} == {2}
    assert set(held[1]) == {frozenset({12}), frozenset({15})}


@pytest.mark.parametrize("grow", GROW)
def test_a_return_of_nobody_starts_a_cluster_of_its_own(grow):
    after = grown(grow, JointHypotheses.of(1), np.array([[0.0, -np.inf, 2.0]]), np.ones(2, dtype=bool))
    held = told(*after[:5])
    assert held[1] == {frozenset({3 + 1}): 1.0}
    assert held[0] == pytest.approx({frozenset({2}): 1 / (1 + np.exp(-2)), frozenset({0, 3 + 2}): 1 / (1 + np.exp(2))})


@given(seeds, st.lists(st.integers(1, 4), min_size=1, max_size=3), st.sampled_from([1e-12, 1e-3, 0.05, 0.3]))
@pytest.mark.costly
def test_the_twins_shed_the_same(seed, sizes, tolerance):
    rng = np.random.default_rng(seed)
    hypotheses = drawn(rng, sizes, 8)
    alive = rng.random(len(hypotheses.track)) < 0.8
    one, other = (shed(*flat(hypotheses), hypotheses.track, alive, tolerance) for shed in (kernels.shed, reference.shed))
    np.testing.assert_array_equal(one[4], other[4])
    for held, others in zip(told(*one), told(*other), strict=True):
        assert held == pytest.approx(others, rel=1e-10)


@pytest.mark.parametrize("shed", SHED)
@given(seeds, st.lists(st.integers(1, 2), min_size=1, max_size=3))
@pytest.mark.by_turns
def test_a_product_is_split_into_its_factors_and_nothing_else_changes(shed, seed, sizes):
    rng = np.random.default_rng(seed)
    parts = drawn(rng, sizes, 3)
    product = sorted(together(parts), key=lambda one: -one[0])
    table = np.full((len(product), int(parts.track.max()) + 1), -1)
    for row, (_, own) in enumerate(product):
        table[row, parts.track[list(own)]] = own
    whole = one_cluster([weight for weight, _ in product], table)
    after = shed(*flat(whole), whole.track, np.ones(len(whole.track), dtype=bool), 1e-9)
    held = told(*after)
    assert len(held) >= len(sizes)
    again = {frozenset(): 1.0}
    for one in held:
        again = {own | more: w * v for own, w in again.items() for more, v in one.items()}
    assert again == pytest.approx({frozenset(own): weight for weight, own in product}, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("shed", SHED)
def test_tracks_part_only_where_that_changes_little(shed):
    """Two tracks of two leaves: the product of .5 and .5 misses the joint probabilities by .02 of total variation."""
    hypotheses = one_cluster([0.26, 0.26, 0.24, 0.24], [[0, 2], [1, 3], [0, 3], [1, 2]])
    for tolerance, count in ((0.019, 1), (0.021, 2)):
        after = shed(*flat(hypotheses), hypotheses.track, np.ones(4, dtype=bool), tolerance)
        assert len(told(*after)) == count


@pytest.mark.parametrize("shed", SHED)
def test_tracks_that_are_independent_in_pairs_alone_stay_together(shed):
    """The third track's leaf is the parity of the others'."""
    leaves = [[a, 2 + b, 4 + (a ^ b)] for a in (0, 1) for b in (0, 1)]
    hypotheses = one_cluster(np.full(4, 0.25), leaves)
    assert len(told(*shed(*flat(hypotheses), hypotheses.track, np.ones(6, dtype=bool), 1e-3))) == 1
