"""A study that is extended keeps the chunks that it has, though the usual size of a chunk goes by the number of runs."""

import json

import numpy as np

import vedette
from support.paths import EXAMPLES
from vedette.config.files import read_file


def test_more_runs_without_a_word_on_chunks(tmp_path):
    experiment = read_file(EXAMPLES / "study.toml")["experiment"] | {"seed": 1}
    first = vedette.monte_carlo(experiment, 30, 3, out=tmp_path)
    (kept,) = (tmp_path / "chunks").glob("*-0000000.npz")
    written = kept.stat().st_mtime_ns
    longer = vedette.monte_carlo(experiment, 50, 3, out=tmp_path, resume=True)
    assert json.loads((tmp_path / "manifest.json").read_text())["chunk"] == 30
    assert kept.stat().st_mtime_ns == written
    assert longer.runs == 50
    for name, values in first.figures.items():
        np.testing.assert_array_equal(longer.figures[name][:, :30], values)
