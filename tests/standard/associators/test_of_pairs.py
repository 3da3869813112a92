"""Joint association of pairs within gates: what a table of all pairs gives, in both twins, and messages as published."""

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vedette import Associator, kernels
from vedette.config import Registry
from vedette.tracking import Pairs
from vedette_standard.associators import of_pairs
from vedette_standard.associators.jpda import Jpda

SUMMED = [pytest.param(of_pairs.summed, id="running"), pytest.param(of_pairs.summed.__wrapped__, id="reference")]
PROPAGATED = [pytest.param(of_pairs.propagated, id="running"), pytest.param(of_pairs.propagated.__wrapped__, id="reference")]
seeds = st.integers(0, 2**32 - 1)


def drawn(seed, t, k, closed, spread=3.0, sure=0.2):
    """Scores (t, 1+k), most of -inf; some misses cannot be, where there is a return."""
    rng = np.random.default_rng(seed)
    scores = spread * rng.standard_normal((t, 1 + k))
    scores[:, 1:][rng.random((t, k)) < closed] = -np.inf
    scores[(rng.random(t) < sure) & np.isfinite(scores[:, 1:]).any(axis=1), 0] = -np.inf
    return scores


def pairs_of(scores):
    tracks, returns = np.nonzero(np.isfinite(scores[:, 1:]))
    return tracks, returns, scores[tracks, 1 + returns], scores[:, 0].copy(), scores.shape[1] - 1


def table(scores, weights, misses):
    tracks, returns, *_ = pairs_of(scores)
    whole = np.zeros(scores.shape)
    whole[:, 0], whole[tracks, 1 + returns] = misses, weights
    return whole


def messages(scores, sweeps):
    """The weights by Williams and Lau's messages, one after the other; a return claimed too often is shared out."""
    t, k = scores.shape[0], scores.shape[1] - 1
    miss = np.maximum(scores[:, 0], scores.max(axis=1) - 3000.0)
    ratio, to_track = np.exp(np.minimum(scores[:, 1:] - miss[:, None], 700.0)), np.ones((k, t))
    for _ in range(sweeps):
        to_return = np.array(
            [
                [ratio[i, j] / (1 + sum(ratio[i, n] * to_track[n, i] for n in range(k) if n != j)) for j in range(k)]
                for i in range(t)
            ]
        )
        to_track = np.array(
            [[1 / (1 + sum(to_return[s, j] for s in range(t) if s != i)) for i in range(t)] for j in range(k)]
        )
    likely = ratio * to_track.T
    weights = np.column_stack([np.ones(t), likely]) / (1 + likely.sum(axis=1, keepdims=True))
    claims = weights[:, 1:] / np.maximum(1.0, weights[:, 1:].sum(axis=0))
    return np.column_stack([weights[:, 0] + (weights[:, 1:] - claims).sum(axis=1), claims])


@pytest.mark.parametrize("summed", SUMMED)
@settings(max_examples=60)
@given(seeds, st.integers(0, 12), st.integers(0, 12), st.sampled_from([0.4, 0.7, 0.9]), st.sampled_from([2, 6, 16]))
def test_sums_of_pairs_are_those_of_the_table(summed, seed, t, k, closed, most):
    scores = drawn(seed, t, k, closed)
    weights, misses, wide = summed(*pairs_of(scores), most)
    expected, as_wide = kernels.joint_weights(scores, most)
    np.testing.assert_array_equal(wide, as_wide)
    np.testing.assert_allclose(table(scores, weights, misses), expected, atol=1e-11)


@pytest.mark.parametrize("propagated", PROPAGATED)
@pytest.mark.parametrize("shape", [(4, 4), (3, 6), (6, 6), (1, 3), (2, 1), (5, 0)])
@pytest.mark.parametrize("closed", [0.0, 0.5])
def test_messages_are_as_published(propagated, shape, closed):
    scores = drawn(sum(shape), *shape, closed, spread=2.0)
    found = table(scores, *propagated(*pairs_of(scores), 1e-13, 3000.0, 1e9))
    np.testing.assert_allclose(found, messages(scores, 400), atol=1e-7)


@settings(max_examples=60)
@given(seeds, st.integers(0, 30), st.integers(0, 30), st.sampled_from([0.0, 0.6, 0.95]), st.sampled_from([1.0, 7.0, 400.0]))
def test_the_twins_end_at_the_same_message(seed, t, k, closed, spread):
    """Clusters of their own, each with as many messages as it may have; from the scarcer side."""
    scores = drawn(seed, t, k, closed, spread)
    for budget in (1.0, 500.0):
        given = (*pairs_of(scores), 1e-9, 50.0, budget)
        for found, expected in zip(of_pairs.propagated(*given), of_pairs.propagated.__wrapped__(*given), strict=True):
            np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("exact", [0, 3, 14])
def test_jpda_takes_pairs_as_it_takes_a_table(exact):
    """Beside clusters that are too wide for exact sums, others that are not."""
    for seed in range(10):
        scores = drawn(seed, 40, 40, 0.93 if exact else 0.8)
        tracks, returns, given, miss, k = pairs_of(scores)
        associator = Jpda(exact=exact)
        pairs = Pairs(tracks, returns, given, np.zeros(len(tracks)), miss, miss, k)
        weights, misses, wide = associator.associate_pairs(pairs)
        np.testing.assert_array_equal(wide, associator.approximated(scores))
        np.testing.assert_allclose(table(scores, weights, misses), associator.associate(scores, None), rtol=1e-9, atol=1e-12)


def same_by_pairs(associator):
    """Whether it takes pairs; AssertionError unless their weights are those of a table, in many scenes."""
    for seed in range(20):
        scores = drawn(seed, 7, 9, 0.6)
        tracks, returns, given, miss, k = pairs_of(scores)
        nothing = np.zeros(len(tracks))
        found = associator.associate_pairs(Pairs(tracks, returns, given, nothing, miss, np.zeros(len(miss)), k))
        if found is None:
            return False
        weights, misses, inexact = found
        np.testing.assert_allclose(table(scores, weights, misses), associator.associate(scores, None), rtol=1e-9, atol=1e-12)
        np.testing.assert_array_equal(inexact, associator.approximated(scores))
    return True


def test_every_kind_that_takes_pairs_takes_them_as_a_table():
    """A kind of any plugin; with its parameters as they are by default."""
    kinds = [entry.cls for entry in Registry.installed().of_role("associator")]
    taking = {kind.kind for kind in kinds if all(part.default is not attrs.NOTHING for part in attrs.fields(kind))
              and same_by_pairs(kind())}  # fmt: skip
    assert len(kinds) >= 10
    assert {"jpda", "jpda_star", "m_best_jpda"} <= taking


@attrs.frozen
class Halved(Associator):
    """One whose weights by pairs are those of a table, and a half."""

    def associate(self, scores, evidence):
        return Jpda().associate(scores, evidence)

    def associate_pairs(self, pairs):
        weights, misses, inexact = Jpda().associate_pairs(pairs)
        return 0.5 * weights, misses, inexact


def test_the_comparison_of_every_kind_bites():
    with pytest.raises(AssertionError):
        same_by_pairs(Halved())


def test_what_is_not_as_it_should_be_is_left_to_numpy():
    scores = drawn(1, 6, 6, 0.5)
    tracks, returns, given, miss, k = pairs_of(scores)
    expected = of_pairs.summed(tracks, returns, given, miss, k, 16)[0]
    for other in (tracks.astype(np.int32), np.repeat(tracks, 2)[::2]):
        np.testing.assert_allclose(of_pairs.summed(other, returns, given, miss, k, 16)[0], expected, atol=1e-12)
    order = np.argsort(returns, kind="stable")  # not by tracks
    found = of_pairs.summed(tracks[order], returns[order], given[order], miss, k, 16)[0]
    np.testing.assert_allclose(found, expected[order], atol=1e-12)


def without_the_others(values, at):
    return np.zeros_like(values)


def with_the_own(values, at):
    return np.bincount(at[0], values)[at[0]]


@pytest.mark.parametrize("mutant", [without_the_others, with_the_own])
def test_the_comparison_with_messages_bites(monkeypatch, mutant):
    monkeypatch.setattr(of_pairs, "_others", mutant)
    with pytest.raises(AssertionError):
        test_messages_are_as_published(of_pairs.propagated.__wrapped__, (6, 6), 0.0)


def test_the_comparison_with_the_table_bites(monkeypatch):
    def each_alone(tracks, returns, scores, miss, k, most):
        weights, misses = of_pairs.propagated(tracks, np.arange(len(tracks)), scores, miss, len(tracks), 1e-9, 10.0, 1e6)
        return weights, misses, np.zeros(len(miss), dtype=bool)

    monkeypatch.setattr(of_pairs, "summed", each_alone)
    with pytest.raises(AssertionError):
        test_jpda_takes_pairs_as_it_takes_a_table(14)
