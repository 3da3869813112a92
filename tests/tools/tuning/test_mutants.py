"""Errors put into the tuning on purpose: the tests named beside them catch each."""

import numpy as np
import pytest

from support.births import drawn
from tools.tuning import test_births, test_errors, test_likelihood, test_parameters
from vedette import kernels
from vedette_tools.tuning import errors, evaluation, likelihood, parameters
from vedette_tools.tuning.field_of_view import Cover
from vedette_tools.tuning.likelihood import Predictive


def alone(scores):
    """Associate each track as if it were alone: two tracks may take one return."""
    return float(np.sum(kernels.log_sum(scores)))


MUTANTS = {
    "the returns that do not come cost nothing": (
        Cover, "total", lambda self, density: 0.0, test_likelihood.test_it_is_a_density_over_scans
    ),
    "two tracks take one return": (likelihood, "joint_likelihood", alone, test_likelihood.test_it_is_a_density_over_scans),
    "undetected targets are not expected": (
        Predictive, "_unseen", lambda *given: 0.0, test_likelihood.test_undetected_targets_count_by_what_the_birth_expects
    ),
    "tracks end when their lifecycle says so": (
        evaluation, "unthresholded", lambda tracker, real, freed: tracker,
        lambda: test_births.test_when_tracks_end_and_what_gates_leave_out_changes_nothing(
            drawn(1, 40), {"lifecycle": {"kind": "existence", "delete": 0.15, "confirm": 0.6}}
        ),
    ),
    "false returns lie where all returns do": (
        evaluation, "found", lambda tracker, ran, before: before,
        test_births.test_targets_that_leave_the_clutter_do_not_thin_it,
    ),
    "scores that go on in the next do not count": (
        errors, "long_run", lambda scores: scores.T @ scores, None
    ),
    "a transition leaves its diagonal as it is": (parameters, "_kept", lambda *given: "", None),
}  # fmt: skip


@pytest.mark.parametrize("name", MUTANTS)
@pytest.mark.by_turns
def test_each_is_caught(name, monkeypatch):
    home, attribute, wrong, check = MUTANTS[name]
    monkeypatch.setattr(home, attribute, wrong)
    if name.startswith("scores"):
        monkeypatch.setattr(test_errors, "long_run", wrong)
        check = test_errors.test_scores_that_go_on_in_the_next_count
    if name.startswith("a transition"):
        experiment = test_parameters.loaded()
        with pytest.raises(ValueError, match="row"):
            test_parameters.test_a_transition_takes_from_its_diagonal(experiment)
        return
    with pytest.raises(AssertionError):
        check()
