"""Odd files through `vedette new config`, `run` and `smooth`: what cannot be read is told with its file, line and column."""

import json
import re

import numpy as np
import pandas as pd
import pytest

import vedette
from vedette.cli import main
from vedette.commands import DONE

ROWS = [(2.0 * k, 3000.25 + 8.5 * k, 1000.5 - 3.25 * k) for k in range(30)]


def table(head="time,x,y", row=lambda k, *cells: ",".join(map(str, cells))):
    return "\n".join([head, *(row(k, *cells) for k, cells in enumerate(ROWS))]) + "\n"


def changed(text, line, new):
    """A table with another line, counted from 1 as in the file."""
    lines = text.splitlines()
    lines[line - 1] = new
    return "\n".join(lines) + "\n"


PLAIN = table()
DATES = table(row=lambda k, t, x, y: f"24.11.2026 10:{k:02d}:00,{x},{y}")
COMMAS = table(row=lambda k, *cells: ",".join(map(str, cells)).replace(".", ","))
BEYOND = table("time,lat,lon", lambda k, *_: f"{k},120.{k:03d},45.{k:03d}")
LATIN = changed(table("time,x,y,n", lambda k, t, x, y: f"{t},{x},{y},"), 9, "14,1,2,\u00e9").encode("latin-1")
TOLD = {
    "NaN in all": (table(row=lambda k, t, x, y: f"{t},NaN,NaN"), r"d\.csv:2: x "),
    "decimal commas between commas": (COMMAS, r"d\.csv:2: .*3 .*6"),
    "text": (table(row=lambda k, t, x, y: f"{t},north,{y}"), r"d\.csv:2: x .*'north'"),
    "latitude beyond the pole": (BEYOND, r"d\.csv:2: lat .*-90 to 90"),
    "digits in groups": (table(row=lambda k, t, x, y: f'{t},"3,000.25",{y}'), r"d\.csv:2: x .* 3000\.25"),
    "units in cells": (table(row=lambda k, t, x, y: f"{t},{x} m,{y}"), r"d\.csv:2: x .* 3000\.25.*`units`"),
    "no header": (PLAIN.split("\n", 1)[1], r"d\.csv:1: .*header"),
    "no time": (table("a,x,y"), r"d\.csv: .*--time"),
    "no position": (table("time,x,b"), r"d\.csv: .*--columns"),
    "empty": ("", r"d\.csv: is empty"),
    "a header alone": ("time,x,y\n", r"d\.csv: has a header and no rows"),
    "two of a title": (table("time,x,x,y", lambda k, t, x, y: f"{t},{x},{x},{y}"), r"d\.csv.* 'x'.*rename"),
    "UTF-16 without a mark": (PLAIN.encode("utf-16-le"), r"d\.csv.*UTF-16"),
    "an archive": (b"PK\x03\x04" + bytes(range(256)), r"d\.csv: .*ZIP"),
}  # fmt: skip


def written(text):
    return text if isinstance(text, bytes) else text.encode()


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("command", [["new", "config"], ["smooth", "--workers", "1"]], ids=["new", "smooth"])
@pytest.mark.parametrize("what", TOLD)
def test_a_file_that_cannot_be_read_is_refused_with_place_and_cure(what, command, folder, capsys):
    text, told = TOLD[what]
    (folder / "d.csv").write_bytes(written(text))
    assert main([*command, "d.csv"]) not in (DONE, 3)
    said = capsys.readouterr().err
    assert re.search(told, said), said
    assert [path.name for path in folder.iterdir()] == ["d.csv"]


READ = {
    "mark": PLAIN.encode("utf-8-sig"),
    "UTF-16": PLAIN.encode("utf-16"),
    "tabs": written(PLAIN.replace(",", "\t")),
    "semicolons and decimal commas": written(PLAIN.replace(",", ";").replace(".", ",")),
    "mixed ends": written(PLAIN.replace("\n", "\r\n", 10).replace("\n", "\r", 1)),
    "units below the header": written(PLAIN.replace("time,x,y\n", "time,x,y\ns,m,m\n")),
    "a row of very many cells": written(changed(PLAIN, 9, "9," * 100_000)),
    "a short row": written(changed(PLAIN, 9, "14.0,3068.25")),
}


@pytest.mark.parametrize("what", READ)
@pytest.mark.by_turns
def test_what_can_be_read_is_smoothed_as_the_plain_table(what, folder, capsys):
    (folder / "d.csv").write_bytes(READ[what])
    assert main(["smooth", "d.csv", "--workers", "1", "--json"]) == DONE
    out = capsys.readouterr().out
    told = json.loads(out.splitlines()[-1])
    bad = {"units below the header": 2, "a row of very many cells": 9, "a short row": 9}.get(what)
    assert told["written"] == len(ROWS) - (1 if what.startswith("a ") else 0)
    assert told["left_out"] == (1 if bad else 0)
    assert (f"d.csv:{bad}: " in out) == bool(bad)


def test_a_mark_that_is_not_closed_and_other_bytes_are_told_by_line(folder, capsys):
    """Otherwise all rows below would be a part of the cell, and lost in silence."""
    (folder / "q.csv").write_text(changed(PLAIN, 9, '14.0,"3068,1'))
    (folder / "l.csv").write_bytes(LATIN)
    for name in ("q", "l"):
        assert main(["smooth", f"{name}.csv", "--workers", "1"]) != DONE
        assert f"{name}.csv:9: " in capsys.readouterr().err


@pytest.mark.costly
def test_dates_by_a_pattern_are_read_and_written(folder):
    (folder / "d.csv").write_text(DATES)
    stated = ["--dates", "%d.%m.%Y %H:%M:%S"]
    assert main(["smooth", "d.csv", "--workers", "1", *stated, "--every", "30 s", "--out", "s.csv"]) == DONE
    rows = (folder / "s.csv").read_text().splitlines()
    assert len(rows) == 1 + 2 * (len(ROWS) - 1) + 1
    assert rows[2].startswith('"24.11.2026 10:00:30"')
    assert main(["new", "config", "d.csv", *stated, "--out", "c.toml"]) == DONE
    assert len(vedette.load("c.toml").run().tracks) == 1
    assert main(["smooth", "d.csv", "--workers", "1", "--every", "30 s", "--out", "found.csv"]) == DONE
    assert (folder / "found.csv").read_text() == (folder / "s.csv").read_text()


CONFIG = {
    "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
    "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0}},
    "associator": {"kind": "gnn"},
    "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
    "lifecycle": {"kind": "m_of_n"},
}


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (PLAIN.replace(",", ";"), r"d\.csv:1: .*'time;x;y'.*';'.*source\.delimiter"),
        (PLAIN.split("\n", 1)[1], r"d\.csv:1: .*'time'.*numbers"),
        (table("time,x,x,y", lambda k, t, x, y: f"{t},{x},{x},{y}"), r"d\.csv:1: .*'x'.*rename"),
        (PLAIN.encode("utf-16-le"), r"d\.csv:1: .*UTF-8"),
        (DATES, r"d\.csv:2: time .*dates = '%d\.%m\.%Y %H:%M:%S'"),
    ],
    ids=["delimiter", "no header", "twice", "utf-16", "dates"],
)
def test_a_run_of_it_is_told_what_to_write_instead(text, told, folder):
    (folder / "d.csv").write_bytes(written(text))
    detections = {"time": "time", "columns": {"x": "x", "y": "y"}}
    experiment = vedette.load(CONFIG | {"source": {"kind": "csv", "path": "d.csv", "detections": detections}})
    with pytest.raises(vedette.VedetteError, match=told):
        experiment.run()


def test_columns_and_counts_that_are_stated_are_smoothed_by(folder, capsys):
    """What a refusal says to type can be typed."""
    (folder / "d.csv").write_text(table("count,east_of,up", lambda k, _, x, y: f"{5 * k},{x},{y}"))
    assert main(["smooth", "d.csv", "--workers", "1"]) != DONE
    assert "--time" in capsys.readouterr().err
    assert main(["smooth", "d.csv", "--workers", "1", "--time", "count", "--rate", "2.5"]) != DONE
    assert "--columns" in capsys.readouterr().err
    stated = ["--time", "count", "--rate", "2.5", "--columns", "x=east_of,y=up", "--units", "x=km,y=km"]
    assert main(["smooth", "d.csv", "--workers", "1", *stated, "--out", "s.csv"]) == DONE
    (folder / "p.csv").write_text(table(row=lambda _, t, x, y: f"{t},{1000 * x},{1000 * y}"))
    assert main(["smooth", "p.csv", "--workers", "1", "--out", "t.csv"]) == DONE
    columns = ("east_of", "up", "speed_mps"), ("x", "y", "speed_mps")
    found, plain = (pd.read_csv(name)[list(titles)] for name, titles in zip(("s.csv", "t.csv"), columns, strict=True))
    np.testing.assert_allclose(found * [1000.0, 1000.0, 1.0], plain, rtol=1e-4)


@pytest.mark.parametrize(
    "command", [["consistency"], ["tune", "--free", "sensors.radar.sigma", "--starts", "1", "--out", "o"]]
)
@pytest.mark.by_turns
def test_what_is_left_out_of_a_recording_is_told_with_its_place(command, folder, capsys):
    """It was so by `run` alone."""
    (folder / "d.csv").write_text(changed(PLAIN, 9, "14.0,north,977.75"))
    detections = {"time": "time", "columns": {"x": "x", "y": "y"}}
    config = CONFIG | {"source": {"kind": "csv", "path": "d.csv", "detections": detections}}
    (folder / "c.json").write_text(json.dumps(config))
    assert main([command[0], "c.json", *command[1:]]) == DONE
    assert "1 part of the input left out, the first: d.csv:9: x must be a number, got 'north'" in capsys.readouterr().out
    (folder / "d.csv").write_text("\n".join([PLAIN.splitlines()[0], *PLAIN.splitlines()[:0:-1]]) + "\n")
    assert main([command[0], "c.json", *command[1:]]) != DONE
    assert "state `sort = true`" in capsys.readouterr().err
