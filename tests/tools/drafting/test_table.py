"""What the titles and rows of a table say: axes, units, the own platform, times."""

import pytest

from vedette.errors import InputError
from vedette_files.readers import FRAMES
from vedette_tools.drafting.recognising import read_table
from vedette_tools.drafting.titles import meaning
from vedette_tools.drafting.wishes import Wishes


@pytest.mark.parametrize(
    ("title", "axis", "unit", "own"),
    [
        ("t", "time", "", False),
        ("timestamp", "time", "", False),
        ("tst", "time", "", False),  # of OwnTracks
        ("Time [ms]", "time", "ms", False),
        ("epoch_ns", "time", "ns", False),
        ("Range (NM)", "range", "NM", False),
        ("SlantRangeMetres", "range", "m", False),
        ("rng_km", "range", "km", False),
        ("brg_deg", "bearing", "deg", False),
        ("AZIMUTH", "bearing", "", False),
        ("target_lat", "latitude", "", False),
        ("Latitude_degrees", "latitude", "deg", False),
        ("LON", "longitude", "", False),
        ("ownship_lon", "longitude", "", True),
        ("OwnEast (m)", "east", "m", True),
        ("platform_x", "x", "", True),
        ("HDG [deg]", "heading", "deg", False),
        ("ship heading", "heading", "", True),
        ("doppler (m/s)", "range_rate", "m/s", False),
        ("vx", "vx", "", False),
        ("SOG_knots", "speed", "kn", False),
        ("sensor_id", "sensor", "", False),
        ("Scan No", "scan", "", False),
        ("position_lat[semicircles]", "latitude", "8.381903171539307e-8 deg", False),
        ("lat_speed", "speed", "", False),
        ("power_db", "", "", False),
        ("", "", "", False),
    ],
)
def test_a_title_says_axis_unit_and_whose_it_is(title, axis, unit, own):
    found = meaning(title)
    assert (found.axis, found.unit, found.own) == (axis, unit, own)


def table(folder, text, name="d.csv"):
    (folder / name).write_text(text)
    return read_table(folder / name)


@pytest.mark.parametrize(
    ("titles", "stated", "time"),
    [
        ("sec,nanosec", "", "sec + nanosec"),
        ("time_s,time_ns", "", "time_s + time_ns"),
        ("header.stamp.sec,header.stamp.nanosec", "header.stamp.sec", "header.stamp.sec + header.stamp.nanosec"),
        ("stamp.secs,stamp.nsecs", "", "stamp.secs + stamp.nsecs"),
    ],
)
@pytest.mark.parametrize("turned", [False, True])
def test_parts_of_a_second_belong_to_its_time(titles, stated, time, turned, tmp_path):
    """Cut to whole seconds, ten scans were taken as one."""
    names, cells = titles.split(","), [("1700000000", "5000000"), ("1700000001", "999999999")]
    names, cells = (names[::-1], [pair[::-1] for pair in cells]) if turned else (names, cells)
    rows = [",".join([*names, "pose.x", "pose.y"]), *(",".join([*pair, "1", "2"]) for pair in cells)]
    (tmp_path / "d.csv").write_text("\n".join(rows) + "\n")
    assert read_table(tmp_path / "d.csv", wishes=Wishes(time=stated)).time.title == time


def test_nanoseconds_since_1970_are_no_part_of_a_second(tmp_path):
    assert table(tmp_path, "time,ns,x,y\n1700000000,1700000000005000000,1,2\n").time.title == "time"


def test_a_polar_table_of_a_ship(tmp_path):
    found = table(tmp_path, "utc,rng_km,brg,own_lat,own_lon,hdg,snr\n2026-01-01T00:00:00Z,1,350,59,10,271,9\n")
    assert found.measured == {"range": "rng_km", "bearing": "brg"}
    assert found.platform == {"latitude": "own_lat", "longitude": "own_lon", "heading": "hdg"}
    assert found.units == {"range": "km", "bearing": "deg", "own heading": "deg"}
    assert (found.time_unit, found.frame, found.left_out) == ("", FRAMES[1], ("snr",))
    assert found.said == ("brg is in deg: it goes up to 350", "hdg is in deg: it goes up to 271")


def test_positions_of_ships_are_what_is_measured_if_nothing_else_is(tmp_path):
    found = table(tmp_path, "time,ship_lat,ship_lon,speed\n0,59,10,3\n")
    assert found.measured == {"latitude": "ship_lat", "longitude": "ship_lon"}
    assert found.platform == {}


@pytest.mark.parametrize(
    ("title", "height", "unit"), [("geoaltitude", 47_000, "ft"), ("alt", 12_000, None), ("alt_m", 47_000, None)]
)
def test_heights_that_hardly_anything_reaches_in_metres_are_in_feet(tmp_path, title, height, unit):
    rows = "".join(f"{k},59.{k},10,{height + k}\n" for k in range(9))
    found = table(tmp_path, f"time,lat,lon,{title}\n{rows}")
    assert found.measured["altitude"] == title
    assert found.units.get("altitude") == unit


@pytest.mark.parametrize(
    ("first", "second", "unit"),
    [
        ("0", "2.5", ""),
        ("0", "1", ""),
        ("0", "2500", "ms"),
        ("0", "3600", ""),
        ("1700000000", "1700000001", ""),
        ("1700000000", "1700000300", ""),
        ("1700000000000", "1700000000500", "ms"),
        ("1700000000000000", "1700000000500000", "us"),
        ("1700000000000000000", "1700000000500000000", "ns"),
        ("46082.5", "46082.50002", "86400 s"),
        ("61100.5", "61100.50002", "86400 s"),
        ("740042.5", "740042.50002", "86400 s"),
        ("2461101.0", "2461101.00002", "86400 s"),
        ("740042.5", "740043.5", ""),
        ("08:00:00", "08:00:01", ""),
    ],
)
def test_the_unit_of_times_by_their_size(tmp_path, first, second, unit):
    assert table(tmp_path, f"t;x;y\n{first};1;2\n{second};1;2\n").time_unit == unit


def test_minutes_and_seconds_are_told_from_hours_and_minutes(tmp_path):
    """They are the same to the eye: 59:58 is an error, 09:54 was ten hours of a run of ten minutes, in silence."""
    (said, *_) = table(tmp_path, "time,x,y\n09:52,1,2\n09:54,1,2\n").said
    assert said == "times are hours and minutes; write minutes and seconds as 00:59:59"
    assert not any("minutes" in each for each in table(tmp_path, "time,x,y\n00:09:52,1,2\n00:09:54,1,2\n").said)


def test_several_sensors_are_told_apart(tmp_path):
    found = table(tmp_path, "t,sensor,east,north\n0,a,1,2\n0,b,1,2\n1,a,1,2\n")
    assert found.sensors == ("a", "b")
    assert found.source()["detections"]["sensor_column"] == "sensor"
    assert found.measured == {"x": "east", "y": "north"}
    assert table(tmp_path, "t,sensor,east,north\n0,a,1,2\n1,a,1,2\n").sensors == ("sensor",)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("a,x,y\n0,1,2\n", "no column looks like a time among a, x, y; name it `time` or `t`"),
        ("t,bearing\n0,1\n", "no columns look like range and bearing, latitude and longitude, or x and y among t, bearing"),
        ("0,1,2\n1,2,3\n", "d.csv:1: must be a header line"),
        ("", "d.csv: is empty"),
    ],
)
def test_what_cannot_be_understood_is_said(tmp_path, text, told):
    with pytest.raises(InputError, match=told.replace("(", r"\(")):
        table(tmp_path, text)


def test_a_column_of_very_many_names_names_no_sensors(tmp_path):
    rows = "".join(f"{i},s{i},1,2\n" for i in range(25))
    found = table(tmp_path, f"t,sensor,east,north\n{rows}")
    assert found.sensors == ("sensor",)
    assert "sensor" in found.left_out
    assert "sensor has more than 20 names, so all returns are of one sensor" in found.assumed


def test_decimal_commas_are_told_from_points(tmp_path):
    (tmp_path / "commas.csv").write_text("UTC;Range [NM];Bearing (deg)\n08:00:00,500;3,8730;33,86\n08:00:03,400;3;34\n")
    (tmp_path / "points.csv").write_text("UTC;Range [NM];Bearing (deg)\n08:00:00.500;3.8730;33.86\n08:00:03.400;3;34\n")
    commas, points = (read_table(tmp_path / f"{name}.csv") for name in ("commas", "points"))
    assert commas.source()["decimal"] == ","
    assert "decimal" not in points.source()
    assert commas.units == points.units == {"range": "NM", "bearing": "deg"}


@pytest.mark.parametrize(("x", "unit", "told"), [("56863.7", "1e-9 m", "nanometres: it goes"), ("12.5", "NM", "nautical")])
def test_nm_that_reach_beyond_the_earth_are_nanometres(tmp_path, x, unit, told):
    """Spots of a microscope were read in nautical miles, and nothing said so."""
    found = table(tmp_path, "t,x (nm),y (nm)\n" + "".join(f"{i},{x},{x}\n" for i in range(9)))
    assert found.units == {"x": unit, "y": unit}
    assert told in found.guessed["x (nm)"]
