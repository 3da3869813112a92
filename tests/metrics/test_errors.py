"""RMSE and its standard error."""

import numpy as np
import pytest

from vedette_study.over_runs import rmse_over_runs


def test_rmse_over_runs_takes_the_run_as_the_unit():
    error = np.sqrt(np.array([1.0, 3.0]))[:, None, None] * np.ones((2, 7, 1))
    both = rmse_over_runs(error)
    assert both.value == pytest.approx(np.sqrt(2))
    assert both.error == pytest.approx(1 / (2 * np.sqrt(2)))
    assert rmse_over_runs(error[:1]).error is None
    assert rmse_over_runs(np.zeros((3, 2, 2))).error == 0


def test_the_standard_error_of_an_rmse_is_its_spread():
    """Over 4,000 studies of 100 runs whose scans are copies of one another; false-alarm rate about 1e-7."""
    rng = np.random.default_rng(1)
    studies = [rmse_over_runs(np.repeat(rng.normal(size=(100, 1, 2)), 3, axis=1)) for _ in range(4000)]
    spread = np.std([study.value for study in studies])
    assert np.mean([study.error for study in studies]) == pytest.approx(spread, rel=5.33 / np.sqrt(8000) + 0.02)
