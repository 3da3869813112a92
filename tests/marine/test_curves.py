"""Errors that a curve shows as means over blocks of scans."""

import numpy as np

from vedette_marine.outcome import BLOCK, in_blocks


def test_blocks_are_means_over_scans_and_a_rest_is_left_out():
    values = np.random.default_rng(0).standard_normal((3, 4 * BLOCK + 7))
    found = in_blocks(values)
    assert found.shape == (3, 4)
    np.testing.assert_allclose(found[:, 1], values[:, BLOCK : 2 * BLOCK].mean(axis=1))
    np.testing.assert_array_equal(in_blocks(values)[1], in_blocks(values[1]))
    np.testing.assert_allclose(in_blocks(values[:, :5]), values[:, :5].mean(axis=1, keepdims=True))  # fewer than a block
