"""The infrared study's tables and verdicts where filters lose every run."""

import json

import numpy as np
import pytest
from attrs import evolve

from vedette.report.reproduction import data, text
from vedette_flir import reproduction as study
from vedette_flir.matched import Record
from vedette_flir.reproduction import FlirReproduction

CASES = ((0.2, 1.0, 10.0), (0.2, 2.0, 10.0), (0.5, 2.0, 20.0))


def records(lost):
    """Records of two runs, as a study makes them: for every case, those of `lost` (passes, spread) lost."""
    dice = np.random.default_rng(1)

    def record(passes, spread, snr, jitter, runs, rng):
        errors = [dice.standard_normal((runs, 30, 2)) for _ in range(3)]
        squares = [dice.chisquare(2, (runs, 30)) / 2 for _ in range(2)]
        return Record(*errors, *squares, np.full(runs, (passes, spread) in lost))

    return record


@pytest.mark.parametrize("lost", [{(1, 1.0)}, {(3, 1.0)}, {(3, 2.0)}, {(p, s) for p in (1, 3) for s in (1.0, 2.0)}])
def test_a_case_in_which_all_is_lost_has_no_figures_and_no_merit(lost, monkeypatch):
    monkeypatch.setattr(study, "CASES", CASES)
    monkeypatch.setattr(study, "record", records(lost))
    found = FlirReproduction().run(2, 6, lambda items, about: items)
    assert "nan" not in text(found)
    assert "nan" not in json.dumps(data(found)).lower()
    for name, passes in study.PASSES.items():
        table = next(table for table in found.tables if name in table.title)
        for jitter, spread, snr in CASES:
            gone = (passes, spread) in lost
            row = f"jitter {jitter:g}, spread {spread:g}, SNR {snr:g}"
            assert (table.cell(row, "sum").measured is None) == gone
            assert (table.cell(row, "NEES/4").measured is None) == gone
            assert table.cell(row, "lost").measured == gone
    if (3, 2.0) in lost:
        assert found.claims[0].verdict == "not reproduced"
    if (1, 1.0) in lost:
        assert "lost" in found.claims[1].why


def test_records_are_as_the_study_makes_them():
    made = records(set())(1, 1.0, 10.0, 0.2, 2, None)
    real = study.record(1, 1.0, 10.0, 0.2, 2, np.random.default_rng(1))
    assert [getattr(made, name).ndim for name in Record.__slots__ if name != "__weakref__"] == [
        getattr(real, name).ndim for name in Record.__slots__ if name != "__weakref__"
    ]
    assert evolve(real).lost.shape == made.lost.shape
