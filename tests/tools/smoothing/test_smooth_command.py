"""`vedette smooth`: files in, the same columns out, whatever way they are cut into files and parts."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import vedette
from support.reports import reports_frame
from vedette.cli import main
from vedette.commands import DONE, WRONG
from vedette_files.writing import growing
from vedette_tools.smoothing import files


@pytest.fixture
def frame(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    frame, _ = reports_frame(objects=6, rows=60)
    return frame


def by_object(frame):
    return frame.sort_values(["id", "time"], kind="stable").reset_index(drop=True)


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_file_is_smoothed_as_its_data_frame_is(frame, suffix, capsys):
    frame.to_parquet("plots.parquet") if suffix == ".parquet" else frame.to_csv("plots.csv", index=False)
    assert main(["smooth", f"plots{suffix}", "--workers", "1", "--json"]) == 0
    told = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert (told["rows"], told["objects"], told["written"]) == (360, 6, 360)
    read = pd.read_parquet if suffix == ".parquet" else pd.read_csv
    found, direct = by_object(read(f"plots-smoothed{suffix}")), by_object(vedette.smooth_positions(frame))
    pd.testing.assert_frame_equal(found, direct, check_dtype=False, rtol=0, atol=2e-6)


@pytest.mark.costly
def test_an_object_across_files_is_smoothed_whole_and_parts_change_nothing(frame, monkeypatch, capsys):
    frame.to_csv("whole.csv", index=False)
    frame.iloc[:150].to_csv("a.csv", index=False)
    frame.iloc[150:].to_csv("b.csv", index=False)
    assert main(["smooth", "whole.csv", "--workers", "1"]) == 0
    monkeypatch.setattr(files, "ROWS", 50)
    assert main(["smooth", "a.csv", "b.csv", "--workers", "2", "--out", "both.csv"]) == 0
    whole, both = (by_object(pd.read_csv(name)) for name in ("whole-smoothed.csv", "both.csv"))
    pd.testing.assert_frame_equal(whole, both, rtol=0, atol=2e-6)
    assert not list(Path().glob(".*"))


def test_gross_positions_are_counted_where_others_are_asked_for(frame, capsys):
    """The cells of resampled rows mark none: that was told as 0."""
    frame.loc[[30, 90], "x"] += 3000.0
    frame.to_csv("plots.csv", index=False)
    assert main(["smooth", "plots.csv", "--every", "10 s", "--workers", "1", "--json"]) == 0
    assert json.loads(capsys.readouterr().out.splitlines()[-1])["gross"] == 2


@pytest.mark.parametrize("back", [3600.0, 0.0])
def test_a_clock_that_was_set_back_is_told(back, tmp_path, monkeypatch, capsys):
    """Of one object of two; times of the other, and those of a clock that goes on, are not."""
    monkeypatch.chdir(tmp_path)
    times = np.arange(60) * 300.0
    when = pd.to_datetime(np.concatenate([times, times - back * (times > 9000.0)]) + 1.76e9, unit="s")
    table = pd.DataFrame(
        {"id": np.repeat(["a", "b"], 60), "time": when, "x": np.tile(times, 2), "y": np.sin(np.arange(120))}
    )
    table.to_csv("plots.csv", index=False)
    assert main(["smooth", "plots.csv", "--workers", "1"]) == 0
    told = [line for line in capsys.readouterr().out.splitlines() if line.startswith("LOOKS WRONG: times of 'b'")]
    assert bool(told) == bool(back)


def test_other_cells_come_back_as_they_stand(frame, capsys):
    frame["note"] = [f"0{i}" if i % 3 else "" for i in range(len(frame))]
    frame.rename(columns={"id": "mmsi"}).to_csv("plots.csv", index=False)
    with Path("plots.csv").open("a", encoding="utf-8") as file:
        file.write("1,2\n")
    assert main(["smooth", "plots.csv", "--every", "10s", "--workers", "1"]) == 0
    assert "1 rows left out" in capsys.readouterr().out
    found = pd.read_csv("plots-smoothed.csv", dtype=str, keep_default_na=False)
    assert set(found.note) <= set(frame.note)
    assert np.all(found.time.astype(float) % 10 == 0)


def test_what_is_wrong_is_told_and_nothing_is_overwritten(frame, capsys):
    frame.to_csv("plots.csv", index=False)
    (frame[["time", "id"]]).to_csv("bare.csv", index=False)
    for words, told in ((["none.csv"], "none.csv"), (["bare.csv"], "bare.csv"), (["plots.csv", "--by", "mmsi"], "mmsi")):
        assert main(["smooth", *words, "--workers", "1"]) == 2
        assert told in capsys.readouterr().err
    assert main(["smooth", "plots.csv", "--every", "0"]) == 2
    assert main(["smooth", "plots.csv", "--out", "plots.csv"]) == 2
    assert main(["smooth", "plots.csv", "--out", "bare.csv"]) == 2
    assert sorted(path.name for path in Path().iterdir()) == ["bare.csv", "plots.csv"]


@pytest.mark.costly
def test_the_named_positions_of_a_table_are_smoothed_beside_a_radars_plots(tmp_path, capsys, monkeypatch):
    """The radar's rows have no name and no position: they are counted apart, and change nothing."""
    monkeypatch.chdir(tmp_path)
    times = np.arange(0.0, 600.0, 10.0)
    ships = [pd.DataFrame({"time": times, "mmsi": 1000 + i, "x": 5.0 * times, "y": 500.0 * i + times}) for i in range(3)]
    reports = pd.concat(ships).sort_values("time", kind="stable")
    reports["x"] += np.random.default_rng(0).normal(0, 5, len(reports))
    plots = pd.DataFrame({"time": np.arange(0.5, 600.0, 1.0), "range": 900.0, "bearing": 30.0})
    both = pd.concat([plots, reports]).sort_values("time", kind="stable")[["time", "mmsi", "x", "y", "range", "bearing"]]
    both.to_csv("both.csv", index=False)
    reports.assign(mmsi=reports.mmsi.astype(float)).to_csv("alone.csv", index=False)
    told = {}
    for name in ("both", "alone"):
        assert main(["smooth", f"{name}.csv", "--workers", "1", "--json"]) == DONE
        told[name] = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert told["both"]["elsewhere"] == told["both"]["left_out"] == len(plots)
    assert told["alone"]["elsewhere"] == told["alone"]["left_out"] == 0
    smooth, wanted = (pd.read_csv(f"{name}-smoothed.csv") for name in ("both", "alone"))
    pd.testing.assert_frame_equal(smooth[["time", "x", "y"]], wanted[["time", "x", "y"]])


@pytest.mark.costly
def test_the_first_moment_of_many_objects_may_be_all_that_is_looked_at(tmp_path, capsys, monkeypatch):
    """3,000 objects report at each of three times: what a file's head shows is one time, and no id twice."""
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(0)
    at = rng.uniform(-1e4, 1e4, (3000, 2))
    moments = [pd.DataFrame({"time": t, "id": np.arange(3000), "x": at[:, 0] + t, "y": at[:, 1]}) for t in (0.0, 10.0, 20.0)]
    pd.concat(moments).to_csv("many.csv", index=False)
    assert main(["smooth", "many.csv", "--workers", "1", "--json"]) == DONE
    told = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert told["objects"] == told["pieces"] == 3000
    assert told["written"] == 9000


def test_a_folder_of_parquet_files_holds_what_one_file_does(frame, monkeypatch):
    monkeypatch.setattr(files, "ROWS", 60)
    frame.assign(note=frame.id.where(frame.id == frame.id[0])).to_parquet("plots.parquet")
    for out in ("one.parquet", "many"):
        assert main(["smooth", "plots.parquet", "--workers", "1", "--out", out]) == DONE
    assert len(list(Path("many").iterdir())) > 1
    one, many = pd.read_parquet("one.parquet"), pd.read_parquet("many")
    pd.testing.assert_frame_equal(by_object(many), by_object(one))
    assert {path.name for path in Path().iterdir()} == {"plots.parquet", "one.parquet", "many"}
    assert main(["smooth", "plots.parquet", "--workers", "1", "--out", "many"]) != DONE
    assert main(["smooth", "plots.parquet", "--workers", "1", "--out", "many.csv"]) != DONE


@pytest.mark.costly
@pytest.mark.skipif(sys.platform == "win32", reason="no signal ends a process in order there")
@pytest.mark.parametrize("workers", ["1", "2"])
def test_one_that_is_told_to_end_leaves_nothing(workers, tmp_path):
    """SIGTERM left its hidden folder, as large as the table."""
    reports_frame(objects=60, rows=600)[0].to_csv(tmp_path / "plots.csv", index=False)
    line = [sys.executable, "-m", "vedette", "smooth", "plots.csv", "--workers", workers]
    process = subprocess.Popen(line, cwd=tmp_path, stderr=subprocess.PIPE, text=True)
    while not [*tmp_path.glob(".*")]:
        assert process.poll() is None
        time.sleep(0.01)
    process.terminate()
    _, told = process.communicate(timeout=300)
    assert (process.returncode, told) == (130, "vedette: interrupted\n")
    assert [path.name for path in tmp_path.iterdir()] == ["plots.csv"]


def test_a_second_one_that_makes_the_same_file_is_refused(frame, tmp_path, capsys):
    """Both smoothed, and the file was that of the last."""
    frame.to_csv("plots.csv", index=False)
    with growing(Path("out.csv"), "--out"):
        assert main(["smooth", "plots.csv", "--workers", "1", "--out", "out.csv"]) == WRONG
        assert str(os.getpid()) in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["plots.csv"]


@pytest.mark.costly
@pytest.mark.skipif(sys.platform == "win32", reason="no folder is kept there that a killed process locked")
def test_one_that_was_killed_leaves_what_the_next_removes(tmp_path):
    """The parts of the table, and what was written of the file: that stayed for ever."""
    reports_frame(objects=6, rows=60)[0].to_csv(tmp_path / "plots.csv", index=False)
    code = "import sys, time; from vedette_tools.smoothing import files; from vedette.cli import main; copy = files._copy\n"
    code += "files._copy = lambda *given: (copy(*given), time.sleep(600))\nsys.exit(main(sys.argv[1:]))"
    line = ["smooth", "plots.csv", "--workers", "1"]
    process = subprocess.Popen([sys.executable, "-c", code, *line], cwd=tmp_path)
    while not [*tmp_path.glob(".*/*smoothed.csv"), *tmp_path.glob(".*.part")]:
        assert process.poll() is None
        time.sleep(0.01)
    process.kill()
    process.wait()
    subprocess.run([sys.executable, "-m", "vedette", *line], cwd=tmp_path, check=True, capture_output=True)
    assert {path.name for path in tmp_path.iterdir()} == {"plots.csv", "plots-smoothed.csv"}
