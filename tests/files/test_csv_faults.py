"""Recordings in CSV: what each fault costs."""

from itertools import combinations, pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from support.csv_recordings import PLANE, XY, opened, shown, told
from vedette.errors import LATE, ConfigError, InputError
from vedette_files import CsvSource
from vedette_files.readers import Sample, in_time_order
from vedette_files.tables.platform import PlatformColumns
from vedette_files.tables.returns import DetectionColumns
from vedette_files.tables.truth import TruthColumns
from vedette_standard.sensors.range_bearing import RangeBearing

RNG = np.random.default_rng(0)
POLAR = {"radar": RangeBearing(sigma_range=1.0, sigma_bearing=0.01)}


def test_a_time_far_ahead_costs_one_row_not_the_rest(tmp_path):
    text = "t,north,east\n1,1,1\n9e9,2,2\n2,3,3\n1.5,4,4\n2,5,5\n3,6,6\n"
    recording = opened(tmp_path, text)
    assert shown(recording) == [(1, [[1, 1]]), (2, [[3, 3], [5, 5]]), (3, [[6, 6]])]
    assert told(recording) == [
        "d.csv:3: time 9000000000.0 s is out of order: it stands after 1.0 s and before 2.0 s",
        "d.csv:5: time 1.5 s is out of order: it stands after 2.0 s and before 2.0 s",
    ]
    assert all(problem.kind == LATE for problem in recording.refused)


@pytest.mark.parametrize(("marks", "said"), [((), 0), ((5,), 0), ((5, 8), 1), (tuple(range(1, 20, 2)), 1)])
def test_a_mark_of_what_is_missing_is_told(tmp_path, marks, said):
    """One value far away is no mark."""
    text = "t,north,east\n" + "".join(f"{i},{-9999 if i in marks else 40 * i},{i}\n" for i in range(20))
    recording = opened(tmp_path, text)
    assert sum("north is -9999 m in" in each or "x is -9999 m in" in each for each in recording.warnings) == said
    assert len(recording.warnings) == said


@settings(max_examples=200)
@given(st.lists(st.integers(0, 6), max_size=9))
@pytest.mark.costly
def test_as_few_times_as_possible_are_refused_and_the_later_ones(times):
    samples = [Sample(str(i), float(t), None) for i, t in enumerate(times)]
    refused = []
    kept = [int(sample.place) for sample in in_time_order(samples, refused)]
    in_order = [
        chosen
        for k in range(len(times) + 1)
        for chosen in combinations(range(len(times)), k)
        if all(times[i] <= times[j] for i, j in pairwise(chosen))
    ]
    longest = max(len(chosen) for chosen in in_order)
    assert tuple(kept) in in_order
    assert len(kept) == longest
    assert sorted(kept + [int(problem.place) for problem in refused]) == list(range(len(times)))


def test_of_two_times_that_disagree_the_later_row_is_refused():
    kept = in_time_order([Sample(str(i), t, None) for i, t in enumerate([1.0, 2.0, 3.0, 2.5, 4.0])], [])
    assert [sample.place for sample in kept] == ["0", "1", "2", "4"]


BAD_ROWS = {
    "not a number": ("2,x,0", "north must be a number, got 'x'"),
    "one cell of two": ("2,,0", "north must be a number, got ''"),
    "NaN": ("2,nan,0", "north must be a finite number of at most 1e+15, got 'nan'"),
    "infinite": ("2,0,-inf", "east must be a finite number"),
    "absurd": ("2,0,1e16", "east must be a finite number of at most 1e+15, got '1e16'"),
    "no time": (",0,0", "t must be a number, or a date and time as 2026-11-22T08:39:04.5Z, got ''"),
    "time NaN": ("nan,0,0", "t must be a finite number"),
    "short": ("2,0", "must have 3 columns as in the header, got 2"),
    "long": ("2,0,0,0", "must have 3 columns as in the header, got 4"),
    "quote": ('2,"0,0', "close it, delete it, or write each row in one line"),
    "back": ("0.5,0,0", "time 0.5 s is out of order: it stands after 1.0 s and before 3.0 s"),
    "not text": ("2,\x00,\xff", "north must be a number"),
}


@pytest.mark.parametrize(("row", "text"), BAD_ROWS.values(), ids=BAD_ROWS)
def test_a_bad_row_is_refused_by_itself(tmp_path, row, text):
    good = "t,north,east\n1,1,1\n{}3,3,3\n"
    (tmp_path / "d.csv").write_bytes(good.format(row + "\n").encode("latin-1"))
    recording = CsvSource(DetectionColumns(time="t", columns=XY), str(tmp_path / "d.csv")).open(PLANE, RNG)
    assert shown(recording) == shown(opened(tmp_path, good.format("")))
    (problem,) = recording.refused
    assert problem.place == "d.csv:3"
    assert text in problem.text


def test_rows_of_a_scan_at_another_time_are_refused(tmp_path):
    recording = opened(tmp_path, "t,n,north,east\n1,7,1,1\n1,7,2,2\n5,7,3,3\n", scan="n")
    assert shown(recording) == [(1, [[1, 1], [2, 2]])]
    assert told(recording) == ["d.csv:4: time 5.0 s is not that of scan '7' elsewhere, 1.0 s"]


BAD_FILES = {
    "empty": ("", "d.csv: is empty"),
    "header only": ("t,north,east\n", "d.csv: has a header and no rows"),
    "no header": ("1,2,3\n4,5,6\n", "no column 't', which detections.time asks for; the columns are 1, 2, 3"),
    "a column lacks": ("t,north\n1,2\n", "no column 'east', which detections.columns.y asks for"),
    "a column twice": ("t,north,east,east\n1,2,3,4\n", "more than one column 'east'"),
    "another delimiter": ("t;north;east\n1;2;3\n", "no column 't'"),
    "header's quote": ('"t,north,east\n1,2,3\n', "d.csv:1: the header has a quotation mark that is not closed"),
    "no good row": ("t,north,east\n1,2,x\n", "holds no usable scan of radar; the first problem: d.csv:2: east must be"),
}


@pytest.mark.parametrize(("content", "text"), BAD_FILES.values(), ids=BAD_FILES)
def test_a_file_that_is_no_good_as_a_whole(tmp_path, content, text):
    with pytest.raises(InputError) as caught:
        opened(tmp_path, content)
    assert text in str(caught.value)


BAD_COLUMNS = {
    "axis not named": ({"columns": {"x": "north"}}, "sensor 'radar' measures (x [m], y [m]): name a column for y"),
    "axis not measured": ({"columns": XY | {"z": "up"}}, "detections.columns.z: no sensor measures it"),
    "unknown unit": ({"units": {"x": "furlong"}}, "detections.units.x: must be in m or km or NM or ft"),
    "unit of the wrong kind": ({"units": {"time": "m"}}, "detections.units.time: must be in s or ms"),
    "unit of no column": ({"units": {"range": "km"}}, "detections.units.range: no such column is read"),
    "unknown sensor": ({"sensor": "sonar"}, "detections.sensor: the tracker has no sensor 'sonar', only 'radar'"),
    "period of no sensor": ({"periods": {"sonar": 2}}, "detections.periods: the tracker has no sensor 'sonar'"),
}


@pytest.mark.parametrize(("columns", "text"), BAD_COLUMNS.values(), ids=BAD_COLUMNS)
def test_columns_that_do_not_fit_the_tracker(tmp_path, columns, text):
    with pytest.raises(ConfigError) as caught:
        opened(tmp_path, "t,north,east\n1,2,3\n", **columns)
    assert text in str(caught.value)


def test_which_of_two_sensors_must_be_said(tmp_path):
    with pytest.raises(ConfigError, match=r"detections\.sensor: missing: which .* is it, 'a', 'b'\?"):
        opened(tmp_path, "t,north,east\n1,2,3\n", {"a": PLANE["radar"], "b": PLANE["radar"]})


def test_positions_do_not_become_bearings_without_a_platform(tmp_path):
    with pytest.raises(ConfigError, match=r"measures \(range .* name a column for range"):
        opened(tmp_path, "t,north,east\n1,2,3\n", POLAR)


BAD_PARAMETERS = {
    "two ways to the sensor": (lambda: DetectionColumns("t", XY, sensor="a", sensor_column="b"), "sensor: give either"),
    "period": (lambda: DetectionColumns("t", XY, periods={"radar": 0}), "periods.radar: must be > 0, got 0 s"),
    "neither scan nor time": (lambda: PlatformColumns(XY), "scan: give exactly one of `scan` and `time`"),
    "scan and time": (lambda: PlatformColumns(XY, scan="k", time="t"), "time: give exactly one"),
    "half a velocity": (lambda: PlatformColumns(XY | {"vx": "v"}, scan="k"), "columns: must also name a column for vy"),
    "no position": (lambda: PlatformColumns({"x": "n"}, scan="k"), "columns: must also name a column for y"),
    "a column that is no string": (lambda: DetectionColumns("t", {"x": 3}), "columns: must be a table of names to strings"),
    "platform's scan alone": (
        lambda: CsvSource(DetectionColumns("t", XY), platform=PlatformColumns(XY, scan="k")),
        "platform.scan: needs the detections' `scan` column",
    ),
}


@pytest.mark.parametrize(("make", "text"), BAD_PARAMETERS.values(), ids=BAD_PARAMETERS)
def test_parameters_that_contradict_each_other(make, text):
    with pytest.raises(ValueError) as caught:  # noqa: PT011  # the text is what is tested
        make()
    assert text in str(caught.value)


def test_axes_that_no_truth_has(tmp_path):
    truth = TruthColumns(file="d.csv", time="t", columns={"height": "h"})
    with pytest.raises(ConfigError, match=r"truth\.columns\.height: unknown axis; those are x, y, z, vx"):
        opened(tmp_path, "t,north,east\n1,2,3\n", truth=truth)


def test_without_the_recording_the_error_says_what_it_is(tmp_path):
    detections = DetectionColumns(time="t", columns=XY, file="d.csv")
    truth = TruthColumns(file="truth.csv", time="s", columns={"x": "n", "y": "e"})
    about = "harbour radar, published by the pilots"
    wanted = f"{about}. Format: CSV, d.csv with columns t, north, east; truth.csv with columns s, n, e"
    for path, error, start in (
        ("", ConfigError, "path: is not given"),
        (str(tmp_path / "none"), ConfigError, "path: there is no file or folder"),
        (str(tmp_path), InputError, f"{tmp_path / 'd.csv'}: there is no such file"),
    ):
        with pytest.raises(error) as caught:
            CsvSource(detections, path, about, truth).open(PLANE, RNG)
        assert str(caught.value).startswith(start)
        assert str(caught.value).endswith(f"Wanted: {wanted}")


def test_a_folder_is_no_csv_file(tmp_path):
    with pytest.raises(InputError, match="is a folder"):
        CsvSource(DetectionColumns(time="t", columns=XY), str(tmp_path)).open(PLANE, RNG)
