"""Verdicts follow figures and their errors: by definition, and by how often they err."""

import json
import math
import re

import numpy as np
import pytest

from support.paths import ROOT
from vedette_report.findings import (
    Cell,
    Condition,
    Findings,
    Place,
    judged,
    less_often_cell,
    mean_cell,
    over,
    ratio_cell,
    remark,
    rms_cell,
    share_cell,
)
from vedette_study.reproduction import data, text

RUNS = 1000


def verdict(*cells, runs=RUNS, **bounds):
    return judged("it is so", [Condition("figure", cell, **bounds) for cell in cells], runs).verdict


@pytest.mark.parametrize(
    ("figure", "bounds", "expected"),
    [
        (Cell(0.7, 0.02), {"most": 0.8}, "reproduced"),
        (Cell(0.9, 0.02), {"most": 0.8}, "not reproduced"),
        (Cell(0.77, 0.02), {"most": 0.8}, "not decided"),
        (Cell(0.83, 0.02), {"most": 0.8}, "not decided"),
        (Cell(0.9, 0.02), {"least": 0.8}, "reproduced"),
        (Cell(0.7, 0.02), {"least": 0.8}, "not reproduced"),
        (Cell(1.0, 0.02), {"least": 0.9, "most": 1.1}, "reproduced"),
        (Cell(1.07, 0.02), {"least": 0.9, "most": 1.1}, "not decided"),
        (Cell(0.8, 0.02), {"least": 0.9, "most": 1.1}, "not reproduced"),
        (Cell(0.8, 0.0), {"most": 0.8}, "reproduced"),  # a figure without chance
        (Cell(0.81, 0.0), {"most": 0.8}, "not reproduced"),
        (Cell(0.1, None), {"most": 0.8}, "not decided"),  # nobody knows how sure
        (Cell(None), {"most": 0.8}, "not decided"),
        (Cell(math.nan, 0.1), {"most": 0.8}, "not decided"),
        (Cell(math.inf, math.nan), {"most": 0.8}, "not decided"),
    ],
)
def test_one_figure(figure, bounds, expected):
    assert verdict(figure, **bounds) == expected


def test_all_must_hold_and_one_that_fails_suffices():
    good, bad, unclear = Cell(0.5, 0.01), Cell(1.5, 0.01), Cell(1.0, 0.01)
    assert verdict(good, good, most=1) == "reproduced"
    assert verdict(good, unclear, most=1) == "not decided"
    assert verdict(good, bad, unclear, most=1) == "not reproduced"


def test_a_verdict_needs_a_figure_and_a_remark_has_none():
    with pytest.raises(ValueError, match="'always': no condition; what no figure"):
        judged("always", [], 10)
    assert remark("always", "said of one run").verdict == "remark"
    assert remark("always", "said of one run").conditions == ()


@pytest.mark.parametrize("runs", [4, 10, 100])
def test_on_the_bound_hardly_any_verdict_falls_however_few_the_runs(runs):
    """.27 % by definition; at 4 runs 3 plain standard errors would give 6 %. 20,000 studies: below .45 % by 5 errors."""
    values = np.random.default_rng(1).standard_normal((20_000, runs))
    mean, error = values.mean(axis=1), values.std(axis=1, ddof=1) / np.sqrt(runs)
    factor = _factor(runs)
    decided = np.mean(np.abs(mean) >= factor * error)
    assert 0.0009 < decided < 0.0045
    for i in range(20):
        cell = mean_cell(values[i])
        assert (verdict(cell, runs=runs, most=0) != "not decided") == (abs(mean[i]) >= factor * error[i])


def _factor(runs):
    """Return the least margin over error that decides, by bisection on the rule itself."""
    low, high = 0.0, 1e3
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if verdict(Cell(-middle, 1.0), runs=runs, most=0) == "not decided" else (low, middle)
    return high


@pytest.mark.parametrize(("runs", "ratio"), [(2, 3.1), (5, 3.6), (5, 0.9), (30, 3.2), (400, 1.0)])
def test_so_many_runs_as_are_named_decide(runs, ratio):
    """The error shrinks with the root of the runs, and Student's quantile with their number."""
    needed = judged("more than 0", [Condition("mean", Cell(ratio, 1.0), least=0)], runs).needed
    assert needed > runs
    for count, expected in ((needed, "reproduced"), (int(needed * 0.85), "not decided")):  # rounded up to two digits
        if count > runs:
            cell = Cell(ratio, math.sqrt(runs / count))
            assert judged("more than 0", [Condition("mean", cell, least=0)], count).verdict == expected


def test_on_the_bound_itself_no_number_would():
    assert judged("x", [Condition("x", Cell(1.0, 0.1), most=1.0)], 100).needed is None
    assert judged("x", [Condition("x", Cell(1.0001, 0.1), most=1.0)], 100).needed is None
    assert judged("x", [Condition("x", Cell(None), most=1.0)], 100).needed is None
    both = [Condition("x", Cell(1.2, 0.1), most=1.0), Condition("y", Cell(1.0, 0.1), most=1.0)]
    assert judged("x", both, 100).needed is None


@pytest.mark.parametrize("share", [0.001, 0.01, 0.3, 1.0])
def test_the_error_of_a_share_holds_the_truth_even_where_no_run_is_a_hit(share):
    """Three errors hold the truth in 99.5 % of studies or more; the binomial's own would miss 37 % of them at .001."""
    hits = np.random.default_rng(3).random((1500, 1000)) < share
    cells = [share_cell(row) for row in hits]
    outside = np.mean([abs(cell.measured - share) > 3 * cell.error for cell in cells])
    assert outside <= 0.005
    assert all(cell.error > 0 for cell in cells)


def test_the_error_of_a_share_of_scans_counts_runs_that_are_alike_inside():
    rows = np.repeat(np.random.default_rng(4).random((200, 1)) < 0.2, 50, axis=1)  # all scans of a run agree
    assert share_cell(rows).error == pytest.approx(rows[:, 0].std(ddof=1) / math.sqrt(200), rel=1e-12)
    assert share_cell(rows, 12.0, scale=100).error == pytest.approx(100 * share_cell(rows).error, rel=1e-12)
    assert share_cell(np.zeros((0, 3)), 1.0) == Cell(None, None, 1.0)


def test_a_claim_of_order_does_not_hold_by_equality():
    for cell in (Cell(1.0, 0.0), Cell(1.0, 0.0, None, (1.0, 0.0))):
        assert judged("less", [Condition("ratio", cell, most=1.0)], RUNS).verdict == "reproduced"
        assert judged("less", [Condition("ratio", cell, most=1.0, strict=True)], RUNS).verdict == "not reproduced"
    assert judged("less", [Condition("ratio", Cell(0.99, 0.0), most=1.0, strict=True)], RUNS).verdict == "reproduced"
    assert "to be less than 1: fails" in text(
        Findings("", 9, 1, (), (judged("x", [Condition("ratio", Cell(1.0, 0.0), most=1.0, strict=True)], 9),))
    )


@pytest.mark.parametrize(
    ("plain", "trimmed", "expected"),
    [
        ((0.7, 0.01), (0.75, 0.01), "reproduced"),
        ((0.7, 0.01), (0.9, 0.01), "not decided"),
        ((0.9, 0.01), (0.7, 0.01), "not decided"),
        ((0.7, 0.01), (0.79, 0.01), "not decided"),
        ((0.78, 0.02), (0.75, 0.01), "not decided"),
        ((0.9, 0.01), (0.95, 0.01), "not reproduced"),
    ],
)
def test_a_trimmed_figure_must_decide_alike(plain, trimmed, expected):
    found = judged("x", [Condition("x", Cell(*plain, None, trimmed), most=0.8)], RUNS)
    assert found.verdict == expected
    if (plain[0] < 0.8) != (trimmed[0] < 0.8):
        assert found.needed is None  # more runs make neither the other


def test_a_trimmed_mean_and_its_error():
    values = np.random.default_rng(6).standard_normal(100)
    order = np.sort(values)
    held = np.clip(values, order[5], order[94])
    made = mean_cell(values, scale=10.0)
    assert made.trimmed == pytest.approx((10 * order[5:95].mean(), 10 * held.std(ddof=1) / 10 / 0.9), rel=1e-12)
    assert mean_cell(values[:19]).trimmed is None
    over, under = np.random.default_rng(7).gamma(2.0, 1.0, (2, 100, 3))
    ratio = ratio_cell(over, under)
    pull = over.mean(axis=1) / over.mean() - under.mean(axis=1) / under.mean()
    kept = np.argsort(pull)[5:95]
    assert ratio.trimmed[0] == pytest.approx(np.sqrt(over[kept].mean() / under[kept].mean()), rel=1e-12)
    assert rms_cell(over).trimmed[0] == pytest.approx(np.sqrt(np.sort(over.mean(axis=1))[5:95].mean()), rel=1e-12)


def test_on_a_heavy_tail_verdicts_by_the_mean_alone_fall_wrongly_and_those_by_both_do_not():
    """Log-normal run means, 1000 studies of 100 runs, and the true mean as the bound: neither verdict is right."""
    values = np.exp(1.5 * np.random.default_rng(8).standard_normal((1000, 100)))
    bound = math.exp(1.5**2 / 2)
    cells = [mean_cell(row) for row in values]
    alone = np.mean([verdict(Cell(cell.measured, cell.error), runs=100, most=bound) != "not decided" for cell in cells])
    wrongly = np.mean([verdict(cell, runs=100, least=bound) == "reproduced" for cell in cells])
    assert alone > 0.02  # .27 % by definition
    assert wrongly == 0


def test_how_much_less_often_has_an_error_where_no_run_differs():
    none = np.zeros(400, dtype=bool)
    same = less_often_cell(none, none, scale=100)
    assert same.measured == 0
    assert same.error > 0
    one, other = np.random.default_rng(9).random((2, 5000)) < [[0.02], [0.05]]
    apart = one.astype(float) - other
    assert less_often_cell(one, other).measured == pytest.approx(apart.mean())
    assert less_often_cell(one, other).error == pytest.approx(apart.std(ddof=1) / math.sqrt(5000), rel=0.02)


def test_over_several_places_it_holds_depends_or_is_open():
    def at(*found):
        return over("x", [Place({"q": str(i)}, each) for i, each in enumerate(found)])

    assert at("reproduced", "reproduced").verdict == "reproduced"
    assert at("reproduced", "not reproduced", "not decided").verdict == "depends"
    assert at("reproduced", "not decided").verdict == "not decided"
    assert at("not reproduced", "not reproduced").verdict == "not reproduced"
    assert at("reproduced", "not reproduced", "not decided").headline == "HOLDS IN 1 OF 3, OPEN IN 1"


def test_what_is_printed_and_written():
    claims = (
        judged("It is better", [Condition("ratio", Cell(0.7, 0.02, 0.65), most=0.8)], 50, "by much"),
        judged("It is calm", [Condition("share, %", Cell(0.5, 0.4), least=0.2, most=1.0)], 50),
        judged("It is there", [Condition("mean", Cell(None), least=1.0)], 50, unit="trajectories"),
        remark("It is good", "in whose eyes?"),
    )
    found = Findings("A paper", 50, 1, (), claims)
    assert text(found).splitlines()[4:] == [
        "* REPRODUCED: It is better",
        "  - ratio: 0.700 +- 0.020 (published 0.65), to be at most 0.8: holds",
        "  by much",
        "* NOT DECIDED with 50 runs, 810 would decide: It is calm",
        "  - share, %: 0.50 +- 0.40, to be at least 0.2 and at most 1: open",
        "* NOT DECIDED with 50 trajectories, no number of them would decide: It is there",
        "  - mean: no figure, to be at least 1: open",
        "* REMARK: It is good",
        "  in whose eyes?",
    ]
    first, second, *_ = json.loads(json.dumps(data(found), allow_nan=False))["claims"]
    assert first["conditions"] == [
        {
            "what": "ratio",
            "figure": {"measured": 0.7, "error": 0.02, "published": 0.65, "trimmed": None},
            "least": None,
            "most": 0.8,
            "strict": False,
            "holds": True,
        }
    ]
    assert second["needed"] == 810


@pytest.mark.parametrize(
    "plugin", ["vedette_vts", "vedette_target_oriented", "vedette_bayes_risk", "vedette_marine", "vedette_flir"]
)
def test_no_study_makes_a_verdict_of_its_own(plugin):
    """Claims come from `judged` and `remark` alone."""
    sources = [path.read_text() for path in (ROOT / "plugins" / plugin).rglob("*.py")]
    assert sum("judged(" in source for source in sources) >= 1
    assert not any(re.search(r"\bClaim\(", source) for source in sources)
