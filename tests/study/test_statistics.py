"""Means over runs: of figures that sum as roots, and which runs are the worst."""

import numpy as np
import pytest

from vedette_study.statistics import difference, mean
from vedette_study.worst_runs import _order


def test_a_difference_of_roots_errs_as_the_roots_do():
    """Of squares four times as large in every run: the root is twice as large, and so is its error, run by run."""
    squares = np.random.default_rng(4).chisquare(2, 50)
    one, other = mean("position_rmse", squares), difference("position_rmse", squares, 4.0 * squares)
    assert (other.value, other.runs) == (pytest.approx(-one.value), 50)
    assert other.error == pytest.approx(one.error)
    assert one.error == pytest.approx(0.5 * np.std(squares, ddof=1) / np.sqrt(50) / np.sqrt(np.mean(squares)))


def test_a_run_that_covers_nothing_is_the_worst():
    assert _order(np.array([2.0, np.nan, 7.0, np.nan, 3.0])) == [1, 3, 2, 4, 0]
