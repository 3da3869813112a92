"""Rows that cannot be read as the first ones let it seem: they are read otherwise, or told with what is wrong with them."""

import json
import re
import shlex
from pathlib import Path

import pytest

from vedette.cli import main
from vedette.errors import Problem
from vedette_tools.drafting.recognising import read_table
from vedette_tools.drafting.unread import readable, told_of
from vedette_tools.drafting.wishes import Wishes


def flights(lacks):
    """State vectors as OpenSky tells them; those that `lacks` says have no barometric height."""
    rows = [
        (10 * k, f"4067f{i}", 46 + k / 900 + i, 7 + i, 100 + k, "" if lacks(k, i) else 3000 + k, 3050 + k)
        for k in range(700)
        for i in range(4)
    ]
    titles = "time,icao24,lat,lon,velocity,baroaltitude,geoaltitude"
    return "\n".join([titles, *(",".join(map(str, row)) for row in rows)]) + "\n"


@pytest.mark.parametrize(
    ("lacks", "read"),
    [
        (lambda k, i: False, "baroaltitude"),
        (lambda k, i: i == 2 and k < 400, "geoaltitude"),
        (lambda k, i: i == 2 and k > 600, ""),
        (lambda k, i: k == 650 and i in (2, 650), "baroaltitude"),
    ],
    ids=["all have it", "one lacks it", "one lacks it later", "one row lacks it"],
)
@pytest.mark.by_turns
def test_what_has_no_height_is_tracked_by_another_one_or_in_the_plane(lacks, read, tmp_path):
    """Its rows were refused."""
    (tmp_path / "d.csv").write_text(flights(lacks))
    table, recording = readable(read_table(tmp_path / "d.csv"))
    assert table.measured.get("altitude", "") == read
    assert len(recording.refused) == (lacks(650, 650) and 1)
    assert recording.rows["detections"].total == 2800


def test_kinds_of_faults_are_counted_apart():
    """The first refused row was all that a draft told of them."""
    rows = [Problem(f"d.csv:{k}", f"x must be a number, got 'n{k}'") for k in range(4)]
    assert told_of(rows) == f", the first of them {rows[0]}"
    late = [Problem(f"d.csv:{k}", f"time {k}.5 s is out of order: it stands after 90.0 s") for k in range(90, 99)]
    others = [Problem("d.csv:7", f"y must be {kind}") for kind in ("a number, got ''", "finite", "near")]
    told = told_of([*rows, *others, *late])
    assert told.startswith(f": 9 as {late[0]}; 4 as {rows[0]}; ")
    assert told.endswith("2 for other reasons")


@pytest.mark.costly
def test_objects_that_cross_an_ocean_have_a_config_whose_command_takes_the_rest(tmp_path, monkeypatch, capsys):
    """Half of the rows were left out, and no line said so above."""
    rows = [f"{3600 * k},{name},{10 + 0.2 * k:.2f},{-30 - 0.5 * k - west:.2f}" for k in range(120) for name, west in STORMS]
    (tmp_path / "storms.csv").write_text("\n".join(["time,id,lat,lon", *rows]) + "\n")
    monkeypatch.chdir(tmp_path)
    assert main(["new", "config", "storms.csv"]) == 0
    told = capsys.readouterr().out.splitlines()
    assert re.match(r"# looks wrong: \d+ of 240 rows are left out", told[0])
    commands = [shlex.split(line.partition(": ")[2]) for line in told if "--set source.origin" in line]
    taken = 0
    for command in [["vedette", "run", "storms.toml", "--out", "storms-1"], *commands]:
        assert main(command[1:]) == 0
        _, *scans = Path(command[4], "recording.jsonl").read_text().splitlines()
        taken += sum(len(json.loads(scan)["z"]) for scan in scans)
    assert 1 < len(commands) < 5
    assert taken >= 240


STORMS = (("ANA", 0.0), ("BILL", 12.0))


@pytest.mark.parametrize("titles", ["x1,y1,x2,y2", "xmin,ymin,xmax,ymax", "bbox_left,bbox_top,bbox_right,bbox_bottom"])
@pytest.mark.by_turns
def test_two_corners_of_a_box_are_one_object_at_its_middle(titles, tmp_path):
    """They were two positions."""
    rows = [f"{k},{100 + 4 * k - 9},{70 + k - 20},{100 + 4 * k + 9},{70 + k + 20}" for k in range(60)]
    (tmp_path / "d.csv").write_text("\n".join([f"frame,{titles}", *rows]) + "\n")
    table, recording = readable(read_table(tmp_path / "d.csv", wishes=Wishes.of("", "30", "", "", "", "", "")))
    assert len(recording.scans) == 60
    assert recording.scans[10].detections.z.tolist() == [[140.0, 80.0]]
    assert any("two corners" in said for said in table.said)
