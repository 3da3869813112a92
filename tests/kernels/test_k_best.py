"""The k best assignments: equal to all of them enumerated, in order, in both twins."""

from itertools import permutations

import numpy as np
import pytest
import scipy.optimize  # noqa: F401  the reference imports it when first called, which must not count as a test's time
from hypothesis import given
from hypothesis import strategies as st

from vedette import kernels
from vedette.kernels import assignment

TWINS = [pytest.param(kernels.k_best, id="running"), pytest.param(assignment.k_best, id="reference")]
sizes = st.tuples(st.integers(0, 5), st.integers(0, 5))
seeds = st.integers(0, 2**32 - 1)


def enumerated(cost):
    """All possible assignments and their costs, in ascending order of (cost, columns)."""
    n, m = cost.shape
    all_of_them = [(sum((cost[i, j] for i, j in enumerate(columns)), 0.0), columns) for columns in permutations(range(m), n)]
    return sorted(one for one in all_of_them if one[0] < np.inf)


def drawn(seed, shape, forbidden, kind):
    rng = np.random.default_rng(seed)
    cost = rng.integers(-2, 3, shape).astype(float) if kind == "ties" else rng.normal(size=shape)
    cost *= {"ties": 1.0, "small": 1.0, "large": 1e6}[kind]
    cost[rng.random(shape) < forbidden] = np.inf
    return cost


@pytest.mark.parametrize("k_best", TWINS)
@given(seeds, sizes, st.sampled_from([0.0, 0.3, 0.6]), st.sampled_from(["ties", "small", "large"]), st.integers(0, 150))
@pytest.mark.by_turns
def test_they_are_the_first_of_all_assignments(k_best, seed, shape, forbidden, kind, k):
    cost = drawn(seed, shape, forbidden, kind)
    everything = enumerated(cost)
    columns, costs = k_best(cost, k)
    assert columns.dtype == np.int64
    assert columns.shape == (len(costs), shape[0])
    expected = np.array([one for one, _ in everything[:k]])
    np.testing.assert_allclose(costs, expected, rtol=1e-12, atol=1e-12)
    assert np.all(np.diff(costs) >= 0)
    assert len({tuple(row) for row in columns.tolist()}) == len(columns)
    if kind != "ties" or k >= len(everything):
        assert columns.tolist() == [list(row) for _, row in everything[:k]]


@pytest.mark.parametrize("seed", range(8))
def test_the_twins_agree_on_more_than_can_be_enumerated(seed):
    """Tracks with returns and a miss of their own: as a tracker asks."""
    rng = np.random.default_rng(seed)
    n, m = rng.integers(1, 13), rng.integers(0, 30)
    cost = np.full((n, m + n), np.inf)
    cost[:, :m] = np.where(rng.random((n, m)) < rng.uniform(0.1, 1.0), rng.normal(-2.0, 3.0, (n, m)), np.inf)
    cost[range(n), range(m, m + n)] = rng.normal(0.0, 1.0, n)
    columns, costs = kernels.k_best(cost, 60)
    other_columns, other_costs = assignment.k_best(cost, 60)
    np.testing.assert_array_equal(columns, other_columns)
    np.testing.assert_array_equal(costs, other_costs)


@pytest.mark.parametrize("k_best", TWINS)
def test_what_cannot_be(k_best):
    for cost in (np.full((2, 3), np.inf), np.zeros((3, 2)), np.array([[0.0, np.inf], [1.0, np.inf]])):
        columns, costs = k_best(cost, 5)
        assert (columns.shape, costs.shape) == ((0, cost.shape[0]), (0,))
    columns, costs = k_best(np.zeros((0, 3)), 5)
    assert (columns.shape, costs.tolist()) == ((1, 0), [0.0])


@pytest.mark.parametrize("odd", [np.nan, -np.inf])
def test_no_number_is_refused(odd):
    with pytest.raises(ValueError, match="invalid numeric entries"):
        kernels.k_best(np.array([[0.0, odd], [1.0, 2.0]]), 3)


def test_strides_and_other_types_are_read_right():
    cost = np.random.default_rng(3).integers(0, 50, (4, 6))
    expected = assignment.k_best(cost, 9)
    wide = np.zeros((4, 12))
    wide[:, ::2] = cost
    for same in (cost, cost.tolist(), np.asfortranarray(cost, dtype=float), wide[:, ::2], cost.astype(np.float32)):
        for found, right in zip(kernels.k_best(same, np.int64(9)), expected, strict=True):
            np.testing.assert_array_equal(found, right)
