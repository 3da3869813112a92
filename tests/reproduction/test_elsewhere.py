"""The papers' claims on scenes that are not theirs: what docs/measured/papers.md says of them."""

import numpy as np
import pytest

from support.paths import EXAMPLES
from vedette_study.plan import plan, read_study
from vedette_study.study import perform

FOUR = 4.0
"""Standard errors beyond which a claim is decided; the studies' own seed is fixed, and the effects are 7 and more."""


def compared(paper, runs):
    """Share of lost runs, and mean ratio of errors to the first tracker's with its standard error, by tracker."""
    outcome = perform(plan(read_study(EXAMPLES / "elsewhere" / f"{paper}_study.toml") | {"runs": runs}))
    lost = outcome.figures["lost"] > 0
    error = np.sqrt(outcome.figures["position_rmse"])[:, ~lost.any(axis=0)]
    ratio = error / error[0]
    names = [point.labels["tracker"] for point in outcome.plan.points]
    spread = ratio.std(axis=1, ddof=1) / np.sqrt(ratio.shape[1])
    return dict(zip(names, zip(lost.mean(axis=1), ratio.mean(axis=1), spread, strict=True), strict=True))


@pytest.mark.costly
def test_an_imm_keeps_vessels_that_one_filter_loses():
    found = compared("vts", 300)
    assert found["CVKF"][0] > 0.2
    for name in ("IMMCV2", "IMMCVCA"):
        lost, ratio, error = found[name]
        assert lost == 0
        assert ratio < 1 - FOUR * error
    assert found["CAKF"][1] > 1 + FOUR * found["CAKF"][2]


@pytest.mark.costly
def test_an_imm_errs_less_than_its_modes_on_boats():
    found = compared("marine", 100)
    for name in ("CV-PDAF", "CT-PDAF"):
        _, ratio, error = found[name]
        assert ratio > 1 + FOUR * error


@pytest.mark.costly
def test_target_oriented_gains_little_on_turns_of_any_rate():
    found = compared("target_oriented", 100)
    _, ratio, error = found["TOM"]
    assert 0.8 + FOUR * error < ratio < 1.0
    assert found["turn rate estimated"][1] < 1 - FOUR * found["turn rate estimated"][2]


@pytest.mark.nightly("a minute of CPU: trackers of four sensors in clutter, one run after the other")
def test_an_imm_beats_detection_with_a_base():
    found = compared("bayes_risk", 50)
    assert found["proposed"][1] > 1 + FOUR * found["proposed"][2]
    assert found["no base"][1] < 1
