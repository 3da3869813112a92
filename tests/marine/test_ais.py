"""AIS: what reports mean, readers and what they refuse, places between reports, and recorded AIS where it is there."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from support.paths import recording
from vedette import InputError, Rows
from vedette_marine.ais.csv import read_csv
from vedette_marine.ais.nmea import checked, read_nmea
from vedette_marine.ais.reports import KNOT, Reports, east_north, outliers, turn_rate, velocity, without_outliers
from vedette_marine.ais.tracks import between, motion, trajectories

ORIGIN = (54.0, 12.0)
HEADER = "Time,MMSI,Latitude_degrees,Longitude_degrees,COG_degrees,SOG_knots"


def reports(time, east, north, speed, course, mmsi=1):
    """Reports at places in m around the origin; the oracle's own degrees."""
    from pymap3d import enu2geodetic

    latitude, longitude, _ = enu2geodetic(np.asarray(east, float), np.asarray(north, float), 0.0, *ORIGIN, 0.0)
    nothing = np.full(len(time), np.nan)
    columns = (np.asarray(time, float), latitude, longitude, np.asarray(speed, float), np.asarray(course, float))
    return Reports(mmsi, *columns, nothing, nothing)


# What is reported.


@pytest.mark.parametrize(("course", "east", "north"), [(0, 0, 1), (90, 1, 0), (180, 0, -1), (270, -1, 0)])
def test_course_runs_clockwise_from_north(course, east, north):
    np.testing.assert_allclose(velocity(np.array(5.0), np.deg2rad(course)), [5 * east, 5 * north], atol=1e-12)


@given(st.floats(0, 360), st.floats(0.1, 30))
@settings(max_examples=50)
def test_the_printed_convention_mirrors_the_velocity(course, speed):
    """(v cos COG, v sin COG) is the mirror image about the north-east line: off by v sqrt 2 |sin COG - cos COG|."""
    angle = math.radians(course)
    ours = velocity(np.array(speed), np.array(angle))
    printed = speed * np.array([math.cos(angle), math.sin(angle)])
    np.testing.assert_allclose(printed, ours[::-1], atol=1e-12)
    off = speed * math.sqrt(2) * abs(math.sin(angle) - math.cos(angle))
    assert np.linalg.norm(printed - ours) == pytest.approx(off, abs=1e-9)


def test_velocity_is_the_way_that_a_ship_goes():
    """Positions on the globe, 10 s apart, by their own geodesy."""
    ship = reports([0, 10], [0, 10 * 6 * math.sin(1.1)], [0, 10 * 6 * math.cos(1.1)], [6, 6], [1.1, 1.1])
    place = east_north(ship.latitude, ship.longitude, ORIGIN)
    np.testing.assert_allclose((place[1] - place[0]) / 10, ship.velocity[0], atol=1e-6)


def test_rate_of_turn_is_to_starboard_and_by_the_square():
    sent = np.array([-128, -127, 127, 0, 47.33, -47.33])
    expected = [np.nan, np.nan, np.nan, 0, -math.radians(100) / 60, math.radians(100) / 60]
    np.testing.assert_allclose(turn_rate(sent), expected)


def test_a_ship_at_rest_needs_no_course():
    assert velocity(np.array([0.0, 3.0]), np.array([np.nan, np.nan])).tolist()[0] == [0, 0]
    assert np.isnan(velocity(np.array(3.0), np.array(np.nan))).all()


# Between reports.


def turning(step):
    rate, speed = math.radians(1.5), 8.0
    time = np.arange(0, 61, step)
    course = 0.4 + rate * time
    radius = speed / rate
    return reports(time, -radius * np.cos(course), radius * np.sin(course), np.full(len(time), speed), course), radius


@pytest.mark.parametrize("step", [2.0, 6.0, 10.0])
def test_the_stated_error_holds_on_a_turn(step):
    """On an arc the line's error is a T^2 / 8 in the middle to within its own second order, and nowhere more than stated."""
    ship, radius = turning(step)
    times = np.linspace(0, 60, 241)
    course = 0.4 + math.radians(1.5) * times
    true = np.stack([-radius * np.cos(course), radius * np.sin(course)], axis=-1)
    seen = between(ship, ORIGIN, times)
    off = np.linalg.norm(seen.place - true, axis=-1)
    assert (off <= seen.error * 1.02 + 0.01).all()
    middle = np.argmax(off)
    accel = 8.0 * math.radians(1.5)
    assert off[middle] == pytest.approx(accel * step**2 / 8, rel=0.05)
    assert seen.error[middle] == pytest.approx(off[middle], rel=0.05)


def test_nothing_is_said_in_gaps_and_outside():
    ship = reports([0, 10, 200, 210], [0, 50, 900, 950], [0, 0, 0, 0], [5, 5, 5, 5], [math.pi / 2] * 4)
    seen = between(ship, ORIGIN, np.array([-1.0, 5.0, 100.0, 205.0, 211.0]), longest=60.0)
    assert np.isfinite(seen.place[:, 0]).tolist() == [False, True, False, True, False]
    np.testing.assert_allclose(seen.place[[1, 3]], [[25, 0], [925, 0]], atol=1e-3)
    np.testing.assert_allclose(seen.velocity[1], [5, 0], atol=1e-9)
    assert [path.name for path in trajectories(ship, ORIGIN, 60.0)] == ["MMSI 1 (1)", "MMSI 1 (2)"]
    assert np.isnan(between(ship.where(np.array([True, False, False, False])), ORIGIN, np.array([0.0])).place).all()


def test_a_vessel_that_sent_nothing_has_no_track():
    nothing = reports([], [], [], [], [])
    assert trajectories(nothing, ORIGIN) == ()
    assert np.isnan(between(nothing, ORIGIN, np.array([1.0])).error).all()


def test_a_vessel_without_course_keeps_its_track():
    ship = reports([0, 10, 20], [0, 40, 80], [0, 0, 0], [np.nan] * 3, [np.nan] * 3)
    np.testing.assert_allclose(motion(ship, ORIGIN)[2], [[4, 0]] * 3, atol=1e-3)
    (path,) = trajectories(ship, ORIGIN)
    np.testing.assert_allclose(path.at(15.0), [60, 0, 4, 0], atol=1e-3)


@given(st.integers(0, 19), st.floats(800, 1e5), st.floats(0, 2 * math.pi))
@settings(max_examples=60)
def test_one_far_place_is_found_by_itself_wherever_it_stands(k, far, bearing):
    time = 10.0 * np.arange(20)
    place = np.stack([5.0 * time, -3.0 * time], axis=-1)
    place[k] += far * np.array([math.sin(bearing), math.cos(bearing)])
    assert np.flatnonzero(outliers(place, time)).tolist() == [k]
    assert not outliers(place[:0], time[:0]).any()


# CSV.


def table(tmp_path, *rows, header=HEADER):
    path = tmp_path / "ais.csv"
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


def test_rows_become_reports_by_ship(tmp_path):
    ships, refused = read_csv(
        table(
            tmp_path,
            "2016-01-12 13:02:21.5,2,50.1,-1.1,90,10,91,12",
            "2016-01-12 13:02:11.5,2,50.1,-1.2,360,102.3,511,-128",
            "7.5,1,50.1,-1.2,,,,",
            header=HEADER + ",Heading_degrees,ROT",
        )
    )
    assert not refused
    two = ships[2]
    assert np.diff(two.time).tolist() == [10.0]
    assert np.isnan([two.speed[0], two.course[0], two.heading[0], two.turn[0]]).all()
    assert two.speed[1] == pytest.approx(10 * 1852 / 3600)
    assert two.turn[1] == pytest.approx(-math.radians((12 / 4.733) ** 2) / 60)
    assert np.isnan([ships[1].course[0], ships[1].speed[0]]).all()
    assert ships[1].time.tolist() == [7.5]


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("1,2,91,0,0,0", "Latitude_degrees must be from -90 to 90, got '91'"),
        ("1,2,50,181,0,0", "Longitude_degrees must be from -180 to 180"),
        ("soon,2,50,0,0,0", "Time must be in s or a date and time"),
        ("1,ship,50,0,0,0", "MMSI must be a number, got 'ship'"),
        ("1,2.5,50,0,0,0", "MMSI must be a whole number"),
        ("1,2,50,0,400,0", "COG_degrees must be from 0 to 360"),
        ("1,2,50,0,0,-1", "SOG_knots must be from 0 to 102.3"),
        ("1,2,nan,0,0,0", "Latitude_degrees must be"),
        ("1,2,50,0,0", "must have 6 columns as in the header, got 5"),
    ],
)
def test_a_bad_row_is_told_and_costs_nothing_else(tmp_path, row, message):
    ships, refused = read_csv(table(tmp_path, "1,2,50,0,0,0", row, "3,2,50,0,0,0"))
    assert ships[2].time.tolist() == [1, 3]
    assert refused[0].place == "ais.csv:3"
    assert message in refused[0].text


def test_a_file_that_is_no_ais_is_told(tmp_path):
    with pytest.raises(InputError, match=r"ais.csv:1: must have the columns Time, MMSI, "):
        read_csv(table(tmp_path, header="Time,MMSI,Latitude_degrees,Longitude_degrees"))
    with pytest.raises(InputError, match="cannot be read"):
        read_csv(tmp_path / "none.csv")


# NMEA.

TURNING = "!AIVDM,1,1,,A,33P;Tw0tjBQO22:E7dm66DrB20UP,0*2E"
"""Type 3, MMSI 235070716: 36.910433 N 20.760008 E, 14.6 knots, course 156.1, heading 157, turn -8 deg/min."""

PARTS = (
    "!AIVDO,2,1,4,A,53P;Tw0000000000001HD@EA@D0000000000000000000000004i@@000000,0*7D",
    "!AIVDO,2,2,4,A,00000000000,2*22",
)
"""Type 5, in two sentences: the same ship's name and where it is bound."""


def sentences(tmp_path, *lines):
    path = tmp_path / "ais.txt"
    path.write_text("\n".join(lines) + "\n")
    return path


def test_a_sentence_becomes_a_report(tmp_path):
    ships, refused, rows = read_nmea(sentences(tmp_path, f"12.5 {TURNING}"))
    assert not refused
    assert rows == Rows(1, 1, 0)
    ship = ships[235070716]
    assert ship.time.tolist() == [12.5]
    assert (ship.latitude[0], ship.longitude[0]) == pytest.approx((36.910433, 20.760008), abs=1e-6)
    assert ship.speed[0] == pytest.approx(14.6 * KNOT)
    assert np.degrees([ship.course[0], ship.heading[0]]) == pytest.approx([156.1, 157])
    assert np.degrees(ship.turn[0]) * 60 == pytest.approx((13 / 4.733) ** 2)  # to port, so counter-clockwise


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (TURNING.replace("*2E", "*2F"), "wrong checksum: the sentence says '2F', its characters give 2E"),
        (TURNING.replace("E7", "E8"), "wrong checksum"),
        (TURNING.replace("*2E", "*ZZ"), "wrong checksum"),
        (TURNING[:30], "ends without a checksum: it is cut off"),
        ("!AIVDM,1,1,,B,,0*25", "is empty: it holds no message"),
        ("$GPGGA,1,2*33", "is no AIS sentence"),
        ("noon " + TURNING, "must begin with a time in s"),
        ("!AIVDM,2,2,5,A,88888888880,2*21", "is part 2 of 2 without those before it"),
        ("!AIVDM,2,1,4,A,55O0W7`00001L@gCWGA2uItLth@DqtL5@F22220j1h742t0Ht0000000,0*08", "the first part of a message"),
    ],
)
def test_a_bad_sentence_is_told_and_costs_nothing_else(tmp_path, line, message):
    ships, refused, rows = read_nmea(sentences(tmp_path, TURNING, line, TURNING), interval=1.0)
    assert ships[235070716].time.tolist() == [0, 2]
    assert len(refused) == 1
    assert message in refused[0].text
    assert refused[0].place == "ais.txt:2"
    assert rows == Rows(3, 2, 1)


def test_every_sentence_of_a_message_in_parts_is_accounted_for(tmp_path):
    """A ship's name and particulars, whole and without its end; 3 sentences of 2 messages that report no position."""
    first, second = PARTS
    lines = (TURNING, first, second, first, TURNING)
    _, refused, rows = read_nmea(sentences(tmp_path, "# a comment", *lines), interval=1.0)
    assert [problem.place for problem in refused] == ["ais.txt:5"]
    assert rows == Rows(5, 2, 1, 2)


def test_no_single_wrong_character_passes(tmp_path):
    for i in range(1, len(TURNING) - 3):
        wrong = TURNING[:i] + chr(ord(TURNING[i]) ^ 1) + TURNING[i + 1 :]
        with pytest.raises(ValueError, match=r"checksum|no AIS sentence"):
            checked(wrong)


# Recorded AIS.


@pytest.mark.costly
def test_the_solent_s_outlier_is_found_and_nothing_is_lost():
    ships, refused = read_csv(recording("solent_ais", "SolentAIS_20160112_130211.csv"))
    assert not refused
    assert len(ships) == 91
    assert sum(len(ship.time) for ship in ships.values()) == 18_623
    kept, told = zip(*(without_outliers(ship, (50.78, -1.2), "solent") for ship in ships.values()), strict=True)
    assert 1 <= sum(map(len, told)) <= 12
    for ship in kept:
        place = east_north(ship.latitude, ship.longitude, (50.78, -1.2))
        pace = np.linalg.norm(np.diff(place, axis=0), axis=1) / np.maximum(np.diff(ship.time), 1.0)
        assert (pace < 90).all()


def test_recorded_sentences_are_all_accounted_for():
    path = recording("ais_nmea", "nmea_data_sample.txt")
    ships, refused, rows = read_nmea(path, interval=1.0)
    text = path.read_text().splitlines()
    assert sum(len(ship.time) for ship in ships.values()) > 0.5 * len(text)
    empty = [problem for problem in refused if "holds no message" in problem.text]
    assert len(empty) == sum(line.split(",")[5] == "" for line in text)
    assert rows.total == len(text) == rows.used + rows.refused + rows.left_out
    assert rows.used == sum(len(ship.time) for ship in ships.values())
    told = {problem.place for problem in refused}
    assert len(told) == len(refused)
    assert all(place.startswith("nmea_data_sample.txt:") for place in told)


@pytest.mark.parametrize("place", [(-59.0, -170.0), (45.0, 10.0), (59.0, -170.0)])
def test_a_place_that_no_plane_reaches_is_refused(place):
    """The far side of the earth once folded over: 59 S 170 W was 38 km from 59 N 10 E."""
    latitude = np.array([59.0, place[0], 59.0005])
    longitude = np.array([10.0, place[1], 10.0])
    known = np.zeros(3)
    ship = Reports(257000000, 10.0 * np.arange(3), latitude, longitude, known, known, known, known)
    kept, (told,) = without_outliers(ship, (59.0, 10.0), "x.csv")
    assert kept.time.tolist() == [0.0, 20.0]
    assert "time 10" in told.place
    assert "too far" in told.text
