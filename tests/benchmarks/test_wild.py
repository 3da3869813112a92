"""Data from the wild: each kind of file is drafted and run in two commands, and its objects are followed."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from benchmarks import wild
from support.paths import recording

SEED = 21

ROWS = [{"time_utc": f"{i // 25}", "icao24": f"{i % 25:02d}", "real": f"{i % 25:02d}"} for i in range(1000)]


@pytest.mark.parametrize(
    ("way", "least", "most"),
    [(wild.exchanged, 50, 50), (wild.blanked, 25, 75), (wild.shared, 25, 75), (wild.one_of_two, 40, 40)],
)
def test_a_twentieth_of_the_codes_is_wrong(way, least, most):
    """Of 1,000: exactly, or drawn, which lies within 25 and 75 but in 3 of 10,000 draws; the true ones stay."""
    rows = way(ROWS, SEED)
    wrong = [row for row in rows if row["icao24"] != row["real"]]
    assert least <= len(wrong) <= most
    assert [row["real"] for row in rows] == [row["real"] for row in ROWS]
    if way is wild.exchanged:
        assert Counter(row["icao24"] for row in rows) == Counter(row["real"] for row in rows)


def told(kind: str, folder: Path):
    return dict(wild.KINDS[kind](folder, SEED))


@pytest.mark.nightly("all files of the benchmark: 4 minutes")
def test_each_kind_is_followed(tmp_path):
    recording("adsb", "area_20min.csv")
    figures = {kind: told(kind, tmp_path) for kind in wild.KINDS}
    assert all(row["exit"] == 0 for rows in figures.values() for row in rows.values())
    sky = figures.pop("aircraft")
    assert sky["hidden"]["switches"] <= 4
    assert sky["hidden"]["HOTA"] >= 0.93
    for row in sky.values():  # a wrong name at first begins a track a report later, and hidden errors are drawn once
        assert row["switches"] <= sky["hidden"]["switches"]
        assert row["HOTA"] >= sky["hidden"]["HOTA"] - 0.02
    for file, row in {**figures.pop("ships"), **figures.pop("noaa")}.items():
        assert row["with one track"] == row["of"] if file.endswith("aid") else row["held reports covered"] > 0.9
        chance = np.sqrt(0.9 * 0.1 / row["ships"])  # of which reports are held back; a gate that was too soft had .58
        assert row["ships covered"] > 0.9 - 2 * chance
    for rows in figures.values():
        for row in rows.values():
            assert row["tracks"] == row["objects"] or row["HOTA"] > 0.8


@pytest.mark.nightly("drafts thirteen files: a minute")
def test_two_aircraft_of_one_name_are_tracked_no_worse_than_without_names(tmp_path):
    """By two standard errors over the draws of which two."""
    recording("adsb", "area_20min.csv")
    rows = [row | {"real": row["icao24"]} for row in wild.recorded("adsb", "area_20min.csv")]
    hidden = wild.told(wild.table(tmp_path / "sky.csv", rows), "truth")["HOTA"]
    files = [wild.table(tmp_path / f"{seed}.csv", wild.one_of_two(rows, seed)) for seed in range(30, 42)]
    scores = [wild.told(path, "aid", "real")["HOTA"] for path in files]
    assert np.mean(scores) >= hidden - 2 * np.std(scores, ddof=1) / np.sqrt(len(scores))
