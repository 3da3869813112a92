"""The verdicts on Bayes-risk detection: they fall when a part is broken, and on the paper's own figures."""

import numpy as np
import pytest

import vedette
from vedette_bayes_risk import fusion, verdicts
from vedette_bayes_risk.configs import CONTESTED, FILTERS
from vedette_bayes_risk.outcome import WINDOWS
from vedette_bayes_risk.reproduction import DENSE_REACH, REACH, contest, draw, record
from vedette_report.findings import Cell, ratio_cell, rms_cell
from vedette_standard.motion.constant_velocity_piecewise import ConstantVelocityPiecewise

SAME, GAIN, FALSE_ALARM, SUMS, COVARIANCE, REASON = range(6)
FIRST, SECOND = verdicts.MANOEUVRES
RISKS = {
    ("risk", "printed"): Cell(verdicts.least_risk(vedette.load(FILTERS["proposed, printed"]).preprocessors["fused"]), 0.0),
    ("risk", "corrected"): Cell(verdicts.least_risk(vedette.load(FILTERS["proposed"]).preprocessors["fused"]), 0.0),
}
FOUND = RISKS | {
    ("error", FIRST): Cell(3.534, 0.020, 3.5268),
    ("error", SECOND): Cell(3.508, 0.009, 3.5270),
    ("phases",): Cell(1.007, 0.006),
    ("lost",): Cell(0.0, 0.3),
    ("IMM/MSPDA tuned", FIRST): Cell(1.043, 0.004),
    ("IMM/MSPDA tuned", SECOND): Cell(1.061, 0.002),
    ("IMM/MSPDA soft", FIRST): Cell(0.789, 0.004),
    ("IMM/MSPDA soft", SECOND): Cell(0.972, 0.002),
    ("NEES", "printed"): Cell(1.85, 0.035),
    ("spread", "printed"): Cell(2.33, 0.06),
    ("NEES", "corrected"): Cell(1.43, 0.025),
    ("spread", "corrected"): Cell(1.57, 0.035),
}
"""What a default run finds, rounded; risks have no chance in them and are computed."""


def of(changed=None, runs=1000):
    return [claim.verdict for claim in verdicts.claims(FOUND | (changed or {}), runs, runs // 2)]


def test_what_a_default_run_finds_decides_all():
    assert of() == ["reproduced", "not reproduced", "remark", *["not reproduced"] * 2, "remark"]


def test_half_of_the_runs_lost_is_no_error_to_judge():
    assert of({("lost",): Cell(50.0, 2.0)})[SAME] == "not reproduced"


def errors(experiment, scene):
    """Return the figures of the first claim."""
    made = record(experiment, *scene)
    squares = [made.squares[:, WINDOWS[window]] for window in (FIRST, SECOND)]
    return {
        ("error", FIRST): rms_cell(squares[0]),
        ("error", SECOND): rms_cell(squares[1]),
        ("phases",): ratio_cell(*squares),
    }


@pytest.fixture(scope="module")
def scene():
    return draw(vedette.load(FILTERS["proposed"]), 100, REACH, np.random.default_rng(41))


@pytest.mark.costly
def test_a_filter_with_too_little_noise_does_not_err_alike_in_both(scene, monkeypatch):
    right = ConstantVelocityPiecewise.covariance
    monkeypatch.setattr(ConstantVelocityPiecewise, "covariance", lambda self, dt: right(self, dt) / 400)
    assert of(errors(vedette.load(FILTERS["proposed"]), scene), 100)[SAME] == "not reproduced"


def test_returns_that_are_not_averaged_err_more(scene, monkeypatch):
    """The base's return for each that confirms it, with the variance of seven."""
    right = fusion._nearest
    monkeypatch.setattr(fusion, "_nearest", lambda z, detections, threshold: (z, right(z, detections, threshold)[1]))
    assert of(errors(vedette.load(FILTERS["proposed"]), scene), 100)[SAME] == "not reproduced"


@pytest.mark.parametrize(
    ("claim", "printed"),
    [
        (GAIN, {("IMM/MSPDA tuned", w): Cell(gain, 0.004) for w, gain in zip((FIRST, SECOND), verdicts.GAINS, strict=True)}),
        (SUMS, {("risk", "printed"): RISKS["risk", "corrected"]}),
        (COVARIANCE, {("NEES", "printed"): Cell(1.0, 0.03), ("spread", "printed"): Cell(1.0, 0.03)}),
    ],
)
def test_the_papers_figures_flip_what_was_not_reproduced(claim, printed):
    """A gain as in table 2; sums that decide where many confirm; a covariance that holds its errors."""
    assert of()[claim] == "not reproduced"
    assert of(printed)[claim] == "reproduced"


@pytest.mark.costly
def test_the_figures_are_those_of_the_study():
    """All that `claims` asks for, on few runs: the printed covariance is too small, and no claim is a literal."""
    experiments = {name: vedette.load(config) for name, config in (FILTERS | CONTESTED).items()}
    first = draw(experiments["proposed"], 8, REACH, np.random.default_rng(42))
    dense = draw(experiments["printed weights, printed P"], 80, DENSE_REACH, np.random.default_rng(43))
    records = {name: record(experiments[name], *first) for name in FILTERS}
    contests = {form: contest(experiments[f"printed weights, {form}"], *dense) for form in verdicts.FORMS}
    alike = {f"{weights} weights, {form}": contests[form] for weights in ("printed", "corrected") for form in contests}
    found = verdicts.figures(records, alike, experiments)
    assert found.keys() == FOUND.keys()
    assert verdicts.claims(found, 8, 80)[COVARIANCE].verdict == "not reproduced"
    for key in RISKS:
        assert found[key] == RISKS[key]
