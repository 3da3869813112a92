"""Weights and probabilities are normal numbers or 0: arithmetic on what lies between costs many times as much."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vedette import kernels
from vedette.kernels import association, modes, reference

TINY = np.finfo(float).tiny
COMPILED = kernels.update is not reference.update


def kernels_of(twin):
    """A function that gives a kernel by its name; other instruction sets are put back by `use` below."""
    if twin == "numpy":
        homes = (reference, modes, association)
        return lambda name: next(getattr(home, name) for home in homes if hasattr(home, name))
    return lambda name: getattr(kernels, name)


@pytest.fixture(params=["numpy", *(["baseline", "avx2", "avx512"] if COMPILED else [])])
def kernel(request):
    if request.param == "numpy":
        yield kernels_of("numpy")
        return
    from vedette.kernels import _compiled

    if request.param not in _compiled.instruction_sets():
        pytest.skip("not of this processor")
    usual = _compiled.instruction_set()
    _compiled.use(request.param)
    yield kernels_of("compiled")
    _compiled.use(usual)


def assert_normal(numbers, what):
    numbers = np.asarray(numbers)
    assert np.all((numbers == 0.0) | (numbers >= TINY)), what


# Around the least exponent, and where a weight passes it only when it is divided by the sum.
logs = st.floats(-760.0, -690.0) | st.floats(-708.5, -708.3) | st.floats(-3.0, 0.0) | st.just(-np.inf)
many = settings(max_examples=60)


@pytest.mark.parametrize("batch", [1, 11])
@pytest.mark.by_turns
def test_no_weight_below_the_smallest_normal_number_leaves_a_kernel(kernel, batch):
    @many
    @given(st.lists(logs, min_size=1, max_size=6), st.floats(0.0, 1.0), st.sampled_from([True, False]))
    def check(scores, prior, exclusive):
        scores = np.array([0.0, *scores])
        assert_normal(weights := kernel("softmax")(scores), "softmax")
        expected = np.exp(scores) / np.exp(scores).sum()
        np.testing.assert_allclose(weights, np.where(expected < TINY, 0.0, expected), rtol=1e-12, atol=1.0001 * TINY)
        rows = np.broadcast_to(scores, (batch, 1, scores.size))
        loglik = np.minimum(rows[..., ::-1], 0.0)
        for choice in ("softmax", "one_hot"):
            given_weights = kernel(choice)(rows)
            assert_normal(given_weights, choice)
            exists = np.full((batch, 1), prior)
            hit, after, _ = kernel("existence")(rows, given_weights, exists, loglik, 0.99, exclusive)
            assert_normal(hit, f"hit by {choice}")
            assert_normal(after, f"existence by {choice}")
        share = np.broadcast_to(np.stack([scores, scores[::-1]], axis=-1), (batch, scores.size, 2))
        for own in kernel("split_weights")(kernel("softmax")(rows[:, 0]), share)[1]:
            assert_normal(own, "split_weights")

    check()


def test_modes_next_to_impossible_have_no_part_in_a_mixture(kernel):
    """Seen through means: those of the other modes are so large that any weight but 0 would show."""
    log_prob = np.array([0.0, -720.0, -np.inf])
    xs, Ps = np.array([[0.0], [1e300], [1e300]]), np.ones((3, 1, 1))
    _, mean, _, _ = kernel("imm_combine")(log_prob, np.zeros(3), xs, Ps)
    assert mean[0] == 0.0
    stay = np.log(np.full((3, 3), 1.0 / 3.0))
    assert np.all(kernel("imm_mix")(log_prob, stay, xs, Ps)[1] == 0.0)
    clutter = np.array([[0.0], [1e8]])
    found = kernel("pda_update")(
        np.zeros((1, 1)), np.ones((1, 1, 1)), clutter, np.eye(1), np.eye(1), 0.9, 0.99, np.inf, -2.0
    )
    assert np.isfinite(found[0]).all()


def test_a_target_that_cannot_be_missed_still_exists_if_it_surely_did(kernel):
    """Log 0 is bounded at the smallest normal number's, so certainty against certainty leaves the prior."""
    miss = reference.safe_log(np.zeros((1, 1)))
    _, exists, _ = kernel("existence")(np.zeros((1, 1)), np.ones((1, 1)), np.ones(1), miss, 1.0, True)
    assert exists[0] == 1.0
