"""The infrared study's tables and verdicts where filters lose every run."""

import json

import numpy as np
import pytest

from vedette_flir import reproduction as study
from vedette_flir.matched_truth import Record
from vedette_flir.reproduction import FlirReproduction
from vedette_flir.robustness import Variation
from vedette_study.reproduction import data, text


def made(runs, lost):
    """A record of runs as the study makes them, all lost or none."""
    dice = np.random.default_rng(1)
    errors = [0.1 * dice.standard_normal((runs, 30, 2)) for _ in range(3)]
    squares = [dice.chisquare(4, (runs, 30)) / 4, dice.chisquare(2, (runs, 30)) / 2]
    return Record(*errors, *squares, np.full(runs, lost), np.full((30, 4), 0.1))


LOST = [{(1, 1.0)}, {(3, 1.0)}, {(3, 2.0)}, {(p, s) for p in (1, 3) for s in (1.0, 1.5, 2.0, 3.0)}]


@pytest.mark.parametrize("varied", [False, True])
@pytest.mark.parametrize("lost", LOST)
@pytest.mark.by_turns
def test_a_case_in_which_all_is_lost_has_no_figures_and_no_merit(lost, varied, monkeypatch):
    monkeypatch.setattr(study, "record", lambda passes, spread, snr, jitter, runs, rng: made(runs, (passes, spread) in lost))
    monkeypatch.setattr(Variation, "record", lambda self, name, runs, seed: made(runs, varied))
    found = FlirReproduction().run(40, 6, lambda items, about: items)
    assert "nan" not in text(found)
    assert "nan" not in json.dumps(data(found)).lower()
    for name, passes in study.PASSES.items():
        table = next(table for table in found.tables if name in table.title)
        for jitter, spread, snr in study.CASES:
            gone = (passes, spread) in lost
            row = f"jitter {jitter:g}, spread {spread:g}, SNR {snr:g}"
            assert (table.cell(row, "sum").measured is None) == gone
            assert (table.cell(row, "NEES/4").measured is None) == gone
            assert table.cell(row, "lost").measured == gone
    judged = {claim.text[:20]: claim.verdict for claim in found.claims}
    if (3, 2.0) in lost or varied:
        assert judged["An extended Kalman f"] == "not reproduced"
    if varied:
        assert "reproduced" not in judged.values()


def test_records_are_as_the_study_makes_them():
    real, stub = study.record(1, 1.0, 10.0, 0.2, 2, np.random.default_rng(1)), made(2, False)
    names = [name for name in Record.__slots__ if name != "__weakref__"]
    assert [getattr(stub, name).ndim for name in names] == [getattr(real, name).ndim for name in names]
