"""The page of a long run shows one scan in so many, read block by block."""

import json

import numpy as np
import pytest

from support.results import config
from vedette.cli import main
from vedette_files import read_series
from vedette_report.page import thinned
from vedette_report.series import recorder as series


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """A run in small blocks."""
    folder = tmp_path_factory.mktemp("run")
    (folder / "config.json").write_text(json.dumps(config()))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(series, "SCANS", 5)
        patch.setattr("vedette_files.series._BLOCK", 1)
        assert main(["run", str(folder / "config.json"), "--out", str(folder / "out"), "--stream"]) == 0
    return folder / "out" / "series.npz"


def test_a_short_run_is_shown_whole(path):
    whole, (found, every) = read_series(path), thinned.read_thinned(path)
    assert every == 1
    for table, columns in whole.tables.items():
        for name, values in columns.items():
            np.testing.assert_array_equal(found[table][name], values)


@pytest.mark.parametrize("limits", [{"scans": 15}, {"returns": 22}, {"entries": 30}, {"weights": 10}])
def test_of_a_long_one_each_kept_scan_is_as_it_was(path, limits, monkeypatch):
    whole = read_series(path)
    monkeypatch.setattr(thinned, "MOST", limits)
    found, every = thinned.read_thinned(path)
    ((table, most),) = limits.items()
    assert every == -(-len(next(iter(whole[table].values()))) // most) > 1
    for name, values in whole["scans"].items():
        np.testing.assert_array_equal(found["scans"][name], values[::every])
    kept = {}
    for table in ("returns", "entries", "splits", "merges", "truth"):
        scan = whole[table]["scan"]
        kept[table] = np.flatnonzero(scan % every == 0)
        np.testing.assert_array_equal(found[table]["scan"] * every, scan[kept[table]])
        for name in whole[table].keys() - {"scan"}:
            np.testing.assert_array_equal(found[table][name], whole[table][name][kept[table]])
    entry = whole["weights"]["entry"]
    own = np.isin(entry, kept["entries"])
    np.testing.assert_array_equal(kept["entries"][found["weights"]["entry"]], entry[own])
    np.testing.assert_array_equal(found["weights"]["weight"], whole["weights"]["weight"][own])


def test_the_page_says_so(path, monkeypatch):
    monkeypatch.setattr(thinned, "MOST", {"scans": 15})
    assert main(["report", str(path.parent)]) == 0
    assert "one scan in 3" in (path.parent / "report.html").read_text(encoding="utf-8")
