"""Errors from curvature and scores: exact for a criterion whose errors are known."""

import numpy as np
import pytest

from vedette_tools.tuning import errors
from vedette_tools.tuning.errors import curvature, long_run

TOP = np.array([0.4, 0.6, 0.5])


class Parabola:
    """A stand-in for an asker: the log-likelihood of independent normal scans with the given scores."""

    by = "likelihood"

    def __init__(self, scores):
        self.scores, self.H = scores, scores.T @ scores

    def found(self, position):
        away = position - TOP
        return self.scores @ away - 0.5 * away @ self.H @ away / len(self.scores)

    def height(self, position):
        return float(np.sum(self.found(position)))

    def heights(self, positions):
        return [self.height(each) for each in positions]


def scores(count=400, blind=()):
    drawn = np.random.default_rng(3).normal(size=(count, 3)) * [1.0, 2.0, 4.0]
    drawn = (drawn - drawn.mean(axis=0)) @ np.array([[1.0, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    drawn[:, list(blind)] = 0.0
    return drawn


def test_the_errors_of_a_parabola(monkeypatch):
    """By the inverse of the curvature where scores are as large as it says, and larger with what scores say beyond."""
    made = scores()
    monkeypatch.setattr(errors, "long_run", lambda each: each.T @ each)
    known = curvature(Parabola(made), TOP + 0.001)
    assert known.position == pytest.approx(TOP, abs=1e-6)
    assert known.cov == pytest.approx(np.linalg.inv(made.T @ made), rel=1e-3)
    monkeypatch.setattr(errors, "long_run", lambda each: 4.0 * each.T @ each)
    assert curvature(Parabola(made), TOP).error == pytest.approx(2.0 * known.error, rel=1e-3)


def test_what_the_data_do_not_tell():
    known = curvature(Parabola(scores(blind=[1])), TOP)
    assert np.isnan(known.error[1])
    assert np.all(known.error[[0, 2]] > 0)
    assert np.abs(known.blurred[0]) == pytest.approx([0.0, 1.0, 0.0], abs=1e-6)


def test_what_lies_at_an_edge():
    top = np.array([0.4, 1.0, 0.5])
    known = curvature(Parabola(scores()), top)
    assert known.edge.tolist() == [1]
    assert np.isnan(known.error[1])
    assert known.position[1] == 1.0


def test_scores_that_go_on_in_the_next_count():
    """A moving average over two scans has the long-run variance of its sum, twice that of its parts."""
    rng = np.random.default_rng(5)
    white = rng.normal(size=(20000, 1))
    assert long_run(white)[0, 0] / 20000 == pytest.approx(1.0, rel=0.15)
    assert long_run((white[1:] + white[:-1]) / np.sqrt(2))[0, 0] / 20000 == pytest.approx(2.0, rel=0.15)
