"""Existence after a scan: it follows the weights without a jump, and a hit says no more than it would alone."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vedette import kernels
from vedette.kernels import association
from vedette.tracking import Pairs, by_cluster
from vedette_standard.associators.jpda import Jpda

TWINS = [pytest.param(association.existence, id="numpy"), pytest.param(kernels.existence, id="compiled")]


def drawn(seed, t, k):
    rng = np.random.default_rng(seed)
    loglik = np.full((t, 1 + k), -rng.exponential())
    return rng, rng.normal(0.0, 4.0, (t, 1 + k)), rng.random(t), loglik


@pytest.mark.parametrize("existence", TWINS)
@settings(max_examples=100)
@given(st.integers(0, 2**32 - 1), st.integers(1, 4), st.integers(1, 4), st.booleans())
@pytest.mark.by_turns
def test_a_weight_of_one_is_next_to_one_of_nearly_one(existence, seed, t, k, exclusive):
    rng, scores, prior, loglik = drawn(seed, t, k)
    sure = np.zeros((t, 1 + k))
    sure[range(t), rng.integers(0, 1 + k, t)] = 1.0
    at = existence(scores, sure, prior, loglik, 0.99, exclusive).existence
    nearly = np.where(sure == 1.0, 1.0 - 1e-9, 0.0)
    nearly[:, 0] += 1e-9
    by = existence(scores, nearly / nearly.sum(axis=-1, keepdims=True), prior, loglik, 0.99, exclusive).existence
    np.testing.assert_allclose(by, at, rtol=0, atol=1e-7)
    if (took := int(np.argmax(sure[0]))) > 0:
        odds, missed = np.exp(scores[0, took] - scores[0, 0]), prior[0] * np.exp(loglik[0, 0])
        np.testing.assert_allclose(at[0], (odds + missed / (1.0 - prior[0] + missed)) / (1.0 + odds), rtol=1e-12)


@pytest.mark.parametrize("existence", TWINS)
@settings(max_examples=100)
@given(st.integers(0, 2**32 - 1), st.integers(1, 4), st.integers(1, 4))
@pytest.mark.by_turns
def test_exact_weights_keep_within_the_bound(existence, seed, t, k):
    """Existence is P(hit) + P(miss) P(exists | miss), whatever tracks claim."""
    _, scores, prior, loglik = drawn(seed, t, k)
    weights = Jpda().associate(scores, None)
    hit = weights[:, 1:].sum(axis=-1)
    missed = prior * np.exp(loglik[:, 0])
    expected = hit + (1.0 - hit) * missed / (1.0 - prior + missed)
    np.testing.assert_allclose(existence(scores, weights, prior, loglik, 0.99, True).existence, expected, rtol=1e-12)


@settings(max_examples=50)
@given(st.integers(0, 2**32 - 1), st.integers(1, 4), st.integers(1, 4))
def test_pairs_say_of_existence_what_their_table_says(seed, t, k):
    rng, scores, prior, loglik = drawn(seed, t, k)
    inside = rng.random((t, k)) < 0.7
    scores[:, 1:] = np.where(inside, scores[:, 1:], -np.inf)
    tracks, returns = np.nonzero(inside)
    pairs = Pairs(tracks, returns, scores[tracks, 1 + returns], np.zeros(len(tracks)), scores[:, 0], loglik[:, 0], k)
    table = kernels.existence(scores, Jpda().associate(scores, None), prior, loglik, 0.99, True)
    for found, expected in zip(by_cluster(Jpda(), pairs, prior, None, 0.99, False)[2], table, strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-9)
