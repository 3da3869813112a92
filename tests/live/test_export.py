"""`vedette export` on the database of a service: by time and by place, in every format."""

from __future__ import annotations

import csv
import json
import sqlite3
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

import vedette
from support.services import TRACKER, feed, lines, ran
from vedette.cli import main
from vedette.streams import Arrival
from vedette_files import FRAMES, NORTH_EAST

ORIGIN = {"latitude": 59.0, "longitude": 10.0}


@pytest.fixture(scope="module")
def base(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("kept") / "state.sqlite"
    conduct = {"store": {"kind": "sqlite", "path": str(path)}, "origin": ORIGIN}
    ran({**TRACKER, "inputs": [feed()], "service": conduct}, [Arrival(line, 0.0) for line in lines(60)])
    return path


def exported(base: Path, to: Path, *options: str) -> list[Mapping[str, str]]:
    assert main(["export", str(base), "--to", str(to), *options]) == 0
    with to.open() as file:
        return list(csv.DictReader(file))


def test_what_was_kept_is_what_the_library_finds(base: Path, tmp_path: Path) -> None:
    rows = exported(base, tmp_path / "tracks.csv")
    tracker = vedette.build(TRACKER)
    state, expected = tracker.start(seed=np.random.SeedSequence(0).spawn(2)[1]), {}
    for line in lines(60):
        told = json.loads(line)
        state = tracker.step(state, vedette.Scan(told["time"], told["sensor"], vedette.Detections.of(told["z"], 2)))
        estimate = tracker.estimate(state)
        for i in np.flatnonzero(state.confirmed):
            place = (*estimate.mean[i].tolist(), estimate.cov[i, 0, 0], estimate.cov[i, 0, 1])
            expected[state.time, int(state.ids[i])] = place
    names = (*tracker.state.names, "cov_x_x", f"cov_x_{tracker.state.names[1]}")
    found = {(float(row["time"]), int(row["track"])): tuple(float(row[name]) for name in names) for row in rows}
    assert found == expected
    assert {"latitude", "longitude"} <= set(rows[0])


def test_a_time_and_a_box_choose(base: Path, tmp_path: Path) -> None:
    whole = exported(base, tmp_path / "all.csv")
    part = exported(base, tmp_path / "part.csv", "--from", "30", "--until", "1970-01-01T00:01:00Z", "--box=0,2000,-900,-500")
    kept = [row for row in whole if 30 <= float(row["time"]) <= 60 and -900 <= float(row["x"]) <= 0]
    kept = [row for row in kept if -500 <= float(row["y"]) <= 2000]
    assert kept == part
    assert 0 < len(part) < len(whole)


@pytest.mark.parametrize("ending", ["kml", "geojson"])
@pytest.mark.by_turns
def test_maps_are_drawn_of_it(base: Path, tmp_path: Path, ending: str) -> None:
    to = tmp_path / f"tracks.{ending}"
    assert main(["export", str(base), "--to", str(to)]) == 0
    assert to.read_text().count("10.00") > 100


@pytest.mark.parametrize(
    "options",
    [["--from", "noon"], ["--box", "1,2,3"], ["--box", "a,b,c,d"], ["--until", "inf"], ["--smoothed"], ["--covering"]],
)
def test_what_cannot_be_chosen_is_told(
    base: Path, tmp_path: Path, options: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", str(base), "--to", str(tmp_path / "x.csv"), *options]) == 2
    assert options[0] in capsys.readouterr().err
    assert not (tmp_path / "x.csv").exists()


def test_the_database_is_not_written_over_and_another_one_is_refused(
    base: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    twin = base.with_suffix(".csv")
    twin.hardlink_to(base)
    assert main(["export", str(base), "--to", str(twin)]) == 2
    other = tmp_path / "other.sqlite"
    with closing(sqlite3.connect(other)) as direct, direct:
        direct.execute("CREATE TABLE a (b)")
    assert main(["export", str(other), "--to", str(tmp_path / "x.csv")]) == 2
    assert str(other) in capsys.readouterr().err


def test_what_was_tampered_with_is_refused(base: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for i, (column, value) in enumerate([("mean", "[1.0]"), ("cov", "{}"), ("mean", "[[["), ("cov", "[[1, null]]")]):
        path = tmp_path / f"{i}.sqlite"
        with closing(sqlite3.connect(base)) as old, closing(sqlite3.connect(path)) as new, new:
            old.backup(new)
            new.execute(f"UPDATE tracks SET {column} = ?", (value,))
        assert main(["export", str(path), "--to", str(tmp_path / "x.csv")]) == 2
        assert str(path) in capsys.readouterr().err


def test_after_a_change_of_the_motion_the_axes_in_common_are_exported_and_ids_go_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Nothing could be exported any more, and strangers had one id."""
    base, to = tmp_path / "state.sqlite", tmp_path / "tracks.csv"
    given = {**TRACKER, "inputs": [feed()], "service": {"store": {"kind": "sqlite", "path": str(base)}}}
    accelerated = {
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_acceleration", "sigma_jerk": 0.01}},
        "birth": {"kind": "from_returns", "spread": {"vx": 4.0, "vy": 4.0, "ax": 0.1, "ay": 0.1}},
    }
    ran(given, [Arrival(line, 0.0) for line in lines(40)])
    ran({**given, **accelerated}, [Arrival(line, 0.0) for line in lines(80)[40:]])
    before, rows, after = (exported(base, to, *asked) for asked in (["--until", "59"], [], ["--from", "60"]))
    assert (before, after) != ([], [])
    assert {(row["time"], row["track"], row["x"], row["vy"]) for row in rows} == {
        (row["time"], row["track"], row["x"], row["vy"]) for row in [*before, *after]
    }
    assert [("ax" in found[0]) for found in (before, rows, after)] == [False, False, True]
    assert max(int(row["track"]) for row in before) < min(int(row["track"]) for row in after)
    assert capsys.readouterr().err.count("ax [m/s^2]") == 1
    with closing(sqlite3.connect(base)) as direct, direct:  # as an older Vedette left it
        direct.execute("DELETE FROM facts WHERE name LIKE 'axes until%'")
    assert exported(base, to) == after
    assert str(len(before)) in capsys.readouterr().err


ELSEWHERE = {"origin": {"latitude": 60.0, "longitude": 10.0}, "frame": FRAMES[0]}
TURNED = {"origin": ORIGIN, "frame": NORTH_EAST}


@pytest.mark.parametrize("changed", [ELSEWHERE, TURNED, {}], ids=["origin", "frame", "none"])
def test_where_x_and_y_are_elsewhere_a_state_is_left_out_and_no_export_mixes_both(
    changed: Mapping[str, object], tmp_path: Path, caplog: pytest.LogCaptureFixture, capsys: pytest.CaptureFixture[str]
) -> None:
    """Tracks went on at places that were 111 km away, or mirrored, and all were exported by the latest origin."""
    path, to = tmp_path / "state.sqlite", tmp_path / "tracks.csv"
    store = {"kind": "sqlite", "path": str(path)}
    parts = [({"origin": ORIGIN}, lines(40)), (changed, lines(80)[40:])]
    exports = list[list[Mapping[str, str]]]()
    for more, part in parts:
        ran({**TRACKER, "inputs": [feed()], "service": {"store": store, **more}}, [Arrival(line, 0.0) for line in part])
        exports.append(exported(path, to))
    told = capsys.readouterr().err
    assert [record.message for record in caplog.records].count("the saved state does not fit, and is left out") == 1
    ids = [{int(row["track"]) for row in rows} for rows in exports]
    assert max(ids[0]) < min(ids[1])
    assert f"{len(ids[0])} tracks are of another origin or frame" in told
    until = told.partition("--until ")[2].split()[0]
    assert exported(path, to, "--until", until) == exports[0]


def test_an_origin_that_is_told_first_moves_no_tracks(tmp_path: Path) -> None:
    path, to = tmp_path / "state.sqlite", tmp_path / "tracks.csv"
    for more, part in (({}, lines(40)), ({"origin": ORIGIN}, lines(80)[40:])):
        service = {"store": {"kind": "sqlite", "path": str(path)}, **more}
        running = ran({**TRACKER, "inputs": [feed()], "service": service}, [Arrival(line, 0.0) for line in part])
    assert running.counters.counts["scans_taken_total"] == 80
    rows = exported(path, to)
    assert {row["track"] for row in rows if float(row["time"]) < 60} & {row["track"] for row in rows[-2:]}
    assert all(row["latitude"] for row in rows)
