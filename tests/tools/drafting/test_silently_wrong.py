"""Files that were drafted in silence as what they are not: a box's height as z, the seconds of a minute as the time."""

import json

import numpy as np
import pytest

from vedette.errors import InputError
from vedette_files.tables.times import ZONED, stamp
from vedette_tools.drafting.reading import opened
from vedette_tools.drafting.recognising import read_table
from vedette_tools.drafting.wishes import Wishes


def table(path, head, rows):
    path.write_text("\n".join([head, *(",".join(map(str, row)) for row in rows)]) + "\n")
    return path


@pytest.mark.parametrize(
    ("head", "z"),
    [
        ("time,id,height,width,length,x,y,z", "z"),
        ("time,id,height,w,l,x,y,z", "z"),
        ("time,id,height,width,length,x,y,other", None),
        ("time,id,height,w,l,x,y,other", "height"),
    ],
)
def test_the_height_of_a_box_is_no_z(head, z, tmp_path):
    """As in KITTI's labels: z was the box's height wherever that stood first."""
    rows = [(t, i, 1.5 + i / 10, 1.8, 4.4, i, t, 10 + t) for t in range(5) for i in range(3)]
    assert read_table(table(tmp_path / "d.csv", head, rows)).measured.get("z") == z


@pytest.mark.parametrize("head", ["time,m1 x,m1 y\ns,mm,mm", "#s,mm,mm\ntime,m1 x,m1 y", "time,x,y\ns,mm,mm"])
@pytest.mark.parametrize("stated", [False, True])
def test_a_row_of_units_counts_below_titles_and_above_them_and_for_columns_that_are_stated(head, stated, tmp_path):
    """As of Vicon, and above the titles as of Garmin's G1000: mm were m, and ft were m."""
    titles = next(line for line in head.split("\n") if line.startswith("time")).split(",")
    wishes = Wishes(columns=dict(zip("xy", titles[1:], strict=True))) if stated else Wishes()
    read = read_table(table(tmp_path / "d.csv", head, [(t / 100, 10.5 * t, 800 - t) for t in range(9)]), wishes=wishes)
    assert read.units == {"x": "0.001 m", "y": "0.001 m"}
    assert any("states units" in said for said in read.assumed)


def test_words_above_the_titles_are_no_units(tmp_path):
    """One cell alone may be as a unit is by chance, and a title may say otherwise."""
    head = "#route,m,walk\ntime,x,y"
    assert not read_table(table(tmp_path / "d.csv", head, [(t, t, t) for t in range(9)])).units


@pytest.mark.parametrize(
    ("cell", "seconds"),
    [
        ("2023-06-05 10:00:01.318353 +0000 UTC", 1.318353),
        ("2023-06-05 12:00:01 +0200 CEST", 1.0),
        ("2023-06-05 12:00:01 +02:00", 1.0),
    ],
)
def test_dates_as_go_writes_them_are_read(cell, seconds):
    assert stamp(cell) == (ZONED, pytest.approx(stamp("2023-06-05T10:00:00Z")[1] + seconds))


@pytest.mark.parametrize("title", ["time_utc", "heard"])
@pytest.mark.parametrize("seconds", [lambda k: k % 60, lambda k: 60 if k % 7 == 3 else (k * 17) % 60])
def test_the_seconds_of_a_minute_are_no_time_beside_dates(seconds, title, tmp_path):
    """AIS in JSON, as of aisstream: half an hour was a minute, and its rows were sorted by their seconds."""
    rows = [
        {
            "report": {"Timestamp": seconds(3 * k), "Latitude": 55.1 + k / 1e4, "Longitude": 10.2 + k / 1e4},
            "meta": {"MMSI": 219022220 + k % 3, title: f"2023-06-05 10:{k // 20:02d}:{3 * k % 60:02d}.318353 +0000 UTC"},
        }
        for k in range(200)
    ]
    path = tmp_path / "d.jsonl"
    path.write_text("\n".join(map(json.dumps, rows)))
    read = read_table(path)
    assert (read.time.title, read.identity) == (f"meta.{title}", "meta.MMSI")


def test_times_that_go_back_once_an_object_are_times_beside_dates(tmp_path):
    rows = [(k, i, f"2023-06-05 10:{i:02d}:00", k + i, k - i) for i in range(4) for k in range(30)]
    assert read_table(table(tmp_path / "d.csv", "t,id,last_seen,x,y", rows)).time.title == "t"


@pytest.mark.parametrize("count", ["timestep", "FrameCount"])
def test_a_time_that_stands_still_is_none_where_frames_are_counted(count, tmp_path):
    """As of Argoverse 2 and of TRACAB: the table was said to be of one moment."""
    rows = [(1700000000.5, k, f"a{i}", i + k, i - k) for k in range(30) for i in range(3)]
    path = table(tmp_path / "d.csv", f"start_timestamp,{count},track_id,x,y", rows)
    with pytest.raises(InputError, match=f"{count}.*--rate"):
        read_table(path)
    assert read_table(path, wishes=Wishes(rate=10.0)).time.title == count


def test_of_a_time_that_stands_still_a_column_that_rises_is_named(tmp_path):
    path = table(tmp_path / "d.csv", "t,trace.0,x,y", [("B738", 7 * k, k, 3 * k) for k in range(30)])
    with pytest.raises(InputError, match=r"trace\.0, which rises"):
        read_table(path)


NORTH, EAST = "x north, y east", "x east, y north"


@pytest.mark.parametrize(
    ("head", "frame", "name", "said"),
    [
        ("time,RHO_NM,THETA_deg,code", NORTH, "", True),
        ("time,rho_m,theta_deg,Mode3A", NORTH, "Mode3A", True),
        ("time,I040.RHO.val,I040.THETA.val,I220.ACAddr.val", NORTH, "I220.ACAddr.val", True),
        ("time,rho_m,theta_deg,code", EAST, "", True),
        ("time,range_m,azimuth_deg,code", NORTH, "", False),
    ],
)
def test_an_angle_whose_title_says_no_sense_is_said_to_have_one(head, frame, name, said, tmp_path):
    """Plots of a radar in NM lay mirrored, up to 112 km off; their codes were no names."""
    rows = [(4 * k, 20 + i + k / 10, 350 - 30 * i - k / 3, f"10{i}1") for k in range(20) for i in range(3)]
    read = read_table(table(tmp_path / "d.csv", head, rows))
    assert (read.frame, read.identity) == (frame, name)
    other = ({NORTH, EAST} - {frame}).pop()
    assert any(f"write frame = '{other}'" in each for each in read.assumed) == said


@pytest.mark.parametrize(("apart", "unit", "first"), [(1, "", "latitude"), (0, "", "range"), (1, "_NM", "range")])
def test_places_on_the_earth_go_before_ranges_in_a_unit_that_no_title_states(apart, unit, first, tmp_path):
    """Cells of storms: ranges in NM were taken as m, and times of 14 digits for none. A ship's own place is no return's."""
    rows = [
        (f"202306051{k // 6}{k % 6}000", f"A{i}", 20 + i + k, 30 * i + k, 35.5 + k / 100 + i * apart, -97.5)
        for k in range(12)
        for i in range(3)
    ]
    read = read_table(table(tmp_path / "d.csv", f"#ZTIME,CELL_ID,RANGE{unit},AZIMUTH,LAT,LON", rows))
    assert (next(iter(read.measured)), read.time.title, read.dates) == (first, "#ZTIME", "%Y%m%d%H%M%S")


@pytest.mark.parametrize(
    ("apart", "again", "name", "said"), [(0.0, 0, "", False), (0.0, 1, "TAG", True), (0.01, 0, "TAG", False)]
)
def test_kinds_of_the_rows_of_one_thing_are_no_names(apart, again, name, said, tmp_path):
    """T for a fix and C for a place that was marked, of a Columbus V-900: the marked ones were another object's."""
    rng = np.random.default_rng(2)
    kinds = ["C" if k % 9 == 4 else "T" for k in range(120)]
    spots = [(49 + k / 2e5 + apart * (kind == "C"), 16 - k / 3e5) for k, kind in enumerate(kinds)] + rng.normal(
        0, 3e-6, (120, 2)
    )
    times = [k - again * (kind == "C") for k, kind in enumerate(kinds)]
    rows = [
        (kind, times[k], *(f"{each:.7f}" for each in spot)) for k, (kind, spot) in enumerate(zip(kinds, spots, strict=True))
    ]
    read = read_table(table(tmp_path / "d.csv", "TAG,time,lat,lon", rows))
    assert (read.identity, any("on one path" in each for each in read.assumed)) == (name, said)


def test_angles_to_either_side_beyond_half_a_turn_are_in_deg_and_ms_are_part_of_times_of_day(tmp_path):
    """Echoes of fish in a beam of 8 deg, as Echoview exports them: -4 to 4 was in rad."""
    rows = [("2023-06-05", f"10:00:{k // 5:02d}", 200 * (k % 5), 20 + k / 9, 4.05 * (-1) ** k) for k in range(30)]
    head = "Ping_date,Ping_time,Ping_milliseconds,Target_range,Angle_minor_axis"
    read = read_table(table(tmp_path / "d.csv", head, rows))
    assert (read.time.title, read.units["bearing"]) == ("Ping_date + Ping_time + Ping_milliseconds", "deg")
    other = read_table(table(tmp_path / "d.csv", head.replace("Ping_m", "Delay_m"), rows))
    assert other.time.title == "Ping_date + Ping_time"


def test_a_column_without_a_title_is_not_taken_for_a_time_that_is_not_stated(tmp_path):
    """Of a logger by MTK, whose lines end in a comma."""
    rows = [("2026/05/12", f"12:30:{k:02d}", k, 2 * k, "") for k in range(30)]
    assert read_table(table(tmp_path / "d.csv", "DATE,TIME,x,y,", rows)).time.title == "DATE + TIME"


def test_ms_beside_a_time_of_day_alone_are_part_of_it(tmp_path):
    rows = [(f"10:00:{k // 5:02d}", 200 * (k % 5), k, 2 * k) for k in range(30)]
    times = [scan.time for scan in opened(read_table(table(tmp_path / "d.csv", "time,ms,x,y", rows))).scans]
    assert np.diff(times) == pytest.approx(0.2)


@pytest.mark.parametrize("stated", ["", "sod", "mjd + sod"])
def test_seconds_of_a_julian_day_are_seconds(stated, tmp_path):
    """Predictions for laser ranging, 300.000000 s apart: a count of ms, and `mjd + sod` was no column."""
    rows = [(60100, f"{300 * k}.000000", 7e6 + k, 3e6 - k) for k in range(30)]
    read = read_table(table(tmp_path / "d.csv", "mjd,sod,x,y", rows), wishes=Wishes(time=stated))
    assert (read.time.title, read.time_unit) == (stated or "mjd + sod", "")
    times = {scan.time for scan in opened(read).scans}
    assert max(times) - min(times) == 300 * 29
