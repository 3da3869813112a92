"""Files of records are read as the rows of a table are."""

import json

import numpy as np
import pytest

import vedette
from vedette.errors import InputError
from vedette_files.tables.columnar import header_and_rows

CONFIG = {
    "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 1.0}},
    "sensors": {"s": {"kind": "cartesian_position", "sigma": 1.0, "detection_probability": 0.9, "clutter_density": 1e-6}},
    "associator": {"kind": "nearest"},
    "birth": {"kind": "from_returns", "spread": {"vx": 1.0, "vy": 1.0}},
    "lifecycle": {"kind": "existence"},
}

SCANS = [[(0.0, 1.0)], [(1.0, 2.0), (5.0, 6.0)], [(2.0, 3.0)]]


def written(path, form):
    """Write the scans in one of the forms, and return the titles of x and y."""
    flat = [(k, x, y) for k, scan in enumerate(SCANS) for x, y in scan]
    if form == "lines":
        path.write_text("".join(json.dumps({"t": k, "x": x, "y": y}) + "\n" for k, x, y in flat))
    elif form == "frames":
        frames = ({"t": k, "seen": [{"x": x, "y": y} for x, y in scan]} for k, scan in enumerate(SCANS))
        path.write_text("".join(json.dumps(frame) + "\n\n" for frame in frames))
    elif form == "list":
        path.write_text(json.dumps({"about": "plots", "plots": [{"t": k, "x": x, "y": y} for k, x, y in flat]}))
    else:
        path.write_text(json.dumps([{"t": k, "at": {"xy": [x, y]}} for k, x, y in flat]))
    return ("at.xy.0", "at.xy.1") if form == "nested" else ("x", "y")


@pytest.mark.parametrize(
    ("form", "name"), [("lines", "a.jsonl"), ("frames", "a.ndjson"), ("list", "a.json"), ("nested", "a.JSON")]
)
def test_records_are_read_as_rows(tmp_path, form, name):
    x, y = written(tmp_path / name, form)
    source = {"kind": "csv", "path": str(tmp_path / name), "detections": {"time": "t", "columns": {"x": x, "y": y}}}
    experiment = vedette.load({**CONFIG, "source": source})
    scans = experiment.source.open(experiment.tracker.sensors, np.random.default_rng(0)).scans
    assert [scan.time for scan in scans] == [0.0, 1.0, 2.0]
    assert [scan.detections.z.tolist() for scan in scans] == [[list(spot) for spot in scan] for scan in SCANS]


def test_all_lists_of_a_record_give_rows(tmp_path):
    """Of two teams the last was read alone, and of a list below a name its last record."""
    frame = {
        "t": 0,
        "home": [{"x": 1}, {"x": 2}],
        "away": [{"x": 3}],
        "seen": {"by": [{"x": 4}, {"x": 5}]},
        "to": [[6], [7]],
    }
    (tmp_path / "a.jsonl").write_text(json.dumps(frame) + "\n")
    titles, rows = header_and_rows(tmp_path / "a.jsonl", ("t", "x", "seen.x"))
    assert titles == ["t", "x", "seen.x"]
    assert list(rows) == [["0", *row] for row in (["1", ""], ["2", ""], ["3", ""], ["", "4"], ["", "5"])]


def test_what_stands_beside_a_list_is_of_each_of_its_rows(tmp_path):
    """It was lost where the list is the only one of a file, and two lists of which one is of numbers were refused."""
    file = {"now": 7.5, "box": [1, 2, 3], "by": {"site": "a"}, "aircraft": [{"x": 1}, {"x": 2}]}
    (tmp_path / "a.json").write_text(json.dumps(file))
    assert list(header_and_rows(tmp_path / "a.json", ("now", "by.site", "x"))[1]) == [["7.5", "a", "1"], ["7.5", "a", "2"]]
    (tmp_path / "b.json").write_text(json.dumps({"time": 7, "states": [["a", 1], ["b", 2]]}))
    assert list(header_and_rows(tmp_path / "b.json", ("time", "states.1"))[1]) == [["7", "1"], ["7", "2"]]
    (tmp_path / "c.json").write_text(json.dumps({"now": 7.5, "aircraft": []}))
    with pytest.raises(InputError, match=r"c\.json: holds no record"):
        header_and_rows(tmp_path / "c.json", ("now",))


def test_a_list_that_tells_another_one_again_has_titles_of_its_own(tmp_path):
    """Players and the same smoothed were two returns each."""
    frame = {"home_raw": [{"x": 1}], "home": [{"x": 2}], "awayRaw": [{"x": 3}], "away": [{"x": 4}], "filtered": [{"x": 5}]}
    (tmp_path / "a.jsonl").write_text(json.dumps(frame) + "\n")
    titles, rows = header_and_rows(tmp_path / "a.jsonl", ("x", "raw.x"))
    assert titles == ["raw.x", "x"]
    assert list(rows) == [["1", ""], ["", "2"], ["3", ""], ["", "4"], ["", "5"]]


@pytest.mark.parametrize(
    ("file", "titles", "expected"),
    [
        ({"columns": ["t", "x"], "index": [5, 6], "data": [[0, 3], [1, 4]]}, ("t", "x"), [["0", "3"], ["1", "4"]]),
        ({"t": {"5": 0, "6": 1}, "x": {"5": 3, "6": 4}}, ("t", "x"), [["0", "3"], ["1", "4"]]),
        ({"t": [0, 1], "x": [3, 4]}, ("t", "x"), [["0", "3"], ["1", "4"]]),
        ([{"t": 7, "seen": [{"t": 7.1, "x": 3}, {"t": 7.2, "x": 4}]}], ("t", "x"), [["7.1", "3"], ["7.2", "4"]]),
        ([{"time": [12, 30, 5], "x": [3, 4, 6]}], ("time.0", "time.2", "x.1"), [["12", "5", "4"]]),
    ],
    ids=["pandas split", "pandas columns", "columns", "returns with times of their own", "three numbers of one time"],
)
def test_a_list_is_of_rows_or_of_numbers_as_it_says(file, titles, expected, tmp_path):
    """What detections of a frame say of their time is theirs, and a few numbers are no times of as many rows."""
    (tmp_path / "a.json").write_text(json.dumps(file))
    assert list(header_and_rows(tmp_path / "a.json", titles)[1]) == expected


def test_routes_of_gpx_are_numbered_among_the_tracks(tmp_path):
    points = ('<rte><rtept lat="1" lon="2"/></rte>', '<rte><rtept lat="3" lon="2"/></rte>')
    (tmp_path / "a.gpx").write_text(f'<gpx>{points[0]}<trk><trkseg><trkpt lat="5" lon="2"/></trkseg></trk>{points[1]}</gpx>')
    rows = header_and_rows(tmp_path / "a.gpx", ("latitude", "track_id"))[1]
    assert list(rows) == [["1", "1"], ["5", "2"], ["3", "3"]]


def test_waypoints_of_gpx_are_points_where_there_are_no_tracks(tmp_path):
    mark = '<wpt lat="50.9" lon="-1.2"><time>2026-11-20T10:00:00Z</time></wpt>'
    track = '<trk><trkseg><trkpt lat="50.8" lon="-1.1"/></trkseg></trk>'
    for name, text, expected in (("a.gpx", mark + track, ["50.8"]), ("b.gpx", mark, ["50.9"])):
        (tmp_path / name).write_text(f"<gpx>{text}</gpx>")
        assert [row for (row,) in header_and_rows(tmp_path / name, ("latitude",))[1]] == expected


def test_points_of_gpx_bear_the_number_of_their_track(tmp_path):
    point = '<trkpt lat="50.8" lon="-1.1"><ele>5</ele><time>2026-11-23T10:00:{:02d}Z</time></trkpt>'
    tracks = "".join(f"<trk><trkseg>{point.format(k)}{point.format(k + 1)}</trkseg></trk>" for k in (0, 10))
    (tmp_path / "a.gpx").write_text(f'<gpx xmlns="http://www.topografix.com/GPX/1/1">{tracks}</gpx>')
    titles, rows = header_and_rows(tmp_path / "a.gpx", ("time", "latitude", "track_id"))
    assert titles == ["time", "latitude", "longitude", "altitude", "track_id"]
    assert list(rows)[2] == ["2026-11-23T10:00:10Z", "50.8", "2"]


@pytest.mark.parametrize(
    ("name", "text", "place"),
    [
        ("a.jsonl", '{"t": 0, "x": 1}\n{"t": 1,\n', "a.jsonl:2"),
        ("a.jsonl", "3\n", "a.jsonl:1"),
        ("a.jsonl", '{"format": "vedette", "version": 1}\n', "a.jsonl:1"),
        ("a.json", '{"t": 0}', "a.json"),
        ("a.json", '[{"t": 0}, 7]', "record 2"),
        ("a.gpx", "<gpx></gpx>", "a.gpx"),
        ("a.gpx", "<gpx>", "a.gpx"),
    ],
)
def test_what_is_no_record_is_refused_by_its_place(tmp_path, name, text, place):
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=place):
        list(header_and_rows(tmp_path / name, ("t",))[1])


@pytest.mark.parametrize("whole", ["Feature", "FeatureCollection"])
def test_each_time_of_a_track_in_geojson_is_a_row(whole, tmp_path):
    """The times stand in a list beside that of the positions."""
    line = {"type": "LineString", "coordinates": [[10 + k, 59, 7] for k in range(9)]}
    track = {"type": "Feature", "geometry": line, "properties": {"name": "a", "coordTimes": list(range(9)), "of": [1, 2]}}
    track["bbox"] = [[10, 59], [18, 59]]
    path = tmp_path / "a.geojson"
    path.write_text(json.dumps(track if whole == "Feature" else {"type": whole, "features": [track, track]}))
    titles, rows = header_and_rows(path, ("geometry.coordinates.0", "properties.name", "properties.coordTimes"))
    assert {"properties.(of: 2 for 9 times)", "(bbox: 2 for 9 times)"} <= set(titles)  # those belong to no row
    assert [tuple(row) for row in rows] == [(f"{10 + k}", "a", f"{k}") for k in range(9)] * (1 if whole == "Feature" else 2)


def test_positions_of_a_line_without_times_are_told_by_name(tmp_path):
    line = {"type": "LineString", "coordinates": [[10 + k, 59] for k in range(9)]}
    (tmp_path / "a.geojson").write_text(json.dumps([{"type": "Feature", "geometry": line}]))
    assert "geometry.(coordinates: lists without times)" in header_and_rows(tmp_path / "a.geojson", ())[0]
