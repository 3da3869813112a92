"""A small budget of the fuzzers on every run; and each fuzzer finds its fault again where its cure is taken back."""

import csv
import json
import math
import time

import pytest
from attrs import evolve

pytest.importorskip("cv2")
pytest.importorskip("pyais")
pytest.importorskip("pyarrow")
pytest.importorskip("pandas")

from fuzz import (
    cases,
    configs,
    faulty,
    folders,
    guided,
    inputs,
    kernel_calls,
    plugins,
    readers,
    results,
    tables,
)
from fuzz.__main__ import case_of
from vedette import kernels
from vedette.config import plugins as loading
from vedette.config.contract import check_version, described
from vedette.kernels import reference
from vedette.tracking.history import History
from vedette.units import in_unit
from vedette_files.readers import in_time_order

FUZZERS = {
    "configs": 150,
    "inputs": 250,
    "kernels": 1500,
    "plugins": 100,
    "methods": 60,
    "tables": 12,
    "results": 400,
    "live": 100,
    "adapters": 100,
    "commands": 12,
    "folders": 8,
}


@pytest.mark.costly
@pytest.mark.parametrize(("name", "budget"), FUZZERS.items())
def test_nothing_escapes(name, budget, tmp_path):
    outcome = cases.carry_out(case_of(name), 0, range(budget), tmp_path)
    assert outcome.cases == budget
    assert not outcome.found, "\n".join(map(str, outcome.found))
    assert sum(outcome.came.values()) == budget
    if budget >= 50:  # of a dozen cases all may well end alike
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
    def case(rng, folder):
        if rng.random() < 0.3:
            raise KeyError("lost")
        return "done"

    def slow(rng, folder):
        while True:
            pass

    found = cases.carry_out(case, 0, range(40), tmp_path).found
    assert found
    assert all("KeyError at test_fuzz.py:" in fault.text for fault in found)
    monkeypatch.setattr(cases, "SECONDS", 0.1)
    assert "Hang" in cases.carry_out(slow, 0, range(1), tmp_path).found[0].text


def test_a_busy_machine_makes_no_hang(tmp_path, monkeypatch):
    """A case that waits for longer than its limit of CPU time is not stopped; nor does one limit outlast its case."""
    monkeypatch.setattr(cases, "SECONDS", 0.1)
    monkeypatch.setattr(cases, "ASLEEP", 1000.0)
    assert not cases.carry_out(lambda rng, folder: str(time.sleep(0.3)), 0, range(2), tmp_path).found


@pytest.mark.costly
def test_a_case_that_gets_little_of_the_processor_does_not_hang(tmp_path, monkeypatch):
    """A case that had 2 % of a busy machine for a minute was once told to hang."""
    monkeypatch.setattr(cases, "SECONDS", 0.5)
    monkeypatch.setattr(cases, "ASLEEP", 2.0)

    def starved(rng, folder):
        for _ in range(3):
            end = time.process_time() + 0.02
            while time.process_time() < end:
                pass
            time.sleep(0.4)
        return "done"

    assert not cases.carry_out(starved, 0, range(1), tmp_path).found


def hunt(case, folder, budget):
    """Return the first fault of a fuzzer within a budget."""
    for seed in range(100, 103):
        outcome = cases.carry_out(case, seed, range(budget), folder, most=1)
        if outcome.found:
            return outcome.found[0].text
    return None


def parse_without_limits(text):
    """Parse JSON as it comes: deep brackets end in a RecursionError."""
    return json.loads(text)


def seconds_without_limits(cell):
    """Read nan and inf as times."""
    return float(cell) if cell else math.nan


def header_of_any_width(path, line, wanted, optional=()):
    """Split a header as Python's csv module does, which raises csv.Error for a wide cell."""
    return [title.strip() for title in next(csv.reader([line]))]


def lossy(samples, refused, *, sort=False):
    """Keep what is in order and say nothing of the rest."""
    return in_time_order(samples, [], sort=sort)


def tracks_of_some(self):
    """End with the traceback that a run without any track once had."""
    if self._rows and not len(self._column("ids")):
        list(zip((), (0,), strict=True))
    return TRACKS(self)


def unit_unchecked(value, unit, largest=math.inf):
    """Look a unit up without asking whether it is one."""
    return {unit: 1.0}[value.split()[-1]] if isinstance(value, str) else in_unit(value, unit, largest)


TRACKS = History.tracks
INPUTS = {
    "brackets without end": ("radar_pictures", "vedette_marine.geometry.parse", parse_without_limits, "RecursionError"),
    "nan as a time of AIS": ("ais_csv", "vedette_marine.ais.csv._time", seconds_without_limits, "AssertionError"),
    "a wide cell": ("ais_csv", "vedette_marine.ais.csv.header_of", header_of_any_width, "Error at"),
    "rows that go missing": ("csv", "vedette_files.tables.looks.in_time_order", lossy, "does not add up|and the file has"),
    "pictures that go missing": (
        "radar_pictures",
        "vedette_marine.sources.pictures.in_time_order",
        lossy,
        "and the file has",
    ),
    "a quiet sea": ("run", "vedette.tracking.history.History.tracks", tracks_of_some, "zip() argument 2 is longer"),
}


@pytest.mark.costly
def test_the_fuzzer_of_tables_bites(monkeypatch, tmp_path):
    """Rows by date that go missing are found."""
    monkeypatch.setattr(tables, "READERS", {"dates": tables.READERS["dates"]})
    monkeypatch.setattr("vedette_files.tables.looks.in_time_order", lossy)
    found = hunt(tables.case, tmp_path, 300) or "nothing found"
    assert "does not add up" in found or "and the file has" in found, found


@pytest.mark.parametrize("cure", INPUTS)
@pytest.mark.by_turns
def test_the_fuzzer_of_inputs_bites(cure, monkeypatch, tmp_path):
    """With a cure taken back it finds the fault again; of one reader alone, which makes the hunt short."""
    name, target, taken_back, text = INPUTS[cure]
    monkeypatch.setattr(inputs, "READERS", {name: readers.READERS[name]})
    monkeypatch.setattr(target, taken_back)
    found = hunt(inputs.case, tmp_path, 1000) or "nothing found"
    assert any(part in found for part in text.split("|")), found


def test_the_fuzzer_of_results_bites(monkeypatch, tmp_path):
    """Without what archives raise that are not whole, it is found."""
    monkeypatch.setattr("vedette_files.archives._WRONG", (OSError,))
    assert " at archives.py:" in (found := hunt(results.case, tmp_path, 300) or "nothing found") or "BadZipFile" in found


@pytest.mark.nightly("draws folders until one has the fault: 15 s")
def test_the_fuzzer_of_folders_bites(monkeypatch, tmp_path):
    """What a page is made of once ended in a traceback where it was no JSON."""
    monkeypatch.setattr("vedette_report.page.frames.parse", lambda text: json.loads(text + "}"))
    monkeypatch.setattr("vedette_report.page.frames.VedetteError", KeyError)
    monkeypatch.setattr("vedette_report.page.run.read_table", lambda path: json.loads(path.read_text()))
    assert "Error at" in (hunt(folders.case, tmp_path, 60) or "nothing found")


@pytest.mark.costly
def test_the_fuzzer_of_live_calls_bites(monkeypatch, tmp_path):
    from fuzz import live  # ASTERIX takes seconds to import

    monkeypatch.setattr("vedette_live.formats.json_lines._message", lambda line: json.loads(line)["z"])
    assert "KeyError at" in (hunt(live.case, tmp_path, 300) or "nothing found")


def test_the_fuzzer_of_configs_bites(monkeypatch, tmp_path):
    monkeypatch.setattr("vedette.fields.in_unit", unit_unchecked)
    assert "Error at test_fuzz.py" in (hunt(configs.case, tmp_path, 500) or "nothing found")


def trusting(point, name, version):
    """Load a plugin and let what goes wrong through, as it once stopped everybody."""
    module = point.load()
    check_version(module)
    hooks = loading._hooks(module)
    return loading.Loaded(
        name, point.name, tuple(described(each, name, version) for each in loading._components(hooks)), hooks
    )


def test_the_fuzzer_of_plugins_bites(monkeypatch, tmp_path):
    monkeypatch.setattr(loading, "_load", trusting)
    found = hunt(plugins.case, tmp_path, 50) or "nothing found"
    assert "one plugin stops all" in found or "Error at" in found


def test_the_fuzzer_of_methods_bites(monkeypatch, tmp_path):
    """Without the diagnosis what fails in kernels and numpy escapes; and one that blames another is found, too."""
    with monkeypatch.context() as patch:
        patch.setattr("vedette.tracking.tracker.explain", lambda *given: None)
        patch.setattr("vedette.experiment.explain_run", lambda *given: None)
        assert "Error at" in (hunt(faulty.case, tmp_path, 40) or "nothing found")
    monkeypatch.setattr("vedette.tracking.faults.broken", lambda *given: None)
    assert "Error at" in (hunt(faulty.case, tmp_path, 40) or "nothing found")


def rude(scores):
    """Write into what was given."""
    scores -= 1.0
    return kernels.reference.safe_log(scores)


@pytest.mark.parametrize(
    ("name", "wrong", "text"),
    [
        ("softmax", rude, "wrote into what it was given"),
        ("whiten", lambda v, P: 1.00001 * reference.whiten(v, P), "Not equal to tolerance"),
        ("predict", lambda x, P, F, Q: evolve(reference.predict(x, P, F, Q), mean=x[:1]), "Error at"),
        ("imm_mix", lambda *given: time.sleep(9), "Hang at"),
        ("update", lambda *given: {}["gone"], "KeyError at"),
    ],
)
def test_the_fuzzer_of_kernels_bites(name, wrong, text, monkeypatch, tmp_path):
    monkeypatch.setattr(kernels, name, wrong)
    if text == "Hang at":  # the others keep the time that a busy machine needs
        monkeypatch.setattr(cases, "SECONDS", 0.2)
        monkeypatch.setattr(cases, "ASLEEP", 2.0)
    assert text in (hunt(kernel_calls.case, tmp_path, 1000) or "nothing found")


@pytest.mark.nightly("a minute")
def test_guided_by_coverage_a_planted_fault_is_found_and_no_other(tmp_path):
    pytest.importorskip("atheris")
    cases_of_planted, reached, wrong = guided.fuzz("planted", 200, 0, tmp_path)  # it ends once it is found
    assert (cases_of_planted > 100, reached > 3, "KeyError" in wrong) == (True, True, True)
    kept = list(tmp_path.glob("planted-crash-*"))
    assert [path.read_bytes()[:5] for path in kept] == [b"!!int"]
    for name in ("config.yaml", "tracks.jsonl", "stream.nmea"):
        count, reached, wrong = guided.fuzz(name, 5, 0, tmp_path)
        assert (count > 500, reached > 20, wrong) == (True, True, ""), name
