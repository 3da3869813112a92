"""Repairs taken back, one at a time: of studies whose runs are all alike, of memory, of units, of scans given by hand.

Each is caught by the test named for it, which passes with the repair.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import vedette
from report import test_warnings as units
from study import test_recordings as studies
from tracking import test_live_loop as hand
from tracking import test_memory_limits as memory
from vedette.errors import VedetteError
from vedette.tracking import births, intake, memory_limits, validation
from vedette.tracking import tracker as stepping
from vedette_report.warnings import words as warnings
from vedette_study import plan as planning
from vedette_study import redraw

Check = Callable[[Path, pytest.MonkeyPatch], None]
CAUGHT = (AssertionError, VedetteError, pytest.fail.Exception, AttributeError, IndexError)
"""What a test may fail with; no TypeError, as what replaces a cure must be called as the cure is."""

WRONG = {words: scans for scans, words in units.test_what_looks_wrong_is_said.pytestmark[0].args[1]}


def study(check: Callable[[Any], None]) -> Check:
    return lambda folder, patch: check(studies.config(studies.recording(folder / "recording.jsonl")))


def built(check: Callable[..., None], *given: Any) -> Check:
    return lambda folder, patch: check(vedette.build(hand.CONFIG), *given)


def plain(check: Callable[..., None], *given: Any) -> Check:
    return lambda folder, patch: check(*given)


def said(words: str) -> Check:
    (found,) = [each for each in WRONG if words in each]
    return lambda folder, patch: units.test_what_looks_wrong_is_said(WRONG[found], found)


def counted(modes: int) -> Check:
    return lambda folder, patch: memory.test_the_limit_counts_tracks_modes_and_returns(modes, patch)


def nothing(*given: Any) -> None:
    """Do nothing."""


CURES: dict[str, tuple[Any, str, Any, Check]] = {
    # A study on a recording runs the same run N times.
    "study: nothing is left out": (
        redraw.Redraw, "recording", lambda self, whole, seeds: whole, study(studies.test_a_study_of_a_recording_has_errors)
    ),
    "study: every run draws the same": (
        redraw, "_stream", lambda *given: np.random.default_rng(0), study(studies.test_a_study_of_a_recording_has_errors)
    ),
    "study: equal runs are not refused": (
        planning, "_draws", lambda *given: True, study(studies.test_runs_that_would_all_be_the_same_are_refused)
    ),
    "study: no run is thought to draw": (
        planning, "_draws", lambda *given: False, study(studies.test_a_study_of_a_recording_has_errors)
    ),
    # Memory grows as tracks x returns.
    "memory: pairs are not counted": (
        memory_limits, "check_pairs", nothing, counted(3)
    ),
    "memory: modes are not counted": (
        memory_limits.pytrees, "size", lambda belief: 0, counted(3)
    ),
    "memory: births are not counted": (
        births, "check_births", nothing, lambda folder, patch: memory.test_tracks_that_would_begin_count_too(patch)
    ),
    # Forgotten units mislead.
    "units: degrees": (warnings, "beyond_period", nothing, said("radar: bearing goes up to")),
    "units: out of reach is not counted": (
        intake.Came, "_ask_for_reach", nothing, said("radar: all of the first 30 returns")
    ),
    "units: the sensor's silence": (warnings, "_of_sensor", lambda *given: iter(()), said("radar: none of 30 scans")),
    "units: equal times": (warnings, "MOST", 1.0, said("beacon: 27 of 30 scans")),
    "units: long steps": (warnings, "_LONG", np.inf, said("scans are 2,500 s apart")),
    "units: any step is long": (warnings, "_LONG", 0.0, plain(units.test_what_is_right_is_not_said)),
    "units: what is right is odd": (warnings, "MOST", -1.0, plain(units.test_what_is_right_is_not_said)),
    "units: refused input": (warnings, "_refused", nothing, plain(units.test_refused_input_is_said_first)),
    # A loop over scans and priors that are given by hand.
    "by hand: nothing has no axes": (
        validation, "with_axes", lambda scan, sensors: scan,
        built(hand.test_a_scan_without_returns_needs_no_number_of_axes, "radar"),
    ),
    "by hand: a prior is taken as it is": (
        stepping, "checked_prior", lambda given, axes: given, built(hand.test_a_prior_of_lists_is_one)
    ),
    "by hand: a prior is not looked at": (
        stepping, "checked_prior", lambda given, axes: given,
        built(hand.test_a_prior_that_is_none_is_told, vedette.Gaussian(np.zeros(4), np.eye(4)), "given: must have mean"),
    ),
    "by hand: a pose is not looked at": (
        validation, "_pose_flaws", lambda pose: [], built(hand.test_a_pose_that_is_no_place_is_refused, [0.0] * 4)
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CURES)
@pytest.mark.by_turns
def test_without_its_cure_a_fault_is_caught(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    where, attribute, wrong, check = CURES[name]
    with monkeypatch.context() as patch:
        check(tmp_path, patch)
    monkeypatch.setattr(where, attribute, wrong)
    with pytest.raises(CAUGHT):
        check(tmp_path, monkeypatch)
