"""Points in boxes: the grid finds what comparing every pair does."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.cpu import seconds
from vedette import kernels
from vedette.kernels import boxes

seeds = st.integers(0, 2**32 - 1)


def compared(low, high, points, periods):
    pairs = []
    for i in range(len(low)):
        for j, point in enumerate(points):
            inside = np.isfinite(point).all()
            for axis, x in enumerate(point):
                turn = dict(periods).get(axis)
                x = x if turn is None else low[i, axis] + (x - low[i, axis]) % turn
                inside = inside and low[i, axis] <= x <= high[i, axis]
            if inside:
                pairs.append([i, j])
    return pairs


@pytest.mark.parametrize("search", [kernels.pairs_in_boxes, boxes.pairs_in_boxes], ids=["running", "reference"])
@given(seeds, st.integers(0, 12), st.integers(0, 40), st.integers(1, 3), st.sampled_from([(), ((0, 4.0),), ((1, 4.0),)]))
@pytest.mark.by_turns
def test_every_pair_is_found_once(search, seed, t, k, m, periods):
    rng = np.random.default_rng(seed)
    periods = tuple(one for one in periods if one[0] < m)
    points = rng.integers(-6, 7, (k, m)) / 2.0
    points[rng.random((k, m)) < 0.03] = np.nan
    low = rng.integers(-6, 7, (t, m)) / 2.0
    high = low + rng.integers(0, 6, (t, m)) / 2.0
    expected = compared(low, high, points, periods)
    found = search(low, high, points, periods, 10_000)
    assert np.stack(found, axis=1).tolist() == expected
    cut = search(low, high, points, periods, 3)
    assert np.stack(cut, axis=1).tolist() == expected[:4]


def test_boxes_without_end_and_boxes_of_nothing():
    points = np.random.default_rng(1).normal(size=(50, 2))
    low, high = (
        np.array([[-np.inf, -np.inf], [1.0, 1.0], [np.nan, 0.0]]),
        np.array([[np.inf, np.inf], [0.5, 2.0], [1.0, 1.0]]),
    )
    for search in (kernels.pairs_in_boxes, boxes.pairs_in_boxes):
        tracks, returns = search(low, high, points, (), 1000)
        assert tracks.tolist() == [0] * 50
        assert returns.tolist() == list(range(50))


def test_many_points_in_a_corner_and_one_far_away():
    rng = np.random.default_rng(2)
    points = np.concatenate([rng.normal(size=(300, 2)), [[1e9, -1e9]]])
    low = rng.normal(size=(100, 2))
    for one, other in zip(
        kernels.pairs_in_boxes(low, low + 0.3, points, (), 10**6),
        boxes.pairs_in_boxes(low, low + 0.3, points, (), 10**6),
        strict=True,
    ):
        np.testing.assert_array_equal(one, other)


def crowds(rng, count):
    """Points of three scales, each a thousand times smaller than the one before, and some in one place."""
    scales = [rng.normal(size=(count, 2)) * 1e3**-scale + 5.0 * scale for scale in range(3)]
    return np.concatenate([*scales, np.ones((99, 2))])


@given(seeds)
def test_crowds_within_crowds_are_searched_to_the_end(seed):
    rng = np.random.default_rng(seed)
    points = crowds(rng, 150)
    low = points[rng.choice(len(points), 40)] - 1e-3
    high = low + 10.0 ** rng.uniform(-4, 1, (40, 2))
    for one, other in zip(
        kernels.pairs_in_boxes(low, high, points, (), 10**6), boxes.pairs_in_boxes(low, high, points, (), 10**6), strict=True
    ):
        np.testing.assert_array_equal(one, other)


@pytest.mark.skipif(not kernels.RUNNING.startswith("compiled"), reason="the reference compares every pair")
def test_what_lies_far_away_makes_no_search_longer():
    """Of 20,000 points that are spread evenly, one more far away made it take 300 times as long; it takes about as long."""
    rng = np.random.default_rng(3)
    points, low = rng.uniform(0, 1e4, (2, 20_000, 2))

    def takes(points):
        return seconds(lambda: kernels.pairs_in_boxes(low, low + 50.0, points, (), 10**6), times=5)

    assert takes(np.append(points, [[1e7, 1e7]], axis=0)) < 20 * takes(points)


@pytest.mark.parametrize("find", [kernels.linked_clusters, boxes.linked_clusters], ids=["running", "reference"])
@given(seeds, st.integers(0, 12), st.integers(0, 12), st.integers(0, 20))
def test_clusters_are_what_pairs_link(find, seed, t, k, pairs):
    rng = np.random.default_rng(seed)
    pairs = pairs if t and k else 0
    tracks, returns = rng.integers(0, max(t, 1), pairs), rng.integers(0, max(k, 1), pairs)
    reached = np.eye(t + k, dtype=int)
    reached[tracks, t + returns] = reached[t + returns, tracks] = 1
    for _ in range(t + k):
        reached = (reached @ reached > 0).astype(int)
    firsts = np.argmax(reached, axis=1) if t + k else np.zeros(0, int)
    expected = [sorted(set(firsts.tolist())).index(first) for first in firsts.tolist()]
    assert find(tracks, returns, t, k).tolist() == expected
