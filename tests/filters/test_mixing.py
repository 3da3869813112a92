"""Mixtures replaced by their moments, where an axis wraps."""

from itertools import permutations

import numpy as np
import pytest

from vedette import Gaussian, Space
from vedette.filters import merged
from vedette.types import Mixtures


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_angles_are_averaged_around_the_likeliest_part_whatever_stands_first(order):
    """An unlikely part lies opposite to two likely ones: averaged around it these would be half a turn apart."""
    course, shares = np.array([-0.2, 0.2, 3.0])[list(order)], np.array([0.5, 0.4, 0.1])[list(order)]
    means = Gaussian(np.array([*course[:, None], [1.0]]), np.array([[[0.04]]] * 3 + [[[0.09]]]))
    mixtures = Mixtures(np.array([0, 1, 0, 0]), np.array([0, 3, 1, 2]), np.insert(shares, 1, 1.0), 2)
    found = merged(means, mixtures, Space.of(course="rad mod 2pi"))
    off = np.array([0.0, 0.4, 3.2 - 2 * np.pi])  # of the likeliest, the short way round
    step = np.sum([0.5, 0.4, 0.1] * off)
    np.testing.assert_allclose(found.mean[:, 0], [-0.2 + step, 1.0])
    np.testing.assert_allclose(found.cov[:, 0, 0], [0.04 + np.sum([0.5, 0.4, 0.1] * (off - step) ** 2), 0.09])
