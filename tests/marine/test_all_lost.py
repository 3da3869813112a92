"""The marine study's tables and verdicts where a filter loses every run."""

import json

import numpy as np
import pytest

from vedette_marine import outcome, verdicts
from vedette_report.findings import Findings
from vedette_study.reproduction import data, text

TARGETS = ("MANV-like boat 1", "MANV-like boat 2", "DARC-like ship")


def record(lost):
    dice = np.random.default_rng(2)
    squares = [dice.chisquare(2, (60, 20)) for _ in range(3)]
    return outcome.Record(*squares, np.full(60, lost), np.full((20, 2), 0.5), np.zeros((20, 2)))


@pytest.mark.parametrize("lost", [("IMM-PDAF",), ("CV-PDAF",), ("CV-PDAF", "CT-PDAF"), outcome.FILTERS])
def test_a_filter_that_loses_everything_ends_in_words(lost):
    found = {(target, "tuned"): {name: record(name in lost) for name in outcome.FILTERS} for target in TARGETS}
    tables = (outcome.error_table("errors", "tuned", found, ""), outcome.ratio_table(found))
    figures = verdicts.figures(found, {})
    claims, seen = verdicts.claims(figures, 60), verdicts.claims(figures, 60, pictures=True)
    done = Findings("", 60, 1, tables, claims)
    assert claims[1].verdict == "remark"  # on drawn returns: it is judged on those of pictures
    for told in (text(done), json.dumps(data(done))):
        assert "nan" not in told.lower()
        assert "inf" not in told.lower()
        assert "None" not in told
    assert all(claims[i].verdict != "reproduced" for i in (0, 2, 3))
    if "IMM-PDAF" in lost:
        assert claims[0].verdict == claims[4].verdict == seen[1].verdict == "not reproduced"
    for name in outcome.FILTERS:
        gone = tables[0].cell(TARGETS[0], f"{name[:-5]} AIS").measured is None
        assert gone == (name in lost)
