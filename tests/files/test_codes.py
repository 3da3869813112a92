"""Names of objects as codes: read from tables, written with tracks, and read again."""

import csv
import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import vedette
from vedette import Detections, Recording, Scan
from vedette.cli import main
from vedette_files import (
    Terms,
    code,
    codes,
    label,
    read_recording,
    read_tracks,
    write_recording,
    write_tracks_csv,
    write_tracks_jsonl,
)
from vedette_live.saving import scan_data, scan_from

CONFIG = {
    "source": {
        "kind": "csv",
        "detections": {"time": "t", "columns": {"x": "x", "y": "y"}, "identity": "icao24"},
    },
    "sensors": {"adsb": {"kind": "cartesian_position", "sigma": 5.0, "clutter_density": 1e-8}},
    "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
    "associator": {"kind": "jpda"},
    "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
    "lifecycle": {"kind": "existence"},
}


@given(st.from_regex(r"[0-9A-Za-z_-]{1,10}", fullmatch=True))
@pytest.mark.costly
def test_a_short_name_is_read_again_from_its_code(name):
    assert 0 <= code(name) < 2**63
    assert label(code(name)) == name


@given(st.lists(st.text(max_size=20).filter(bool), min_size=2, max_size=6, unique=True))
def test_unlike_names_have_unlike_codes(names):
    assert len({code(name) for name in names}) == len(names)
    assert all(0 <= code(name) < 2**63 for name in names)
    assert label(code("")) == ""


def table(tmp_path):
    rows = [f"{i},{8 * i},0,4067f2\n{i},{8 * i},900,{'' if i == 3 else '007'}\n" for i in range(8)]
    (tmp_path / "plots.csv").write_text("t,x,y,icao24\n" + "".join(rows))
    return CONFIG | {"source": CONFIG["source"] | {"path": str(tmp_path / "plots.csv")}}


def test_numbers_that_a_column_with_gaps_made_floats_are_told_as_they_were(tmp_path):
    config = table(tmp_path)
    cells = (tmp_path / "plots.csv").read_text().replace("4067f2", "235070762.0")
    (tmp_path / "plots.csv").write_text(cells)
    (named, _) = vedette.load(config).run().scans[0].detections.identity
    assert label(int(named)) == "235070762"


def test_a_message_that_was_heard_twice_is_one_return_and_unnamed_returns_are_as_many_as_rows(tmp_path):
    config = table(tmp_path)
    head, *rows = (tmp_path / "plots.csv").read_text().splitlines()
    (tmp_path / "plots.csv").write_text("\n".join([head, *(row for row in rows for _ in range(2))]) + "\n")
    scans = vedette.load(config).run().scans
    assert [len(scan.detections.z) for scan in scans] == [3 if i == 3 else 2 for i in range(8)]


def test_a_column_names_the_objects_of_returns_and_tables_the_tracks(tmp_path):
    result = vedette.load(table(tmp_path)).run()
    assert [label(one) for one in result.scans[3].detections.identity] == ["4067f2", ""]
    assert {label(track.identity[-1]) for track in result.tracks} == {"4067f2", "007"}
    space, sensors = result.made_by.tracker.state, {"adsb": result.made_by.tracker.sensors["adsb"].measurement}
    write_tracks_csv(tmp_path / "tracks.csv", result.tracks, space, Terms.of(result.recording.notes))
    write_tracks_jsonl(tmp_path / "tracks.jsonl", result.tracks, space)
    write_recording(tmp_path / "recording.jsonl", Recording(result.scans), sensors)
    header, *lines = (tmp_path / "tracks.csv").read_text().splitlines()
    column = header.split(",").index("identity")
    assert {line.split(",")[column] for line in lines} == {"4067f2", "007"}
    again = read_tracks(tmp_path / "tracks.jsonl")
    assert [track.identity.tolist() for track in again] == [track.identity.tolist() for track in result.tracks]
    recording, _ = read_recording(tmp_path / "recording.jsonl")
    assert all(
        np.array_equal(one.detections.identity, other.detections.identity)
        for one, other in zip(recording.scans, result.scans, strict=True)
    )


@pytest.mark.parametrize("name", ["235070762", "007", "TOM2XE"])
def test_a_recording_keeps_names(tmp_path, name):
    seen = Detections([[1.0, 2.0], [3.0, 4.0]], [True, True], identity=[code(name), -1])
    write_recording(tmp_path / "r.jsonl", Recording((Scan(0.0, "radar", seen),)), {"radar": vedette.Space.of(x="m", y="m")})
    line = json.loads((tmp_path / "r.jsonl").read_text().splitlines()[-1])
    assert [str(one) for one in line["identity"]] == [name, "None"]
    recording, _ = read_recording(tmp_path / "r.jsonl")
    assert recording.scans[0].detections.identity.tolist() == [code(name), -1]


@pytest.mark.parametrize("wrong", [[1.5], [-3], [[1]], [True], 7])
def test_a_wrong_name_is_refused_by_itself(tmp_path, wrong):
    lines = [
        {"format": "vedette", "version": 1, "sensors": {"radar": {"x": "m"}}},
        {"time": 0, "sensor": "radar", "z": [[1]], "identity": wrong},
        {"time": 1, "sensor": "radar", "z": [[1]], "identity": [None]},
    ]
    (tmp_path / "r.jsonl").write_text("\n".join(map(json.dumps, lines)))
    recording, _ = read_recording(tmp_path / "r.jsonl")
    assert [scan.time for scan in recording.scans] == [1.0]
    assert [problem.place for problem in recording.refused] == ["r.jsonl:2"]


LONG = {"00000000-0000-4000-8000-000000000001", 'Jo "Joe", Jr.', "Île d'Yeu", "null and nothing"}


def test_long_names_come_out_as_they_went_in(tmp_path, monkeypatch):
    with (tmp_path / "plots.csv").open("w", newline="", encoding="utf-8") as file:
        rows = [(i, 8 * i, 900 * k, name) for i in range(8) for k, name in enumerate(sorted(LONG))]
        csv.writer(file).writerows([("t", "x", "y", "icao24"), *rows])
    config = CONFIG | {"source": CONFIG["source"] | {"path": str(tmp_path / "plots.csv")}}
    (tmp_path / "given.json").write_text(json.dumps(config))
    assert main(["run", str(tmp_path / "given.json"), "--out", str(tmp_path / "out")]) == 0
    forget(monkeypatch)
    assert main(["export", str(tmp_path / "out"), "--to", str(tmp_path / "again.csv")]) == 0
    for path in (tmp_path / "out" / "tracks.csv", tmp_path / "again.csv"):
        with path.open(newline="", encoding="utf-8") as file:
            assert {row["identity"] for row in csv.DictReader(file)} == LONG
    assert all(name in (tmp_path / "out" / "summary.txt").read_text() for name in LONG)
    forget(monkeypatch)
    recording, _ = read_recording(tmp_path / "out" / "recording.jsonl")
    assert {label(one) for one in recording.scans[0].detections.identity} == LONG


def forget(monkeypatch, most=1000):
    """Let it be as in another process."""
    monkeypatch.setattr(codes, "_LONG", codes._LongNames(most))


def test_a_service_that_goes_on_knows_long_names(monkeypatch):
    name = max(LONG, key=len)
    data = json.loads(json.dumps(scan_data(Scan(0.0, "radar", Detections([[1.0, 2.0]], [True], identity=[code(name)])))))
    forget(monkeypatch)
    assert label(scan_from(data).detections.identity[0]) == name


def test_of_many_long_names_those_read_last_are_held(monkeypatch):
    forget(monkeypatch)
    names = [f"a name of 25 letters {i:4}" for i in range(30)]
    held = [label(number) for number in [code(name) for name in (*names, names[25])][:-1]]
    assert [one for one, name in zip(held, names, strict=True) if one == name] == names[-8:]
    assert all(one.startswith("#") for one in held[:-8])
