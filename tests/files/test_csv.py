"""Recordings in CSV: what is read."""

import csv
import math

import numpy as np
import pytest
from attrs import evolve
from hypothesis import given, settings
from hypothesis import strategies as st

import vedette
from support.csv_recordings import PLANE, XY, opened, shown, told
from support.paths import recording
from vedette.types import Detections, Pose, Scan
from vedette_files import CsvSource
from vedette_files.tables.empty_scans import fill_gaps
from vedette_files.tables.platform import PlatformColumns
from vedette_files.tables.returns import DetectionColumns
from vedette_files.tables.rows import cells_of
from vedette_files.tables.truth import TruthColumns
from vedette_standard.sensors.range_bearing import RangeBearing

RNG = np.random.default_rng(0)
POLAR = {"radar": RangeBearing(sigma_range=1.0, sigma_bearing=0.01)}
NUMBERS = st.floats(-1e15, 1e15)


def test_rows_of_one_time_are_a_scan_and_a_blank_row_is_an_empty_one(tmp_path):
    recording = opened(tmp_path, "t,north,east,power\n1.5,1,2,9\n1.5,3,4,9\n1.7,,,\n\n4.25,-5e1, 6 ,9\n")
    assert shown(recording) == [(1.5, [[1, 2], [3, 4]]), (1.7, []), (4.25, [[-50, 6]])]
    assert recording.scans[1].detections.z.shape == (0, 2)
    assert recording.refused == ()


def test_each_row_is_a_scan_where_that_is_stated(tmp_path):
    (tmp_path / "d.csv").write_text("t,north,east\n1,1,1\n1,2,2\n2,,\n")
    recording = CsvSource(DetectionColumns(time="t", columns=XY, scan="row"), str(tmp_path / "d.csv")).open(PLANE, RNG)
    assert (shown(recording), recording.refused) == ([(1, [[1, 1]]), (1, [[2, 2]]), (2, [])], ())


def test_byte_order_mark_quotes_and_windows_line_ends(tmp_path):
    (tmp_path / "d.csv").write_bytes(b'\xef\xbb\xbf"t", "north", "east"\r\n1, "2", 3\r\n')
    recording = CsvSource(DetectionColumns(time="t", columns=XY), str(tmp_path / "d.csv")).open(PLANE, RNG)
    assert (shown(recording), recording.refused) == ([(1, [[2, 3]])], ())


def test_what_one_object_reports_twice_at_a_time_counts_once(tmp_path):
    (tmp_path / "d.csv").write_text("t,who,north,east\n1,a,1,1\n1,a,1,1\n1,b,1,1\n1,,2,2\n1,,2,2\n1,a,1,3\n")
    detections = DetectionColumns(time="t", columns=XY, identity="who")
    recording = CsvSource(detections, str(tmp_path / "d.csv")).open(PLANE, RNG)
    assert shown(recording) == [(1, [[1, 1], [1, 1], [2, 2], [2, 2], [1, 3]])]


def test_blanks_stand_between_columns_and_some_are_one_column(tmp_path):
    (tmp_path / "d.csv").write_text(
        "#  day       clock  north   east\n2026-05-12 08:00:01   1   59 30\n2026-05-12 08:00:02  -2.5  7\n"
    )
    detections = DetectionColumns(time="day + clock", columns=XY)
    recording = CsvSource(detections, str(tmp_path / "d.csv"), delimiter=" ").open(PLANE, RNG)
    assert shown(recording)[0][1] == [[-2.5, 7]]
    assert "must have 4 columns" in str(recording.refused[0])


@pytest.mark.parametrize("above", ["Radar log, 12 May\n\nTurn: 2.5\n", "# of 3\n3 May\n", "Operator,Smith,,\nTurn,2.5,,\n"])
def test_anything_may_stand_above_the_header(above, tmp_path):
    rows = "".join(f"{k},{2 * k},3,\n" for k in range(6))
    recording = opened(tmp_path, f"{above}t,north,east,power\ns,m,m,dB\n{rows}7,7\n")
    assert shown(recording) == [(k, [[2 * k, 3]]) for k in range(6)]
    assert [problem.place for problem in recording.refused] == [f"d.csv:{above.count(chr(10)) + n}" for n in (2, 9)]


def test_a_scan_column_groups_rows_wherever_they_stand(tmp_path):
    text = "t;n;north;east\n1;a;1;1\n1;b;2;2\n1;a;3;3\n"
    (tmp_path / "d.csv").write_text(text)
    detections = DetectionColumns(time="t", columns=XY, scan="n")
    recording = CsvSource(detections, str(tmp_path / "d.csv"), delimiter=";").open(PLANE, RNG)
    assert shown(recording) == [(1, [[1, 1], [3, 3]]), (1, [[2, 2]])]


def test_decimal_commas_are_read_and_text_keeps_its_own(tmp_path):
    text = "t;n;north;east\n08:00:00,5;1,1;1,5;-2,25\n08:00:01,5;1,2;,5;1,5e2\n08:00:02,5;1,3;1.5;x,5\n"
    (tmp_path / "d.csv").write_text(text)
    detections = DetectionColumns(time="t", columns=XY, scan="n")
    recording = CsvSource(detections, str(tmp_path / "d.csv"), delimiter=";", decimal=",").open(PLANE, RNG)
    assert shown(recording) == [(28800.5, [[1.5, -2.25]]), (28801.5, [[0.5, 150.0]])]
    assert "east must be a number, got 'x,5'" in str(recording.refused[0])


def test_a_decimal_comma_that_was_not_declared_is_refused_with_the_cure(tmp_path):
    (tmp_path / "d.csv").write_text("t;north;east\n1;1,5;2\n2;1;2\n")
    recording = CsvSource(DetectionColumns(time="t", columns=XY), str(tmp_path / "d.csv"), delimiter=";").open(PLANE, RNG)
    assert "north must be a number, got '1,5'; decimal = \",\" reads it" in str(recording.refused[0])
    (tmp_path / "d.csv").write_text('t,north,east\n"1,5","1,5","2"\n2,5,1,2\n')
    recording = CsvSource(DetectionColumns(time="t", columns=XY), str(tmp_path / "d.csv"), decimal=",").open(PLANE, RNG)
    assert shown(recording) == [(1.5, [[1.5, 2]])]
    assert "must have 3 columns as in the header, got 4" in str(recording.refused[0])


def test_sensors_of_one_file_are_told_apart_and_merged_in_time(tmp_path):
    text = "t,who,north,east,rho,brg\n2,far,,,100,350\n1,near,1,2,,\n2,near,3,4,,\n1.5,other,0,0,0,0\n"
    sensors = {"near": PLANE["radar"], "far": POLAR["radar"]}
    columns = XY | {"range": "rho", "bearing": "brg"}
    units = {"range": "km", "bearing": "deg", "time": "min"}
    recording = opened(tmp_path, text, sensors, columns=columns, units=units, sensor_column="who")
    assert [(scan.time, scan.sensor) for scan in recording.scans] == [(60, "near"), (120, "near"), (120, "far")]
    np.testing.assert_allclose(recording.scans[2].detections.z, [[100e3, math.radians(-10)]], rtol=1e-12)
    assert dict(recording.notes) == {"rows of 'other', which the tracker lacks": "1"}


@settings(max_examples=60)
@given(rows=st.lists(st.tuples(st.integers(0, 8), NUMBERS, NUMBERS), min_size=1, max_size=12))
def test_numbers_come_back_to_the_last_bit(tmp_path_factory, rows):
    rows.sort(key=lambda row: row[0])
    text = "t,north,east\n" + "".join(f"{t},{x!r},{y!r}\n" for t, x, y in rows)
    recording = opened(tmp_path_factory.mktemp("csv"), text)
    assert [scan.time for scan in recording.scans] == sorted({t for t, _, _ in rows})
    z = np.concatenate([scan.detections.z for scan in recording.scans])
    assert z.tobytes() == np.array([row[1:] for row in rows]).tobytes()


def test_truth_of_several_objects_with_units(tmp_path):
    (tmp_path / "truth.csv").write_text("s,id,n,e,hdg\n0,b,1,2,270\n1,b,3,4,90\n0,a,5,6,0\n1,a,nan,8,0\n")
    columns = {"y": "e", "x": "n", "heading": "hdg"}
    truth = TruthColumns(file="truth.csv", time="s", columns=columns, units={"heading": "deg"}, object="id")
    recording = opened(tmp_path, "t,north,east\n0,0,0\n", truth=truth)
    assert [true.name for true in recording.truth] == ["b", "a"]
    b, a = recording.truth
    assert b.space.names == ("x", "y", "heading")
    np.testing.assert_allclose(b.states, [[1, 2, -math.pi / 2], [3, 4, math.pi / 2]])
    assert a.times.tolist() == [0]
    (problem,) = told(recording)
    assert problem.startswith("truth.csv:5: n ")
    assert "'nan'" in problem


def test_platform_by_scan(tmp_path):
    (tmp_path / "own.csv").write_text("k,pn,pe,vn,ve,hdg\n7,10,20,1,2,90\n8,11,22,1,2,90\n8,0,0,0,0,0\n")
    columns = {"x": "pn", "y": "pe", "vx": "vn", "vy": "ve", "heading": "hdg"}
    platform = PlatformColumns(columns, {"heading": "deg"}, file="own.csv", scan="k")
    recording = opened(tmp_path, "t,k,north,east\n1,7,1,1\n2,8,2,2\n3,9,3,3\n", platform=platform, scan="k")
    assert [scan.time for scan in recording.scans] == [1, 2]
    pose = recording.scans[1].pose
    assert (pose.position.tolist(), pose.velocity.tolist()) == ([11, 22], [1, 2])
    assert pose.heading == pytest.approx(math.pi / 2)
    assert told(recording) == [
        "own.csv:4: the platform has another position in an earlier row of scan '8'",
        "d.csv:4: the recording does not say where the platform was at 3.0 s",
    ]


def test_platform_at_times_of_its_own_and_positions_turned_into_range_and_bearing(tmp_path):
    (tmp_path / "own.csv").write_text("s,pn,pe,hdg\n0,0,0,350\n10,100,50,10\n")
    platform = PlatformColumns({"x": "pn", "y": "pe", "heading": "hdg"}, {"heading": "deg"}, file="own.csv", time="s")
    recording = opened(tmp_path, "t,north,east\n7.5,78,41.5\n11,1,1\n", POLAR, platform=platform)
    (scan,) = recording.scans
    assert scan.pose.position.tolist() == [75, 37.5]
    assert scan.pose.heading == pytest.approx(math.radians(5))
    np.testing.assert_allclose(scan.detections.z, [[5, math.atan2(4, 3) - math.radians(5)]])
    placed = POLAR["radar"].at(scan.pose)
    np.testing.assert_allclose(placed.measure(np.array([[78.0, 41.5]])), scan.detections.z)
    (where,) = told(recording)
    assert where.startswith("d.csv:3: the recording does not say where the platform was at 11.0 s; its rows are of 0.0 to")


def test_a_config_fills_the_tables(tmp_path):
    (tmp_path / "d.csv").write_text("t,north,east\n1,2,3\n")
    config = {
        "source": {
            "kind": "csv",
            "path": str(tmp_path / "d.csv"),
            "detections": {"time": "t", "columns": XY, "units": {"x": "km"}, "periods": {"radar": "2 s"}},
            "truth": {"file": "d.csv", "time": "t", "columns": {"x": "north", "y": "east"}},
        },
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 1}},
        "sensors": {"radar": {"kind": "cartesian_position", "sigma": 1}},
        "associator": {"kind": "pda"},
        "birth": {"kind": "from_returns", "spread": {"vx": 1, "vy": 1}},
        "lifecycle": {"kind": "m_of_n"},
    }
    experiment = vedette.load(config)
    assert shown(experiment.source.open(experiment.tracker.sensors, RNG)) == [(1, [[2000, 3]])]
    assert vedette.load(vedette.to_config(experiment)).source == experiment.source


def scan_at(time, pose=None):
    return Scan(time, "radar", Detections.of([[1.0, 2.0]]), pose)


@pytest.mark.parametrize(
    ("times", "filled"),
    [
        ([0, 2, 4.1], []),
        ([0, 4, 6], [2]),
        ([0, 6.3], [2.1, 4.2]),
        ([0, 5], []),  # two and a half periods: no whole number fits
        ([0, 1], []),
        ([0, 2004], []),  # a pause, not a thousand empty scans
    ],
)
def test_gaps_of_whole_periods_hold_empty_scans(times, filled):
    scans = fill_gaps([scan_at(float(time)) for time in times], 2.0)
    assert [scan.time for scan in scans if len(scan.detections.z) == 0] == pytest.approx(filled)
    assert [scan.time for scan in scans if len(scan.detections.z)] == times
    assert all(scan.detections.z.shape[1] == 2 for scan in scans)
    assert [scan.time for scan in scans] == sorted(scan.time for scan in scans)


def test_supposed_scans_stand_between_the_poses_the_short_way_round():
    first = Pose(np.array([0.0, 0.0]), np.array([1.0, 0.0]), 3.0)
    second = Pose(np.array([8.0, 4.0]), np.array([3.0, 0.0]), -3.0)
    _, between, _ = fill_gaps([scan_at(0.0, first), scan_at(4.0, second)], 2.0)
    assert (between.pose.position.tolist(), between.pose.velocity.tolist()) == ([4, 2], [2, 0])
    assert abs(between.pose.heading) == pytest.approx(math.pi)


def test_supposed_scans_are_noted(tmp_path):
    recording = opened(tmp_path, "t,north,east\n0,1,1\n5,1,1\n", periods={"radar": 2.5})
    assert [scan.time for scan in recording.scans] == [0, 2.5, 5]
    assert dict(recording.notes) == {"scans of radar without returns supposed in gaps": "1"}


@pytest.fixture(scope="module")
def joyride():
    folder = recording("joyride")
    detections = DetectionColumns(
        time="time_unix_s", columns={"x": "north_m", "y": "east_m"}, file="joyride_measurements.csv", scan="scan"
    )
    truth = TruthColumns(
        file="joyride_truth.csv",
        time="time_unix_s",
        columns={"x": "tgt_north", "y": "tgt_east", "vx": "tgt_vnorth", "vy": "tgt_veast"},
    )
    platform = PlatformColumns({"x": "own_north", "y": "own_east"}, file="joyride_truth.csv", scan="scan")
    return lambda sensors, periods: CsvSource(
        evolve(detections, periods=periods), str(folder), truth=truth, platform=platform
    ).open(sensors, RNG)


def test_joyride_is_read_whole(joyride):
    recording = joyride(PLANE, {})
    (boat,) = recording.truth
    assert recording.refused == ()
    assert (len(recording.scans), sum(len(scan.detections.z) for scan in recording.scans)) == (238, 432)
    assert all(scan.pose is not None for scan in recording.scans)
    near = [np.hypot(*(scan.detections.z - boat.at(scan.time)[:2]).T).min() < 60 for scan in recording.scans]
    assert np.mean(near) == pytest.approx(0.81, abs=0.005)


def test_joyride_lost_seventeen_empty_scans(joyride):
    recording = joyride(PLANE, {"radar": 2.51})
    assert sum(len(scan.detections.z) == 0 for scan in recording.scans) == 17
    steps = np.diff([scan.time for scan in recording.scans])
    assert np.all(np.abs(steps - 2.51) < 0.1 * 2.51)


def test_joyride_seen_in_polar_coordinates_is_the_same(joyride):
    for flat, polar in zip(joyride(PLANE, {}).scans, joyride(POLAR, {}).scans, strict=True):
        r, b = polar.detections.z.T
        positions = polar.pose.position + np.stack([r * np.cos(b), r * np.sin(b)], axis=-1)
        np.testing.assert_allclose(positions, flat.detections.z, rtol=0, atol=1e-6)


def turns(folder, text, **columns):
    (folder / "d.csv").write_text(text)
    detections = DetectionColumns(time="t", columns=XY, **columns)
    recording = CsvSource(detections, str(folder / "d.csv")).open(PLANE, RNG)
    own = [None if scan.detections.time is None else scan.detections.time.tolist() for scan in recording.scans]
    return recording, own


ROWS = "t,n,north,east\n0.1,1,1,1\n0.9,1,2,2\n1.1,2,,\n1.3,2,3,3\n1.2,2,4,4\n2.0,3,5,5\n"


def test_returns_of_a_turn_keep_their_own_times(tmp_path):
    recording, own = turns(tmp_path, ROWS, scan="n")
    assert shown(recording) == [(0.9, [[1, 1], [2, 2]]), (1.3, [[4, 4], [3, 3]]), (2.0, [[5, 5]])]
    assert own == [[0.1, 0.9], [1.2, 1.3], [2.0]]
    assert (recording.refused, recording.rows["detections"].used) == ((), 6)


def test_turns_that_no_column_numbers_are_of_their_duration(tmp_path):
    recording, own = turns(tmp_path, ROWS.replace("1.3,2,3,3\n1.2,2,4,4", "1.2,2,4,4\n1.3,2,3,3"), turn=0.95)
    assert own == [[0.1, 0.9], [1.2, 1.3], [2.0]]
    assert [scan.time for scan in recording.scans] == [0.9, 1.3, 2.0]
    with pytest.raises(ValueError, match=r"^turn"):
        DetectionColumns(time="t", columns=XY, scan="n", turn=1.0)


def test_a_time_far_from_its_turn_is_refused_by_itself(tmp_path):
    recording, own = turns(tmp_path, ROWS.replace("0.9,1", "900,1").replace("1.2,2", "0.0,2"), scan="n")
    assert own == [[0.1], [1.3], [2.0]]
    assert [problem.place for problem in recording.refused] == ["d.csv:3", "d.csv:6"]


def test_one_wrong_time_among_scans_of_one_time_is_still_refused(tmp_path):
    text = "t,n,north,east\n1,a,1,1\n1,a,2,2\n2,b,1,1\n2,b,2,2\n3,c,1,1\n9,c,2,2\n3,c,4,4\n"
    recording, own = turns(tmp_path, text, scan="n")
    assert own == [None] * 3
    assert [problem.place for problem in recording.refused] == ["d.csv:7"]


@given(line=st.text(' ,;|\t"a1.-\u00a0\ufffd#', max_size=30), delimiter=st.sampled_from([",", ";", "\t", "|", " "]))
def test_a_line_is_read_as_the_csv_module_reads_it(line, delimiter):
    """Most lines hold no quotation mark, and are split without it."""
    try:
        expected = [
            cell.strip() for cell in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True, strict=True))
        ]
    except (csv.Error, StopIteration):
        expected = None
    assert cells_of(line, delimiter) == expected
