"""Tables as receivers, loggers and tags write them, in shapes of their own: times, positions and names are found in them."""

from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from vedette.errors import InputError
from vedette_files.tables.times import OF_DAY, stamp
from vedette_tools.drafting.dates import pattern_of
from vedette_tools.drafting.recognising import read_table
from vedette_tools.drafting.unread import readable

BEGIN = datetime(2026, 5, 26, 11, 58, tzinfo=UTC)
MOMENTS = [BEGIN + timedelta(seconds=7 * k) for k in range(60)]


def written(path, titles, row, moments=MOMENTS):
    lines = [",".join(map(str, row(k, moment))) for k, moment in enumerate(moments)]
    path.write_text("\n".join([titles, *lines]) + "\n")
    return path


def read(path):
    return readable(read_table(path))


def seconds(recording):
    times = np.array([scan.time for scan in recording.scans])
    return times - times[0]


CLOCKS = {
    "hours in a title with its zone": (
        "Year,Month,Day,Hour (UTC),Minute,Second",
        lambda at: (at.year, at.month, at.day, at.hour, at.minute, at.second),
    ),
    "hours, minutes and seconds of no date": ("hh,mm,ss", lambda at: (at.hour, at.minute, at.second)),
    "half a day, and a date beside it": ("Date,Time", lambda at: (f"{at:%m/%d/%Y}", f"{at:%I:%M:%S %p}")),
    "half a day, of no date": ("Time", lambda at: (f"{at:%I:%M:%S %p}".lstrip("0"),)),
    "a date of six digits and a time of day": ("DATE,TIME", lambda at: (f"{at:%d%m%y}", f"{at:%H%M%S}")),
    "a date of eight digits and a time of day": ("TIME,DATE", lambda at: (f"{at:%H%M%S}.5", f"{at:%Y%m%d}")),
    "a time of day before the date": ("Date", lambda at: (f"{at:%H:%M:%S %d-%b-%Y}",)),
    "dates as Java spells them": ("Time", lambda at: (f"{at:%a %b %d %H:%M:%S} GMT+02:00 {at:%Y}",)),
    "a date under a mark of comments": ("%,GPST", lambda at: (f"{at:%Y/%m/%d}", f"{at:%H:%M:%S}.000")),
    "seconds of a week": ("GPS_week,GPS_tow_s", lambda at: (2420, 216_000 + (at - BEGIN).total_seconds())),
    "a clock that was never set, and another": ("time,stamp", lambda at: ("0000-00-00 00:00:00", at.timestamp())),
    "when something began, and when it was seen": (
        "timestamp_start,detection_time",
        lambda at: (f"{at:%Y-%m-%d %H}:00:00", f"{at:%Y-%m-%d %H:%M:%S}"),
    ),
    "micro, in Greek": ("Recording timestamp [\N{GREEK SMALL LETTER MU}s]", lambda at: (int(1e6 * (at - BEGIN).seconds),)),
    "us since something began": ("timestamp", lambda at: (33_445 + int(1e6 * (at - BEGIN).seconds),)),
}


@pytest.mark.parametrize("name", CLOCKS)
@pytest.mark.by_turns
def test_times_are_found_in_any_shape(name, tmp_path):
    """Hours were passed over, noon was midnight, a clock of zeros was read and not the one beside it."""
    titles, of = CLOCKS[name]
    table, recording = read(written(tmp_path / "d.csv", f"{titles},x,y", lambda k, at: (*of(at), 5 * k, 3 * k)))
    np.testing.assert_allclose(seconds(recording), 7 * np.arange(60), atol=1e-3, err_msg=table.time.title)


def test_a_day_of_six_digits_is_told_with_how_else_it_may_be_meant():
    assert pattern_of(["260512 115800", "260512 235800"])[0] == "%y%m%d %H%M%S"
    assert pattern_of(["311225 235959", "010126 000001"])[0] == "%d%m%y %H%M%S"
    assert "%d%m%y" in pattern_of(["120526 115800", "120526 115801"])[1]
    assert pattern_of(["11:58:00 2026-05-12"])[0] == "%H:%M:%S %Y-%m-%d"


@pytest.mark.parametrize(
    ("cell", "hours"), [("9:05:06", 9), ("12:05:06 AM", 0), ("12:05:06PM", 12), ("1:05:06 pm", 13), ("23 5 6", 23)]
)
def test_times_of_day_are_read_without_zeros_before_them_and_by_halves_of_a_day(cell, hours):
    assert stamp(cell) == (OF_DAY, 3600 * hours + 306)


@pytest.mark.parametrize("cell", ["13:05:06 PM", "0:05:06 AM", "24:00:00", "8:60:00", "8 5", "8:05 61"])
def test_what_is_no_time_of_day_is_refused(cell):
    with pytest.raises(ValueError):  # noqa: PT011
        stamp(cell)


DEGREES = {
    "whole degrees and minutes": (
        "lat_deg,lat_min,lon_deg,lon_min",
        lambda n, e: (59, f"{60 * n:.6f}", -4, f"{60 * e:.6f}"),
    ),
    "and letters": ("LatD,LatM,NS,LonD,LonM,EW", lambda n, e: (59, f"{60 * n:.6f}", "N", 4, f"{60 * e:.6f}", "W")),
    "signs of degrees": ("lat,lon", lambda n, e: (f"{59 + n:.7f}°", f"{-4 - e:.7f}°")),
    "and seconds": (
        "lat deg,lat min,lat sec,lon deg,lon min,lon sec",
        lambda n, e: (59, int(60 * n), f"{3600 * n % 60:.5f}", -4, int(60 * e), f"{3600 * e % 60:.3f}"),
    ),
    "degrees and minutes as one number, and degrees": (
        "latitude,longitude,lat_dec,lon_dec",
        lambda n, e: (5900 + 60 * n, 400 + 60 * e, f"{59 + n:.7f}", f"{-4 - e:.7f}"),
    ),
}


@pytest.mark.parametrize("name", DEGREES)
def test_minutes_beside_whole_degrees_are_part_of_them(name, tmp_path):
    """A boat went by whole degrees, 100 km to the east at a time."""
    titles, of = DEGREES[name]
    path = written(tmp_path / "d.csv", f"time,{titles}", lambda k, at: (7 * k, *of(0.1 + k / 3600, 0.2)))
    table, recording = read(path)
    z = np.concatenate([scan.detections.z for scan in recording.scans])
    np.testing.assert_allclose(np.diff(z, axis=0), [[30.94, 0.0]] * 59, atol=0.1)
    assert not any("not read" in told for told in table.assumed) or "dec" in titles


@pytest.mark.parametrize(
    ("titles", "found"),
    [
        ("gps_x,gps_y,acc_x,acc_y", {"x": "gps_x", "y": "gps_y"}),
        ("acc(x),acc(y),loc(x),loc(y)", {"x": "loc(x)", "y": "loc(y)"}),
        ("px,py,qx,qy", {"x": "px", "y": "py"}),
        ("Ostwert [m],Nordwert [m],a,b", {"x": "Ostwert [m]", "y": "Nordwert [m]"}),
        ("Gaze point X [mm],Gaze point Y [mm],a,b", {"x": "Gaze point X [mm]", "y": "Gaze point Y [mm]"}),
    ],
)
def test_titles_that_are_alike_but_for_x_and_y_are_a_position(titles, found, tmp_path):
    table = read_table(written(tmp_path / "d.csv", f"time,{titles}", lambda k, at: (k, k, 2 * k, 3 * k, 4 * k)))
    assert table.measured == found
    assert table.units.get("x") == ("0.001 m" if "mm" in titles else None)


@pytest.mark.parametrize("titles", ["gyro_x,gyro_y", "hip x,hip y,knee x,knee y", "step_x,stride_y"])
def test_one_pair_alone_is_a_position(titles, tmp_path):
    """Of several each may be an object: they are named."""
    with pytest.raises(InputError) as caught:
        read_table(written(tmp_path / "d.csv", f"time,{titles}", lambda k, at: (k, *[k] * (titles.count(",") + 1))))
    assert ("hip y, and knee x" in str(caught.value)) == ("hip" in titles)


@pytest.mark.parametrize("scale", [1.0, 1e-3])
def test_positions_from_the_middle_of_the_earth_are_refused(scale, tmp_path):
    """They were tracked in the plane of the equator."""
    row = lambda k, at: (k, *(scale * each for each in (4.2e6 + 3 * k, 1.7e5 - k, 4.78e6 + k)))  # noqa: E731
    path = written(tmp_path / "d.csv", "time,ecef_x,ecef_y,ecef_z", row)
    with pytest.raises(InputError, match="middle of the earth"):
        read_table(path)


@pytest.mark.parametrize(
    ("scale", "altitude", "unit"),
    [(1e7, 488_123, "0.001 m"), (1.0, 408_000, None), (1.0, 37_000, "ft"), (1.0, 812.5, None)],
)
def test_altitudes_beside_latitudes_in_whole_numbers_are_in_mm(scale, altitude, unit, tmp_path):
    """As autopilots tell both; they passed for 494,113 ft, and those of satellites for feet, too."""
    row = lambda k, at: (k, scale * (47 + k / 2**16), scale * (8 + k / 2**16), altitude + k)  # noqa: E731
    if scale > 1:
        row = lambda k, at: (k, 473_000_000 + 50 * k, 85_000_000 + 50 * k, altitude + k)  # noqa: E731
    assert read_table(written(tmp_path / "d.csv", "time,lat,lon,alt", row)).units.get("altitude") == unit


@pytest.mark.parametrize("title", ["Track No", "D_number", "drifter_nr", "track_uuid"])
@pytest.mark.parametrize("sorted_by_it", [True, False])
def test_numbers_of_objects_are_names(title, sorted_by_it, tmp_path):
    rows = [(7 * k, 300 + i, k, 1000 * i) for k in range(30) for i in range(4)]
    rows = sorted(rows, key=lambda row: row[1]) if sorted_by_it else rows
    (tmp_path / "d.csv").write_text("\n".join([f"time,{title},x,y", *(",".join(map(str, row)) for row in rows)]))
    assert read_table(tmp_path / "d.csv").identity == title


@pytest.mark.parametrize("title", ["sat_no", "lap_number", "segment_id"])
def test_other_numbers_are_none(title, tmp_path):
    path = written(tmp_path / "d.csv", f"time,{title},x,y", lambda k, at: (7 * k, 4 + k // 9 % 3, k, k))
    assert read_table(path).identity == ""


@pytest.mark.costly
def test_a_long_table_that_is_sorted_by_objects_is_named_by_what_it_is_sorted_by(tmp_path):
    """The first 2,000 rows were of one alone: the rest passed for a clock that was set back."""
    rows = [(7 * k, f"{title} {i}", i // 2, i, k) for i, title in enumerate("ABC") for k in range(2100)]
    (tmp_path / "d.csv").write_text("time,who,crew,x,y\n" + "\n".join(",".join(map(str, row)) for row in rows))
    table, recording = read(tmp_path / "d.csv")
    assert (table.identity, table.sort, table.left_out) == ("who", True, ("crew",))
    assert len(recording.scans) == 2100
    assert recording.warnings == ()
    assert recording.refused == ()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[1685299352958]$GPGLL,5925.95,N,01028.8,E,115953.000,A,A*4B\n" * 9, "sentences of NMEA"),
        ("FLRDDE626>APRS,qAS,EGHL:/120000h5111.32N/00102.04W'086/007/A=000607 id0ADDE626 -019fpm\n" * 9, "packets of APRS"),
        (
            "Type,Local Number,Message,Field 1,Value 1,Units 1\n" + 'Data,0,record,timestamp,"1000000000",s\n' * 9,
            "--data record",
        ),
    ],
)
def test_what_is_no_table_is_called_by_its_name(text, told, tmp_path):
    (tmp_path / "d.csv").write_text(text)
    with pytest.raises(InputError, match=told):
        read_table(tmp_path / "d.csv")
