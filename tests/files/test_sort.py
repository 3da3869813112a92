"""Rows out of order, and what became of every row: used, refused or left out, and nothing beside."""

import json

import numpy as np
import pytest

import vedette
from vedette import Recording
from vedette.types import Detections, Rows, Scan
from vedette_files import CsvSource, JsonLinesSource, write_recording
from vedette_files.tables.platform import PlatformColumns
from vedette_files.tables.returns import DetectionColumns
from vedette_files.tables.truth import TruthColumns
from vedette_standard.sensors.cartesian_position import CartesianPosition

RADAR = {"radar": CartesianPosition(sigma=1.0)}
RNG = np.random.default_rng(0)
XY = {"x": "x", "y": "y"}
N = 120


def shuffled(header, make):
    rows = [make(i) for i in np.random.default_rng(3).permutation(N).tolist()]
    return "\n".join([*header, *rows]) + "\n"


def csv_source(tmp_path, **more):
    (tmp_path / "d.csv").write_text(shuffled(["t,x,y,scan"], lambda i: f"{i},{i},{2 * i},{i}"))
    scan = {"scan": more.pop("scan")} if "scan" in more else {}
    return CsvSource(DetectionColumns(time="t", columns=XY, **scan), str(tmp_path / "d.csv"), **more)


def jsonl_source(tmp_path, **more):
    header = json.dumps({"format": "vedette", "version": 1, "sensors": {"radar": {"x": "m", "y": "m"}}})
    text = shuffled([header], lambda i: json.dumps({"time": i, "sensor": "radar", "z": [[i, 2 * i]]}))
    (tmp_path / "r.jsonl").write_text(text)
    return JsonLinesSource(str(tmp_path / "r.jsonl"), **more)


@pytest.mark.parametrize("source", [csv_source, jsonl_source, lambda path, **more: csv_source(path, scan="scan", **more)])
def test_shuffled_rows_are_refused_and_sorting_is_offered_first(tmp_path, source):
    recording = source(tmp_path).open(RADAR, RNG)
    assert len(recording.scans) < 30
    assert len(recording.refused) == N - len(recording.scans)
    assert f"{len(recording.refused)} of {N}" in recording.refused[0].text
    assert "`sort = true`" in recording.refused[0].text
    assert "`sort" not in recording.refused[1].text
    (rows,) = recording.rows.values()
    assert rows == Rows(N, len(recording.scans), len(recording.refused))
    recording = source(tmp_path, sort=True).open(RADAR, RNG)
    assert [scan.time for scan in recording.scans] == list(range(N))
    assert [scan.detections.z.tolist() for scan in recording.scans] == [[[i, 2 * i]] for i in range(N)]
    assert recording.refused == ()
    assert list(recording.rows.values()) == [Rows(N, N, 0)]


def test_one_row_out_of_order_is_an_error_and_no_reason_to_sort(tmp_path):
    (tmp_path / "d.csv").write_text("t,x,y\n0,1,1\n9,1,1\n1,1,1\n2,1,1\n")
    recording = CsvSource(DetectionColumns(time="t", columns=XY), str(tmp_path / "d.csv")).open(RADAR, RNG)
    assert "sort" not in str(*recording.refused)


def test_truth_and_platform_are_sorted_too_and_counted_by_themselves(tmp_path):
    (tmp_path / "truth.csv").write_text("t,x,y\n1,1,1\n0,0,0\n,,\n")
    (tmp_path / "own.csv").write_text("t,x,y\n2,2,0\n0,0,0\n\n1,one,0\n")
    (tmp_path / "d.csv").write_text(
        't,x,y,s\n0,1,2,radar\n1,,,radar\n5,1,1,radar\n5,2,1,radar\n1,1,1,sonar\n2,"1,1,radar\n2,2\n'
    )
    detections = DetectionColumns(time="t", columns=XY, file="d.csv", sensor_column="s")
    truth = TruthColumns(file="truth.csv", time="t", columns=XY)
    platform = PlatformColumns(file="own.csv", time="t", columns=XY)
    recording = CsvSource(detections, str(tmp_path), truth=truth, platform=platform, sort=True).open(RADAR, RNG)
    assert recording.truth[0].times.tolist() == [0, 1]
    assert recording.rows == {
        "detections": Rows(total=7, used=2, refused=4, left_out=1),  # two rows of the scan outside the platform's record
        "platform": Rows(total=3, used=2, refused=1),
        "truth": Rows(total=3, used=2, refused=1),
    }


def test_entries_of_the_benchmark_may_come_in_any_order(tmp_path):
    """The source sorts them, so it needs no parameter."""
    entries = [{"sensorID": 2, "time": i, "ownshipPosition": [0, 0], "measurement": [1, i]} for i in range(N)]
    np.random.default_rng(3).shuffle(entries)
    other = {"sensorID": 1, "time": 1, "ownshipPosition": [0, 0], "measurement": []}
    bad = {"sensorID": 2, "time": "soon"}
    (tmp_path / "scenario1_detections.json").write_text(json.dumps([*entries, other, bad]))
    boat = [{"targetID": 1, "time": float(i), "position": [0, i, 0]} for i in range(3)]
    (tmp_path / "scenario1_groundTruth.json").write_text(json.dumps([boat, boat[:2], {"targetID": 9}]))
    source = {"kind": "autoferry", "path": str(tmp_path), "scenario": 1, "sensors": ["radar"]}
    config = {
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 1}},
        "sensors": {"radar": {"kind": "cartesian_position", "sigma": 1}},
        "associator": {"kind": "pda"},
        "birth": {"kind": "from_returns", "spread": {"vx": 1, "vy": 1}},
        "lifecycle": {"kind": "m_of_n"},
        "source": source,
    }
    recording = vedette.load(config).run().recording
    assert [scan.time for scan in recording.scans] == list(range(N))
    assert recording.rows == {"detections": Rows(N + 2, N, 1, 1), "truth": Rows(6, 5, 1)}


def test_lines_of_json_are_all_accounted_for(tmp_path):
    scans = (Scan(0.0, "radar", Detections.of([[1, 2]])), Scan(1.0, "sonar", Detections.of([[1, 2]])))
    space = RADAR["radar"].measurement
    write_recording(tmp_path / "r.jsonl", Recording(scans), {"radar": space, "sonar": space})
    with (tmp_path / "r.jsonl").open("a") as file:
        file.write(
            '\n{"time": 2, "sensor": "radar", "z": [[1, null], [1, 2]]}\n{"time": 3, "sensor": "radar", "z": [[1], [2]]}\n{'
        )
    recording = JsonLinesSource(str(tmp_path / "r.jsonl")).open(RADAR, RNG)
    assert len(recording.refused) == 4
    assert recording.rows == {"lines": Rows(total=5, used=2, refused=2, left_out=1)}
