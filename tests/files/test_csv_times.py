"""Times of a CSV file: numbers, dates and times with and without zone, times of day."""

from datetime import UTC, datetime, timedelta, timezone

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from support.csv_recordings import XY, opened, told
from vedette_files.tables.platform import PlatformColumns
from vedette_files.tables.times import DATED, OF_DAY, Form, form_of, stamp

MOMENTS = st.datetimes(datetime(1900, 1, 1), datetime(2200, 1, 1))
ZONES = st.integers(-14 * 60, 14 * 60).map(lambda minutes: timezone(timedelta(minutes=minutes)))


def times(recording):
    return [scan.time for scan in recording.scans]


def rows(*stamps):
    return "t,north,east\n" + "".join(f"{each},1,2\n" for each in stamps)


@settings(max_examples=50, deadline=None)
@given(moment=MOMENTS, zone=ZONES)
def test_a_stamp_is_the_same_moment_in_every_zone(moment, zone):
    there = moment.replace(tzinfo=UTC)
    name, seconds = stamp(there.astimezone(zone).isoformat())
    assert name == "a date and time with a zone"
    assert seconds == pytest.approx(there.timestamp(), abs=1e-6)
    assert stamp(moment.isoformat(sep=" "))[1] == seconds


def test_dates_and_times_are_seconds_of_1970_in_utc_and_the_notes_say_so(tmp_path):
    recording = opened(tmp_path, rows("2026-11-22T10:00:00.25+02:00", "2026-11-22T08:00:01Z"))
    start = datetime(2026, 11, 22, 8, tzinfo=UTC).timestamp()
    assert times(recording) == [start + 0.25, start + 1]
    assert dict(recording.notes) == {"time": DATED}


def test_stamps_without_a_zone_are_taken_as_utc_and_that_is_said(tmp_path):
    recording = opened(tmp_path, rows("2026-11-22 08:00", "2026-11-22 08:01"))
    assert np.diff(times(recording)).tolist() == [60]
    assert recording.notes["time zone"] == "the times state none: taken as UTC"


@pytest.mark.parametrize(
    ("cell", "hours"), [("12:30:00 AM", 0.5), ("12:30 pm", 12.5), ("1:30 AM", 1.5), ("11:30:00 PM", 23.5), ("0 30 0", 0.5)]
)
def test_a_times_half_of_the_day_is_read(cell, hours):
    assert stamp(cell) == (OF_DAY, 3600.0 * hours)


def test_the_first_time_of_a_table_is_the_first_in_the_form_of_most():
    """Times of day lie near it: near a date that stands before them they would be days of this century."""
    cells = ["", "2026-11-22T00:00:00Z", "08:39:04", "08:40:00"]
    assert form_of(cells) == Form(OF_DAY, 8 * 3600 + 39 * 60 + 4.0)


def test_times_of_day_go_on_past_midnight(tmp_path):
    recording = opened(tmp_path, rows("23:59:58.5", "23:59:59", "00:00:01", "11:00:00", "22:00", "01:00"))
    day = 86_400
    assert times(recording) == [day - 1.5, day - 1, day + 1, day + 11 * 3600, day + 22 * 3600, 2 * day + 3600]


@pytest.mark.parametrize(
    ("cells", "taken"),
    [
        ((86390.5, 86399.9, 0.1, 12.0), [86390.5, 86399.9, 86400.1, 86412.0]),
        ((80000.0, 86399.9, 40000.0), [80000.0, 86399.9]),
        ((172798.0, 172799.0, 0.0), [172798.0, 172799.0]),
    ],
    ids=["of a day", "not near midnight", "longer than a day"],
)
def test_seconds_of_a_day_go_on_past_midnight(cells, taken, tmp_path):
    """As ASTERIX has them: what came after midnight was sorted before all else, and each target became two."""
    assert times(opened(tmp_path, rows(*cells))) == taken


def test_the_platforms_times_of_day_are_of_the_detections_day(tmp_path):
    (tmp_path / "own.csv").write_text("clock,x,y\n23:59:00,0,0\n00:01:00,120,0\n")
    platform = PlatformColumns(file="own.csv", time="clock", columns={"x": "x", "y": "y"})
    recording = opened(tmp_path, rows("00:00:00", "00:00:30"), platform=platform)
    assert [scan.pose.position.tolist() for scan in recording.scans] == [[60, 0], [90, 0]]


def test_a_row_in_another_form_than_most_is_refused(tmp_path):
    text = rows("08:00:00", "2026-11-22T08:00:00Z", "2026-11-22T08:00:01Z", "5", "2026-11-22T08:00:02", "noon")
    recording = opened(tmp_path, text)
    assert len(recording.scans) == 2
    wanted = "t must be a date and time with a zone as 2026-11-22T08:39:04.5Z, like most, got"
    assert told(recording) == [
        f"d.csv:2: {wanted} '08:00:00'",
        f"d.csv:5: {wanted} '5'",
        f"d.csv:6: {wanted} '2026-11-22T08:00:02'",
        f"d.csv:7: {wanted} 'noon'",
    ]
    assert (recording.rows["detections"].used, recording.rows["detections"].refused) == (2, 4)


@pytest.mark.parametrize(("unit", "factor"), [("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9), ("0.5 ms", 5e-4)])
def test_the_epoch_in_other_units(tmp_path, unit, factor):
    recording = opened(tmp_path, rows(1_700_000_000_000, 1_700_000_000_500), units={"time": unit})
    np.testing.assert_allclose(times(recording), np.array([1_700_000_000_000, 1_700_000_000_500]) * factor, rtol=1e-15)


def test_a_multiple_of_a_unit_may_be_a_columns_unit(tmp_path):
    recording = opened(tmp_path, "t,north,east\n1,25,2\n", columns=XY, units={"x": "0.1 m", "y": "10 km"})
    assert recording.scans[0].detections.z.tolist() == [[2.5, 20_000]]
