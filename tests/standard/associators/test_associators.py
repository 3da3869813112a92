"""Associators: enumeration of every joint association as the oracle, and the laws of the role."""

import itertools
import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vedette import kernels
from vedette_standard.associators.global_nearest import GlobalNearest
from vedette_standard.associators.jpda import Jpda
from vedette_standard.associators.nearest import Nearest
from vedette_standard.associators.pda import Pda

PROPAGATED = Jpda(exact=0)
"""Belief propagation however small the cluster."""
ALL = [Nearest(), GlobalNearest(), Pda(), Jpda(), PROPAGATED]
named = pytest.mark.parametrize("associator", ALL, ids=["nearest", "gnn", "pda", "jpda", "jpda propagated"])
exactly = settings(max_examples=80)


def random_scores(rng, *shape, closed=0.3, spread=3.0, sure=0.0):
    """Log scores with returns outside the gate, and with misses that cannot be; the rest have no ties."""
    scores = rng.normal(0, spread, shape)
    scores[..., 1:][rng.random((*shape[:-1], shape[-1] - 1)) < closed] = -np.inf
    impossible = (rng.random(shape[:-1]) < sure) & np.isfinite(scores[..., 1:]).any(axis=-1)
    scores[..., 0][impossible] = -np.inf
    return scores


@st.composite
def problems(draw, most=4):
    t, k = draw(st.integers(0, most)), draw(st.integers(0, most))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    return random_scores(rng, t, 1 + k, closed=draw(st.sampled_from([0.0, 0.3, 0.7])), spread=draw(st.sampled_from([1, 5])))


@pytest.mark.parametrize("shape", [(4000, 2), (2, 4000)])
def test_many_tracks_of_few_returns_take_the_memory_of_their_pairs(shape):
    scores = random_scores(np.random.default_rng(1), shape[0], 1 + shape[1])
    scores[:2, 1:] = 50.0 + np.arange(shape[1])  # two want the last return
    tracemalloc.start()
    weights = GlobalNearest().associate(scores, None)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert weights[:2, 1:].sum() == 2.0
    assert peak < 30 * scores.nbytes


def joint_associations(t, k):
    """Every choice of one column a track in which no return is shared."""
    for choice in itertools.product(range(k + 1), repeat=t):
        taken = [column for column in choice if column]
        if len(taken) == len(set(taken)):
            yield choice


def enumerated(scores):
    """Marginals of all joint associations."""
    t, k = scores.shape[0], scores.shape[1] - 1
    top = np.where(np.isfinite(scores), scores, -np.inf).max(axis=1).sum() if t else 0.0
    weights = np.zeros_like(scores)
    for choice in joint_associations(t, k):
        weights[range(t), choice] += np.exp(scores[range(t), choice].sum() - top)
    return weights / weights.sum(axis=1, keepdims=True)


def check_exact(scores, associator):
    np.testing.assert_allclose(associator.associate(scores, None), enumerated(scores), rtol=1e-9, atol=1e-12)


@exactly
@given(problems())
def test_jpda_is_the_sum_over_all_joint_associations(scores):
    check_exact(scores, Jpda())


@exactly
@given(problems())
def test_pda_is_the_sum_over_each_tracks_own(scores):
    for row, weights in zip(scores, Pda().associate(scores, None), strict=True):
        np.testing.assert_allclose(weights, np.exp(row) / np.exp(row).sum(), rtol=1e-12)


@exactly
@given(problems())
def test_global_nearest_is_the_best_of_all_joint_associations(scores):
    t, k = scores.shape[0], scores.shape[1] - 1
    best = max(joint_associations(t, k), key=lambda choice: scores[range(t), choice].sum())
    expected = np.zeros_like(scores)
    expected[range(t), best] = 1.0
    np.testing.assert_array_equal(GlobalNearest().associate(scores, None), expected)


@exactly
@given(problems())
def test_nearest_is_each_tracks_best(scores):
    weights = Nearest().associate(scores, None)
    for row, found in zip(scores, weights, strict=True):
        assert row[found == 1.0].item() == row.max()
        assert found.sum() == 1.0


@pytest.mark.parametrize("shape", [(9, 4), (3, 12), (8, 9), (9, 8)])
def test_jpda_takes_the_smaller_side_of_a_cluster(shape):
    """More tracks than returns, and the other way round, beyond `exact` on one side: still the same sums."""
    rng = np.random.default_rng(3)
    scores = random_scores(rng, shape[0], 1 + shape[1], closed=0.5)
    longer = Jpda(exact=12)
    np.testing.assert_allclose(Jpda().associate(scores, None), longer.associate(scores, None), rtol=1e-9)
    if shape[0] < 8:
        check_exact(scores[:2, :5], Jpda())


def random_tree(rng, t, k):
    """Scores whose gates make a tree of tracks and returns: each return after the first joins two that were apart."""
    scores = np.full((t, 1 + k), -np.inf)
    scores[:, 0] = rng.normal(size=t)
    group = np.arange(t + k)
    for edge in rng.permutation(t * k):
        track, column = divmod(int(edge), k)
        if group[track] != group[t + column]:
            group[group == group[track]] = group[t + column]
            scores[track, 1 + column] = rng.normal(0, 3)
    return scores


@pytest.mark.parametrize("seed", range(20))
def test_belief_propagation_is_exact_on_trees(seed):
    rng = np.random.default_rng(seed)
    scores = random_tree(rng, int(rng.integers(2, 5)), int(rng.integers(1, 5)))
    np.testing.assert_allclose(PROPAGATED.associate(scores, None), enumerated(scores), atol=1e-8)


def two_targets(rng, apart, p_detect, density, gate=9.21):
    """Scores of two targets `apart` deviations from each other, seen in the plane among clutter."""
    x = np.array([[0.0, 0.0], [apart, 0.0]])
    seen = x[rng.random(2) < p_detect]
    low, high = np.array([-4.0, -4.0]), np.array([apart + 4.0, 4.0])
    clutter = rng.uniform(low, high, (min(rng.poisson(density * np.prod(high - low)), 5), 2))
    z = np.concatenate([seen + rng.normal(size=seen.shape), clutter])
    distance = ((z - x[:, None]) ** 2).sum(axis=-1)
    scores = np.full((2, 1 + len(z)), np.log(1 - p_detect * 0.99))
    scores[:, 1:] = np.where(distance < gate, np.log(p_detect / (2 * np.pi * density)) - distance / 2, -np.inf)
    return scores


@pytest.mark.costly
def test_how_far_belief_propagation_is_off_where_two_targets_stand_close():
    """The figures that the documentation states, over 800 drawn scenes. The exact sum is there as they are not small."""
    rng = np.random.default_rng(1)
    errors = []
    for _ in range(200):
        for apart, p_detect, density in ((0.5, 0.9, 0.02), (1.0, 0.9, 0.02), (1.0, 0.9, 0.1), (1.0, 0.98, 0.01)):
            scores = two_targets(rng, apart, p_detect, density)
            exact = enumerated(scores)
            np.testing.assert_allclose(Jpda().associate(scores, None), exact, atol=1e-9)
            errors.append(np.abs(PROPAGATED.associate(scores, None) - exact).max())
    assert 0.05 < np.mean(errors) < 0.11
    assert 0.2 < np.max(errors) < 0.4


@named
@exactly
@given(scores=problems())
@pytest.mark.by_turns
def test_rows_sum_to_one_and_nothing_goes_where_the_score_is_minus_infinity(associator, scores):
    weights = associator.associate(scores, None)
    assert weights.shape == scores.shape
    assert np.all(weights >= 0)
    np.testing.assert_allclose(weights.sum(axis=-1), 1, rtol=1e-9)
    assert np.all(weights[np.isneginf(scores)] == 0)
    if associator.exclusive:
        assert weights[:, 1:].sum(axis=0).max(initial=0) <= 1 + 1e-6


@named
@exactly
@given(scores=problems(), seed=st.integers(0, 2**32 - 1))
@pytest.mark.by_turns
def test_a_rows_constant_and_an_order_change_nothing(associator, scores, seed):
    """Of scores without ties: a hard choice between two that are equal takes the first."""
    rng = np.random.default_rng(seed)
    weights = associator.associate(scores, None)
    shifted = associator.associate(scores + rng.uniform(-300, 300, (len(scores), 1)), None)
    np.testing.assert_allclose(shifted, weights, atol=1e-8)
    tracks = rng.permutation(len(scores))
    columns = np.concatenate([[0], 1 + rng.permutation(scores.shape[1] - 1)])
    permuted = associator.associate(scores[tracks][:, columns], None)
    np.testing.assert_allclose(permuted, weights[tracks][:, columns], atol=1e-8)


@named
@pytest.mark.parametrize("shape", [(3, 2, 4), (2, 3, 0, 3), (2, 3, 1), (0, 2, 3), (2, 2, 3, 5)])
def test_a_batch_is_the_loop_over_its_runs(associator, shape):
    scores = random_scores(np.random.default_rng(2), *shape)
    given = scores.copy()
    weights = associator.associate(scores, None)
    np.testing.assert_array_equal(scores, given)
    for i in np.ndindex(shape[:-2]):
        np.testing.assert_allclose(weights[i], associator.associate(scores[i], None), rtol=1e-12, atol=1e-12)


@named
@pytest.mark.parametrize("scores", [np.zeros((0, 1)), np.zeros((0, 4)), np.array([[-3.0], [0.0]])])
def test_no_tracks_or_no_returns_are_no_special_case(associator, scores):
    expected = np.zeros_like(scores)
    expected[:, 0] = 1.0
    np.testing.assert_array_equal(associator.associate(scores, None), expected)


@named
@exactly
@given(seed=st.integers(0, 2**32 - 1))
@pytest.mark.by_turns
def test_a_target_that_is_surely_seen_takes_a_return(associator, seed):
    """A miss of -inf, where returns enough are in the gate to go round."""
    rng = np.random.default_rng(seed)
    scores = random_scores(rng, 3, 5, closed=0.0, sure=0.7)
    weights = associator.associate(scores, None)
    np.testing.assert_allclose(weights.sum(axis=-1), 1, rtol=1e-9)
    assert np.all(weights[:, 0][np.isneginf(scores[:, 0])] < 1e-12)
    if associator.kind == "jpda" and associator.exact:
        check_exact(scores, associator)
    if associator.kind == "gnn":
        best = max(joint_associations(3, 4), key=lambda choice: scores[range(3), choice].sum())
        assert np.argmax(weights, axis=1).tolist() == list(best)


@named
def test_two_targets_that_are_surely_seen_may_have_one_return_between_them(associator):
    scores = np.array([[-np.inf, 2.0], [-np.inf, 1.0], [0.5, 1.0]])
    weights = associator.associate(scores, None)
    np.testing.assert_allclose(weights.sum(axis=-1), 1, rtol=1e-9)
    if associator.exclusive:
        assert weights[:, 1].sum() <= 1 + 1e-6
        assert weights[2, 0] > 0.99


@pytest.mark.parametrize("gap", [0.0, 3.0, 10.0, 100.0, 700.0])
@pytest.mark.parametrize("shape", [(20, 20), (20, 12), (12, 20)])
def test_many_targets_all_in_each_others_gates(gap, shape):
    """A miss `gap` below the best return: at 700 there is no clutter at all and every return has to be somebody's."""
    rng = np.random.default_rng(4)
    scores = np.concatenate([np.full((shape[0], 1), -gap), -rng.uniform(0, 4.6, shape)], axis=1)
    weights = Jpda().associate(scores, None)
    longer = Jpda(sweeps=5000).associate(scores, None)
    np.testing.assert_allclose(weights.sum(axis=1), 1, rtol=1e-9)
    assert weights[:, 1:].sum(axis=0).max() <= 1 + 1e-12
    np.testing.assert_allclose(weights, longer, atol=1e-3)
    if gap == 700.0 and shape[0] <= shape[1]:
        assert weights[:, 0].max() < 1e-3
    chosen = GlobalNearest().associate(scores, None)
    assert chosen[:, 1:].sum(axis=0).max() <= 1.0


def summed_without_exclusion(scores, most):
    """PDA: every track on its own."""
    return kernels.softmax(scores), np.zeros(scores.shape[:-1], bool)


def summed_but_propagated(scores, most):
    weights, wide = SUMMED(scores, most)
    return weights, ~wide


SUMMED = kernels.joint_weights


@pytest.mark.parametrize("mutant", [summed_without_exclusion, summed_but_propagated])
def test_the_enumeration_bites(monkeypatch, mutant):
    scores = two_targets(np.random.default_rng(0), 1.0, 0.98, 0.02)
    check_exact(scores, Jpda())
    monkeypatch.setattr(kernels, "joint_weights", mutant)
    with pytest.raises(AssertionError):
        check_exact(scores, Jpda())


@pytest.mark.parametrize("shape", [(15, 15), (2, 15, 16)])
def test_what_is_propagated_is_told(shape):
    """Beside a cluster that all tracks are in, one of two tracks that is still summed exactly."""
    scores = random_scores(np.random.default_rng(5), *shape[:-2], shape[-2] + 2, shape[-1] + 3, closed=0.0)
    scores[..., -2:, 1:-2] = scores[..., :-2, -2:] = -np.inf
    told = Jpda().approximated(scores)
    assert told[..., :-2].all()
    assert not told[..., -2:].any()
    weights = Jpda().associate(scores, None)
    together = Jpda(exact=0).associate(scores, None)
    np.testing.assert_array_equal(weights[..., :-2, :], together[..., :-2, :])
    exactly = np.concatenate([scores[..., -2:, :1], scores[..., -2:, -2:]], axis=-1)
    for run in np.ndindex(shape[:-2]):
        np.testing.assert_allclose(weights[run][-2:][:, [0, -2, -1]], enumerated(exactly[run]), atol=1e-12)


def test_greedy_choice_is_not_the_global_one():
    """Two tracks like the same return best, and together do better otherwise."""
    scores = np.array([[-5.0, 3.0, 2.9], [-5.0, 2.0, -1.0]])
    np.testing.assert_array_equal(Nearest().associate(scores, None), [[0, 1, 0], [0, 1, 0]])
    np.testing.assert_array_equal(GlobalNearest().associate(scores, None), [[0, 0, 1], [0, 1, 0]])
