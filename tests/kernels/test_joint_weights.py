"""Marginals of joint associations: equal to all of them enumerated, in both twins, whatever the scale of the scores."""

from itertools import product

import numpy as np
import pytest
import scipy.optimize  # noqa: F401  the reference imports it when first called, which must not count as a test's time
from hypothesis import given
from hypothesis import strategies as st

from vedette import kernels
from vedette.kernels import joint

TWINS = [pytest.param(kernels.joint_weights, id="running"), pytest.param(joint.joint_weights, id="reference")]
seeds = st.integers(0, 2**32 - 1)
shapes = st.tuples(st.integers(0, 5), st.integers(0, 5))


def enumerated(scores):
    """The marginals of every choice of one column a track in which no return is shared."""
    t, columns = scores.shape
    choices = [one for one in product(range(columns), repeat=t) if len(set(one) - {0}) == t - one.count(0)]
    total = np.array([sum(scores[row, i] for row, i in enumerate(choice)) for choice in choices], dtype=float)
    share, weights = np.exp(total - total.max(initial=-np.inf)), np.zeros(scores.shape)
    for choice, part in zip(choices, share / share.sum(), strict=True):
        weights[range(t), choice] += part
    return weights


def drawn(seed, shape, spread, closed, sure=0.0):
    """Scores (t, 1+k), some of -inf; of the misses only where enough returns are left to go round."""
    rng = np.random.default_rng(seed)
    scores = spread * rng.standard_normal((*shape[:-1], 1 + shape[-1]))
    scores[..., 1:][rng.random(shape) < closed] = -np.inf
    if sure and shape[-1] >= shape[-2]:
        scores[..., 0][rng.random(shape[:-1]) < sure] = -np.inf
    return scores


@pytest.mark.parametrize("weigh", TWINS)
@given(seeds, shapes, st.sampled_from([1.0, 10.0, 300.0]), st.sampled_from([0.0, 0.3, 0.6]))
@pytest.mark.by_turns
def test_they_are_sums_over_all_associations(weigh, seed, shape, spread, closed):
    scores = drawn(seed, shape, spread, closed)
    weights, wide = weigh(scores, 16)
    assert not wide.any()
    np.testing.assert_allclose(weights, enumerated(scores), rtol=1e-10 if spread > 10 else 1e-12, atol=1e-12)
    assert np.all(weights[np.isneginf(scores)] == 0)


@pytest.mark.parametrize("weigh", TWINS)
@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("shape", [(5, 5), (3, 5), (2, 2)])
def test_targets_that_cannot_be_missed(weigh, seed, shape):
    """Scores so far apart that a common scale would lose every association that can be."""
    scores = drawn(seed, shape, 500.0, 0.0, sure=0.8)
    np.testing.assert_allclose(weigh(scores, 16)[0], enumerated(scores), atol=1e-11)


def test_all_want_one_return_most_and_one_gets_it():
    scores = np.full((6, 7), -2000.0)
    scores[:, 0], scores[:, 1] = -1900.0, 0.0
    for weigh in (kernels.joint_weights, joint.joint_weights):
        weights, _ = weigh(scores, 16)
        np.testing.assert_allclose(weights[:, 0], 5 / 6, atol=1e-12)
        np.testing.assert_allclose(weights[:, 1], 1 / 6, atol=1e-12)


@given(
    seeds,
    st.sampled_from([(9, 9), (4, 13), (13, 4), (2, 8, 6), (2, 3, 4, 5), (0, 3, 3), (12, 12)]),
    st.sampled_from([1.0, 30.0, 300.0]),
    st.sampled_from([0.2, 0.6, 0.8, 0.95]),
    st.integers(-1, 9),
)
@pytest.mark.costly
def test_the_twins_agree_on_what_is_too_wide_and_on_the_rest(seed, shape, spread, closed, most):
    scores = drawn(seed, shape, spread, closed)
    (weights, wide), (expected, as_wide) = kernels.joint_weights(scores, most), joint.joint_weights(scores, most)
    np.testing.assert_array_equal(wide, as_wide)
    np.testing.assert_allclose(weights, expected, atol=1e-11)
    for found in (kernels.wide_clusters(scores, most), joint.wide_clusters(scores, most)):
        np.testing.assert_array_equal(found, wide)


def test_a_long_chain_keeps_two_columns_open():
    """A hundred tracks, each with a return between it and the next."""
    t, rng = 100, np.random.default_rng(1)
    scores = np.full((t, t), -np.inf)
    scores[:, 0] = rng.normal(size=t)
    for i in range(t - 1):
        scores[i : i + 2, 1 + i] = rng.normal(1.0, 2.0, 2)
    assert not kernels.wide_clusters(scores, 2).any()
    assert kernels.wide_clusters(scores, 1).all()
    whole, by_twin = kernels.joint_weights(scores, 2)[0], joint.joint_weights(scores, 2)[0]
    np.testing.assert_allclose(whole, by_twin, atol=1e-12)
    np.testing.assert_allclose(whole.sum(axis=1), 1.0, rtol=1e-12)
    start = kernels.joint_weights(scores[:6, :6], 16)[0]  # what is far along the chain hardly counts
    np.testing.assert_allclose(whole[0, :6], start[0], atol=0.05)


def test_twelve_tracks_and_thirty_returns_are_exact():
    scores = drawn(3, (12, 30), 2.0, 0.0)
    weights, wide = kernels.joint_weights(scores, 12)
    assert not wide.any()
    assert kernels.wide_clusters(scores, 11).all()
    np.testing.assert_allclose(weights, joint.joint_weights(scores, 12)[0], atol=1e-12)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, rtol=1e-12)
    assert weights[:, 1:].sum(axis=0).max() <= 1 + 1e-12


def test_more_sets_than_are_allowed_are_refused_before_any_is_counted():
    scores = np.zeros((16, 80))
    assert kernels.wide_clusters(scores, 16).all()
    assert joint.wide_clusters(scores, 16).all()
    assert not kernels.wide_clusters(scores[:, :60], 16).any()


def without_balance(gain):
    return (
        np.exp(-np.maximum(gain.max(axis=1), 0)),
        np.ones(gain.shape[1]),
        np.exp(gain - np.maximum(gain.max(axis=1), 0)[:, None]),
    )


def closes_too_late(linked, most):
    return list(range(len(linked))), 0.0 if most > 2 else np.inf


@pytest.mark.parametrize(
    ("name", "mutant", "check"),
    [
        ("_scaled", without_balance, test_all_want_one_return_most_and_one_gets_it),
        ("_order", closes_too_late, test_the_twins_agree_on_what_is_too_wide_and_on_the_rest),
    ],
)
@pytest.mark.costly
def test_the_comparison_bites(monkeypatch, name, mutant, check):
    monkeypatch.setattr(joint, name, mutant)
    with np.errstate(all="ignore"), pytest.raises(AssertionError):
        check()
