"""GOSPA and OSPA against enumeration, and the laws of a metric."""

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from support.pairings import pairings
from vedette.metrics import distances, gospa, ospa

law = settings(max_examples=150)


# A coarse grid makes ties, zeros and distances equal to the cutoff common.
spots = st.integers(0, 4).flatmap(lambda n: arrays(float, (n, 2), elements=st.integers(-6, 6).map(float)))
cutoffs, orders = st.sampled_from([0.5, 3.0, 5.0, 20.0]), st.sampled_from([1.0, 2.0, 3.5])


# Set distances
@given(spots, spots, cutoffs, orders)
@law
@pytest.mark.costly
def test_gospa_is_the_least_over_all_pairings(a, b, cutoff, order):
    apart = distances(a, b)
    best = min(
        sum(apart[i, j] ** order for i, j in pairs) + cutoff**order / 2 * (len(a) + len(b) - 2 * len(pairs))
        for pairs in pairings(len(a), len(b))
    )
    found = gospa(apart, cutoff, order)
    assert found.value == pytest.approx(best ** (1 / order), rel=1e-12, abs=1e-12)
    assert found.localisation + found.missed + found.false == pytest.approx(best, rel=1e-12, abs=1e-12)
    assert found.missed - found.false == pytest.approx(cutoff**order / 2 * (len(a) - len(b)), abs=1e-9)
    assert found.localisation >= 0
    assert found.missed >= 0
    assert found.false >= 0


@given(spots, spots, cutoffs, orders)
@law
@pytest.mark.costly
def test_ospa_is_the_least_over_all_assignments(a, b, cutoff, order):
    apart = np.minimum(distances(a, b), cutoff)
    apart = apart if len(a) <= len(b) else apart.T
    few, many = apart.shape
    best = min(sum(apart[i, j] ** order for i, j in enumerate(p)) for p in permutations(range(many), few))
    expected = ((best + cutoff**order * (many - few)) / many) ** (1 / order) if many else 0.0
    assert ospa(distances(a, b), cutoff, order) == pytest.approx(expected, rel=1e-12, abs=1e-12)


@given(spots, spots, spots, cutoffs, orders)
@law
@pytest.mark.costly
def test_set_distances_are_metrics(a, b, c, cutoff, order):
    for metric in (
        lambda p, q: gospa(distances(p, q), cutoff, order).value,
        lambda p, q: ospa(distances(p, q), cutoff, order),
    ):
        assert metric(a, a) == 0
        assert metric(a, b) == pytest.approx(metric(b, a), rel=1e-12)
        assert metric(a, c) <= metric(a, b) + metric(b, c) + 1e-9
        assert (metric(a, b) == 0) == (sorted(a.tolist()) == sorted(b.tolist()))


def test_gospa_counts_each_miss_where_ospa_averages():
    nothing = np.zeros((3, 0))
    assert gospa(nothing, 20.0).value == pytest.approx(20 * np.sqrt(3 / 2))
    assert ospa(nothing, 20.0) == 20
    assert gospa(np.zeros((0, 0)), 20.0).value == ospa(np.zeros((0, 0)), 20.0) == 0


@pytest.mark.parametrize(("cutoff", "order"), [(0.0, 2.0), (-1.0, 2.0), (10.0, 0.5), (np.nan, 2.0)])
def test_set_distances_refuse_what_makes_no_metric(cutoff, order):
    for metric in (gospa, ospa):
        with pytest.raises(ValueError, match=r"^cutoff: must be > 0 m, and order >= 1"):
            metric(np.ones((1, 1)), cutoff, order)
