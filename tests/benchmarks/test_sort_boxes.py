"""On the drawn example Vedette's draft is better than SORT as published, also on the second half."""

from importlib import import_module
from pathlib import Path

import pytest

import vedette
from vedette_boxes import judge_files, results, write_rows

ROOT = Path(__file__).parents[2]


# What `vedette tune` found on the first half of the frames, without truth: docs/boxes.md has the command.


@pytest.mark.costly
def test_the_config_is_better_than_sort(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT))
    monkeypatch.chdir(ROOT)
    compared = import_module("benchmarks.sort_boxes")
    write_rows(tmp_path / "sort.txt", compared.sort(compared.BOXES / "det.txt"))
    experiment = vedette.load("examples/boxes.toml")
    results(tmp_path, experiment, experiment.run())
    for first in compared.FROM.values():
        ours, theirs = (judge_files(compared.BOXES / "gt.txt", tmp_path / name, first) for name in ("mot.txt", "sort.txt"))
        assert ours["hota"] > theirs["hota"] + 0.1
        assert ours["idf1"] > theirs["idf1"]
        assert ours["mota"] > theirs["mota"]
