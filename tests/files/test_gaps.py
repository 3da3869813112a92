"""Returns that lack a component: read from tables and recordings, written, and never made up."""

import json

import numpy as np
import pytest

from vedette import ConfigError, Detections, Recording, Scan
from vedette_files import CsvSource, JsonLinesSource, Origin, read_recording, write_recording
from vedette_files.tables.returns import DetectionColumns
from vedette_standard.sensors.linear import LinearSensor
from vedette_standard.sensors.partial import Partial
from vedette_standard.sensors.position_velocity import PositionVelocity
from vedette_standard.sensors.range_bearing_rate import RangeBearingRate

RNG = np.random.default_rng(0)
DOPPLER = RangeBearingRate(sigma_range=10.0, sigma_bearing=0.01, sigma_rate=1.0)
RADAR = {"radar": Partial(DOPPLER, optional={"range_rate": 60.0})}
SPACES = {"radar": DOPPLER.measurement}
HEAD = {
    "format": "vedette",
    "version": 1,
    "sensors": {"radar": {"range": "m", "bearing": "rad mod 2pi", "range_rate": "m/s"}},
}
Z, NAN = [[100.0, 0.1, 0.0], [200.0, 0.2, -3.0]], float("nan")
LACKS = [[False, False, True], [False, False, False]]
COLUMNS = {"range": "r", "bearing": "b", "range_rate": "v"}


def seen(recording):
    """What is known of each return, NaN of what it lacks, and which components it lacks."""
    parts = [scan.detections for scan in recording.scans]
    assert all(
        np.array_equal(np.isnan(one.z), np.zeros_like(one.z) if one.missing is None else one.missing) for one in parts
    )
    return [one.z.tolist() for one in parts]


def from_csv(folder, text, sensors=RADAR, columns=COLUMNS, origin=None, **more):
    (folder / "d.csv").write_text(text)
    return CsvSource(DetectionColumns("t", columns, **more), str(folder / "d.csv"), origin=origin).open(sensors, RNG)


def test_a_recording_keeps_what_its_returns_lack(tmp_path):
    noise = np.array([np.diag([4.0, 1e-4, NAN]), np.diag([4.0, 1e-4, 1.0])])
    lacking = Scan(1.0, "radar", Detections(Z, [True, True], noise=noise, missing=LACKS))
    whole = Scan(2.0, "radar", Detections(Z, [True, True], missing=np.zeros((2, 3), dtype=bool)))
    path = tmp_path / "r.jsonl"
    write_recording(path, Recording((lacking, whole)), SPACES)
    line = json.loads(path.read_text().splitlines()[1])
    assert line["z"] == [[100.0, 0.1, None], Z[1]]
    assert line["noise"][0] == [[4.0, 0.0, None], [0.0, 1e-4, None], [None, None, None]]
    recording, _ = read_recording(path)
    assert not recording.refused
    np.testing.assert_array_equal(seen(recording), [[[100.0, 0.1, NAN], Z[1]], Z])
    np.testing.assert_array_equal(recording.scans[0].detections.noise[1], noise[1])
    write_recording(tmp_path / "again.jsonl", recording, SPACES)
    assert (tmp_path / "again.jsonl").read_bytes() == path.read_bytes()
    opened = JsonLinesSource(path=str(path)).open(RADAR, RNG)
    assert [scan.detections.missing is None for scan in opened.scans] == [False, True]


def test_axes_of_a_recording_in_another_order_take_their_gaps_along(tmp_path):
    head = {**HEAD, "sensors": {"radar": dict(reversed(HEAD["sensors"]["radar"].items()))}}
    line = {"time": 1.0, "sensor": "radar", "z": [[None, 0.1, 100.0]]}
    (tmp_path / "r.jsonl").write_text(f"{json.dumps(head)}\n{json.dumps(line)}\n")
    np.testing.assert_array_equal(
        seen(JsonLinesSource(path=str(tmp_path / "r.jsonl")).open(RADAR, RNG)), [[[100.0, 0.1, NAN]]]
    )


@pytest.mark.parametrize(
    ("bad", "word"),
    [([None, 0.1, 1.0], "range"), ([None, None, None], "range"), ([1.0, None], "3"), ([1.0, 0.1, "x"], "x")],
    ids=["always reported", "nothing", "short", "text"],
)
def test_a_line_refuses_returns_that_lack_what_is_always_reported(bad, word, tmp_path):
    line = {"time": 1.0, "sensor": "radar", "z": [bad, [100.0, 0.1, None]]}
    (tmp_path / "r.jsonl").write_text(f"{json.dumps(HEAD)}\n{json.dumps(line)}\n")
    recording = JsonLinesSource(path=str(tmp_path / "r.jsonl")).open(RADAR, RNG)
    (problem,) = recording.refused
    assert problem.place == "r.jsonl:2"
    assert "z[0]" in problem.text
    assert word in problem.text
    np.testing.assert_array_equal(seen(recording), [[[100.0, 0.1, NAN]]])


def test_a_sensor_that_reports_all_takes_no_null(tmp_path):
    lines = [{"time": t, "sensor": "radar", "z": [[100.0, 0.1, v]]} for t, v in ((1.0, None), (2.0, 3.0))]
    (tmp_path / "r.jsonl").write_text("\n".join(map(json.dumps, (HEAD, *lines))))
    recording = JsonLinesSource(path=str(tmp_path / "r.jsonl")).open({"radar": DOPPLER}, RNG)
    (problem,) = recording.refused
    assert problem.place == "r.jsonl:2"
    assert "partial" in problem.text
    assert seen(recording) == [[[100.0, 0.1, 3.0]]]


def test_an_empty_cell_of_a_table_is_missing(tmp_path):
    recording = from_csv(tmp_path, "t,r,b,v\n0,100,0.1,\n0,200,0.2,-3\n1,,,\n2,,0.2,1\n3,300,0.3,2\n")
    np.testing.assert_array_equal(seen(recording)[0], [[100.0, 0.1, NAN], Z[1]])
    assert seen(recording)[1:] == [[], [[300.0, 0.3, 2.0]]]
    (problem,) = recording.refused
    assert problem.place == "d.csv:5"
    assert problem.text.startswith("r ")
    refused = from_csv(tmp_path, "t,r,b,v\n0,100,0.1,\n1,100,0.1,2\n", {"radar": DOPPLER}).refused
    assert [problem.place for problem in refused] == ["d.csv:2"]
    assert "partial" in refused[0].text


@pytest.mark.parametrize("noise", [{}, {"range": "sr", "bearing": "sb"}], ids=["none", "of each return"])
def test_a_table_without_a_column_of_an_optional_axis_has_it_in_no_row(noise, tmp_path):
    """As if each of its cells were empty; of an axis that is always reported it says that the column lacks."""
    text, there = "t,r,b,sr,sb\n0,100,0.1,2,0.1\n0,200,0.2,2,0.1\n1,,,,\n", {"range": "r", "bearing": "b"}
    recording = from_csv(tmp_path, text, columns=there, noise=noise)
    np.testing.assert_array_equal(seen(recording)[0], [[100.0, 0.1, NAN], [200.0, 0.2, NAN]])
    assert seen(recording)[1:] == [[]]
    more = noise and {**noise, "range_rate": "v"}
    other = from_csv(tmp_path, "t,r,b,v,sr,sb\n0,100,0.1,,2,0.1\n0,200,0.2,,2,0.1\n1,,,,,\n", noise=more)
    for one, same in zip(recording.scans, other.scans, strict=True):
        np.testing.assert_array_equal(one.detections.missing, same.detections.missing)
        np.testing.assert_array_equal(one.detections.noise, same.detections.noise)
    with pytest.raises(ConfigError, match="name a column for range_rate"):
        from_csv(tmp_path, text, {"radar": DOPPLER}, there)


def test_what_a_row_lacks_needs_no_deviation(tmp_path):
    noise = {"range": "sr", "bearing": "sb", "range_rate": "sv"}
    text = "t,r,b,v,sr,sb,sv\n0,100,0.1,,2,0.1,\n0,200,0.2,-3,2,0.1,\n0,200,0.2,-3,2,0.1,1\n"
    recording = from_csv(tmp_path, text, noise=noise)
    assert [problem.place for problem in recording.refused] == ["d.csv:3"]
    made = recording.scans[0].detections
    assert made.missing.tolist() == LACKS
    assert np.allclose(made.noise[:, :2, :2], np.diag([4.0, 0.01]))


def test_without_a_course_there_is_no_velocity_and_copies_count_once(tmp_path):
    sensors = {"ais": Partial(PositionVelocity(6.0, 0.5), optional={"vx": 40.0, "vy": 40.0})}
    columns = {"latitude": "lat", "longitude": "lon", "speed": "v", "course": "c"}
    text = "t,lat,lon,v,c,who\n0,59,10,5,,7\n0,59,10,5,,7\n0,59,10,,0.1,8\n1,59,,5,0.1,7\n2,59,10,5,0,7\n"
    recording = from_csv(tmp_path, text, sensors, columns, Origin(59.0, 10.0), identity="who")
    assert [problem.place for problem in recording.refused] == ["d.csv:5"]
    np.testing.assert_allclose(seen(recording)[0], [[0.0, 0.0, NAN, NAN]] * 2, atol=1e-6)
    np.testing.assert_allclose(seen(recording)[1], [[0.0, 0.0, 0.0, 5.0]], atol=1e-6)


def test_an_altitude_moves_x_and_y_too_so_that_no_row_may_lack_it(tmp_path):
    sensors = {"adsb": Partial(LinearSensor(axes=("x", "y", "z"), R=np.eye(3)), optional={"z": 1e4})}
    columns = {"latitude": "lat", "longitude": "lon", "altitude": "alt"}
    recording = from_csv(tmp_path, "t,lat,lon,alt\n0,59,10,\n1,59,10,7\n", sensors, columns, Origin(59.0, 10.0))
    assert [problem.place for problem in recording.refused] == ["d.csv:2"]
    np.testing.assert_allclose(seen(recording), [[[0.0, 0.0, 7.0]]], atol=1e-6)
