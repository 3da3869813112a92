"""What is stated of a table need not be guessed, and is not overruled."""

import tomllib
from pathlib import Path

import pytest

import vedette
from vedette.cli import main
from vedette.errors import ConfigError, InputError
from vedette_tools.drafting.recognising import read_table
from vedette_tools.drafting.wishes import Wishes


def wishes(**given):
    names = ("time", "rate", "columns", "units", "dates", "scan", "platform")
    return Wishes.of(*(given.get(name) for name in names))


@pytest.fixture
def table(tmp_path, monkeypatch):
    """Write a table of rows that move steadily under some titles."""
    monkeypatch.chdir(tmp_path)

    def write(titles, row, name="a.csv"):
        (tmp_path / name).write_text("\n".join([titles, *(row(k) for k in range(60))]) + "\n")
        return tmp_path / name

    return write


def source(path, **given):
    return read_table(path, "ignore", wishes(**given)).source()


def test_frames_are_a_time_at_a_stated_rate(table):
    path = table("frame,cx,cy", lambda k: f"{k},{k * 2},{k}")
    with pytest.raises(InputError, match="--rate"):
        source(path)
    found = source(path, rate="25")
    assert found["detections"]["time"] == "frame"
    assert float(found["detections"]["units"]["time"].split()[0]) == pytest.approx(0.04)
    assert source(path, rate="25", time="frame") == found


STATED_TWICE = {
    "columns=x=x,x=y": "states x more than once",
    "columns=x=x,y=x": "x and y are both 'x'",
    "units=x=m,x=ft": "states x more than once",
    "units=x=0 m": "--units: x: .* above 0, got '0 m'",
    "units=x=parsec": "--units: x: must be in m .*, got 'parsec'",
    "units=x": "pairs as x=km,y=km",
}


@pytest.mark.parametrize("given", STATED_TWICE)
def test_what_is_stated_twice_or_is_no_unit_is_told_with_the_option(given):
    name, _, value = given.partition("=")
    with pytest.raises(ConfigError, match=STATED_TWICE[given]):
        wishes(**{name: value})


def test_half_a_position_is_told_with_what_to_type(table):
    with pytest.raises(InputError, match=r"--columns range=a,bearing=COLUMN, of t, a, b"):
        source(table("t,a,b", lambda k: f"{k},{k},{k}"), columns="range=a")


def test_columns_and_units_are_as_stated(table):
    path = table("t,lat,lon,a,b,c", lambda k: f"{k},50,1,{k},{k},{k}")
    assert "latitude" in source(path)["detections"]["columns"]
    found = source(path, columns="x=a,y=b", units="x=km,y=km")["detections"]
    assert (found["columns"], found["units"]) == ({"x": "a", "y": "b"}, {"x": "km", "y": "km"})
    deep = source(path, columns="x=a,y=b,z=c")["detections"]
    assert deep["columns"] == {"x": "a", "y": "b", "z": "c"}


def test_units_are_stated_by_the_words_that_titles_state_them_by():
    assert wishes(units="x=cm,y=mm,z=km,time=ms").units == {"x": "0.01 m", "y": "0.001 m", "z": "km", "time": "ms"}


def test_pixels_are_read_as_metres_and_it_says_so(table):
    path = table("t,x,y", lambda k: f"{k},{k},{k}")
    found = read_table(path, "ignore", wishes(units="x=px,y=px"))
    assert not found.units
    assert "px" in found.assumed[0]


def test_a_scan_is_what_is_stated(table):
    path = table("t,scan,turn_no,x,y", lambda k: f"{k // 3},{k // 3},{k // 6},{k},{k}")
    assert source(path)["detections"]["scan"] == "scan"
    assert "scan" not in source(path, scan="time")["detections"]
    assert source(path, scan="turn_no")["detections"]["scan"] == "turn_no"
    assert source(path, scan="row")["detections"]["scan"] == "row"


@pytest.mark.costly
def test_dates_in_a_stated_pattern_and_a_second_file_are_run(table, capsys):
    table("when,range_m,bearing_deg", lambda k: f"23/11/2026 10:00:{k:02d},{2000 + 3 * k},{30 + 0.05 * k}")
    table("when,own_north,own_east,heading_deg", lambda k: f"23/11/2026 10:00:{k:02d},{k},{2 * k},0", "own.csv")
    assert main(["new", "config", "a.csv", "--dates", "%d/%m/%Y %H:%M:%S", "--platform", "own.csv", "--out", "a.toml"]) == 0
    drafted = tomllib.loads(Path("a.toml").read_text())["source"]
    assert drafted["platform"]["file"] == "own.csv"
    result = vedette.load("a.toml").run()
    assert result.scans[1].time - result.scans[0].time == 1.0
    assert result.scans[10].pose is not None
    assert len(result.tracks) == 1


@pytest.mark.parametrize(
    "given",
    [
        {"rate": "0"},
        {"rate": "fast"},
        {"columns": "x"},
        {"columns": "w=a"},
        {"units": "x=furlong"},
        {"dates": "%H"},
        {"units": "time=s", "rate": "3"},
    ],
)
def test_what_cannot_be_read_is_told_with_its_option(given):
    with pytest.raises(ConfigError, match="--"):
        wishes(**given)


def test_a_column_that_is_not_there_is_told_with_those_that_are(table):
    path = table("t,x,y", lambda k: f"{k},{k},{k}")
    for given in ({"columns": "x=a,y=y"}, {"time": "a"}, {"scan": "a"}):
        with pytest.raises(InputError, match="t, x, y"):
            source(path, **given)
