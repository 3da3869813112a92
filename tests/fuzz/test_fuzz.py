"""A small budget of the fuzzers on every run; and each fuzzer finds its fault again where its cure is taken back."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
if str(ROOT) not in sys.path:
    sys.path.insert(0, str(ROOT))

pytest.importorskip("cv2")
pytest.importorskip("pyais")

from fuzz import cases, configs, inputs, kernel_calls, readers

FUZZERS = {"configs": (configs.case, 150), "inputs": (inputs.case, 250), "kernels": (kernel_calls.case, 1500)}


@pytest.mark.parametrize("name", FUZZERS)
def test_nothing_escapes(name, tmp_path):
    case, budget = FUZZERS[name]
    outcome = cases.carry_out(case, 0, range(budget), tmp_path)
    assert outcome.cases == budget
    assert not outcome.found, "\n".join(map(str, outcome.found))
    assert sum(outcome.came.values()) == budget
    assert len(outcome.came) >= 2


def test_a_case_is_the_same_whatever_ran_before_it(tmp_path):
    drawn = []

    def case(rng, folder):
        drawn.append(rng.random())
        return "drawn"

    cases.carry_out(case, 3, range(5), tmp_path)
    cases.carry_out(case, 3, range(4, 5), tmp_path)
    assert drawn[-1] == drawn[4]


def test_what_escapes_or_hangs_is_found(tmp_path, monkeypatch):
    monkeypatch.setattr(cases, "SECONDS", 0.05)

    def case(rng, folder):
        if rng.random() < 0.3:
            raise KeyError("lost")
        while rng.random() > 0.01:
            np.linalg.inv(np.eye(50))
        return "done"

    def slow(rng, folder):
        with cases.limited(0.05):
            while True:
                pass

    found = cases.carry_out(case, 0, range(40), tmp_path).found
    assert found
    assert all("KeyError at test_fuzz.py:" in fault.text for fault in found)
    assert "Hang" in cases.carry_out(slow, 0, range(1), tmp_path).found[0].text


def hunt(case, folder, budget):
    """Return the first fault of a fuzzer within a budget."""
    for seed in range(100, 103):
        outcome = cases.carry_out(case, seed, range(budget), folder, most=1)
        if outcome.found:
            return outcome.found[0].text
    return None


def only(monkeypatch, *names):
    """Draw inputs of some readers alone, which makes the hunt short."""
    monkeypatch.setattr(inputs, "READERS", {name: readers.READERS[name] for name in names})


def unchecked(value):
    """Take back the checks of JSON."""


def parse_without_limits(text):
    return json.loads(text)


def seconds_without_limits(cell):
    from vedette_marine.ais.csv import _date

    try:
        return float(cell)
    except ValueError:
        return _date(cell)


def quiet(path, line, wanted, optional=()):
    import csv

    return [title.strip() for title in next(csv.reader([line]))]


def lossy(samples, refused, *, sort=False):
    """Keep what is in order and say nothing of the rest."""
    return in_order(samples, [], sort=sort)


from vedette.io.reading import in_time_order as in_order

CURES = {
    "brackets without end": (["radar_pictures"], "vedette_marine.geometry.parse", parse_without_limits, "RecursionError"),
    "half a character": (["jsonl"], "vedette.io.json_values._check_characters", unchecked, "UnicodeEncodeError"),
    "nan as a time of AIS": (["ais_csv"], "vedette_marine.ais.csv._time", seconds_without_limits, "AssertionError"),
    "a wide cell": (["ais_csv"], "vedette_marine.ais.csv.header_of", quiet, "Error at"),
    "rows that go missing": (["csv"], "vedette.io.csv_returns.in_time_order", lossy, "AssertionError"),
    "rows of tables that go missing": (["radar_pictures"], "vedette_marine.sources.pictures.in_time_order", lossy, "AssertionError"),
}  # fmt: skip


@pytest.mark.parametrize("cure", CURES)
def test_the_fuzzer_of_inputs_bites(cure, monkeypatch, tmp_path):
    names, target, taken_back, text = CURES[cure]
    only(monkeypatch, *names)
    assert hunt(inputs.case, tmp_path, 1000) is None or pytest.fail("finds a fault that is none")
    monkeypatch.setattr(target, taken_back)
    assert text in (hunt(inputs.case, tmp_path, 1500) or "nothing found")
