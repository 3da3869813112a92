"""Rows near to each other, of groups that may lie across the edge of a circle: against a look at all pairs."""

import numpy as np
import pytest

from vedette import Space
from vedette_standard.unresolved.neighbours import within

POLAR = Space.of(range="m", bearing="rad")


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("grouped", [False, True])
def test_pairs_are_those_of_a_look_at_all(seed, grouped):
    rng, t = np.random.default_rng(seed), 60
    h = POLAR.displace(np.array([1000.0, np.pi]), rng.normal(0, [40.0, 0.4], (t, 2)))
    reach = rng.exponential([4.0, 0.05], (t, 2)) * np.where(rng.random((t, 1)) < 0.1, 5.0, 1.0)
    group = rng.permutation(np.repeat(np.arange(20), 3)) if grouped else None
    near = np.all(POLAR.difference(h[:, None], h[None]) ** 2 <= reach[:, None] ** 2 + reach[None] ** 2, axis=-1)
    i, j = np.nonzero(np.triu(near, 1))
    known = np.stack([i, j], axis=-1)[::7] if grouped else None
    may = np.ones(len(i), dtype=bool) if group is None else group[i] != group[j]
    may[::7] |= grouped
    known = None if known is None else known[group[known[:, 0]] == group[known[:, 1]]]
    found = within(h, reach, POLAR, group, known)
    np.testing.assert_array_equal(found, (i[may], j[may]))
    assert np.count_nonzero(may) > 20
