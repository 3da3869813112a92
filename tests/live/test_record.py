"""What a service records: scans with their arrivals, what it left out; replayed, it gives the same tracks."""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from pathlib import Path
from shutil import copytree, ignore_patterns
from typing import Any

import numpy as np
import pytest

import vedette
from support.services import (
    TRACKER,
    as_json,
    connected,
    feed,
    free_port,
    lines,
    made,
    ran,
    replayed,
    served,
    undisturbed,
    wait_for,
)
from vedette.streams import Arrival
from vedette.types import Scan
from vedette_files import read_recording, write_recording
from vedette_live.recorder import Recorder
from vedette_live.window import Taken


def test_a_record_replays_to_the_last_bit_and_tells_arrivals_and_what_was_left_out(tmp_path: Path) -> None:
    """Scans late by up to three others, and some by more: what was kept of the tracks is what the replay finds."""
    told = [{**json.loads(line), "n": None} for line in lines(80)]
    order = [k + d for k in range(0, 76, 4) for d in (3, 0, 2, 1)] + [76, 11, 77, 78, 79]
    came = tuple(Arrival(json.dumps(told[k]).encode(), 1e6 + 0.5 * i) for i, k in enumerate(order))
    record, base = tmp_path / "record.jsonl", tmp_path / "state.sqlite"
    conduct = {"horizon": "10 s", "record": str(record), "store": {"kind": "sqlite", "path": str(base)}, "full": "wait"}
    config = {**TRACKER, "inputs": [feed()], "service": conduct}
    running = ran(config, came)
    counts = running.counters.counts
    assert (counts["scans_taken_total"], counts["scans_refused_total"]) == (80, 1)
    assert counts["scans_late_total"] == 19 * 3
    again = replayed(record, TRACKER)
    assert as_json(again) == as_json(running.state)
    entries = [json.loads(line) for line in record.read_bytes().splitlines()[1:]]
    scans = [entry for entry in entries if "z" in entry]
    arrived = {entry["time"]: entry["arrived"] for entry in scans}
    assert arrived == {1.5 * k: 1e6 + 0.5 * order.index(k) for k in range(80)}
    recording, _ = read_recording(record)
    assert len(recording.scans) == 80
    assert len(recording.refused) == sum("left_out" in entry for entry in entries) == 1
    with closing(sqlite3.connect(base)) as direct:
        rows = direct.execute("SELECT time, id, mean, cov FROM tracks ORDER BY time, id").fetchall()
    result = vedette.load({**TRACKER, "source": {"kind": "jsonl", "path": str(record)}}).run()
    found = {(time, track.id): i for track in result.tracks for i, time in enumerate(track.times.tolist())}
    tracks = {track.id: track for track in result.tracks}
    assert rows
    for time, number, mean, cov in rows:
        i = found[time, number]
        assert (mean, cov) == (json.dumps(tracks[number].mean[i].tolist()), json.dumps(tracks[number].cov[i].tolist()))


def test_a_record_that_is_moved_away_is_begun_anew(tmp_path: Path) -> None:
    """Whoever rotated it and deleted the old one lost what came after. What else has its name stays as it is."""
    record, experiment, state = tmp_path / "record.jsonl", vedette.load(TRACKER), undisturbed([])
    recorder = Recorder.append(str(record), experiment, {})

    def write(time: float) -> None:
        recorder.write(Taken(vedette.Scan(time, "north", vedette.Detections.of([[time, 1.0]])), (), state))
        recorder.flush()

    write(1.0)
    record.rename(tmp_path / "old")
    write(2.0)
    record.rename(tmp_path / "older")
    record.write_bytes(b"mine")
    with pytest.raises(OSError, match="another file"):
        write(3.0)
    assert record.read_bytes() == b"mine"
    record.unlink()
    recorder.flush()
    recorder.close()
    times = [[scan.time for scan in read_recording(tmp_path / name)[0].scans] for name in ("old", "older", "record.jsonl")]
    assert times == [[1.0], [2.0], [3.0]]


@pytest.mark.costly
def test_a_service_killed_after_its_record_was_moved_away_records_no_scan_twice(tmp_path: Path) -> None:
    """It went on from the state of 5 s before, and recorded again what stood in the file that was moved."""
    here, killed, port = tmp_path / "here", tmp_path / "killed", free_port()

    def config(folder: Path) -> dict[str, Any]:
        conduct = {"record": str(folder / "record.jsonl"), "store": {"kind": "sqlite", "path": str(folder / "state.sqlite")}}
        given = {"kind": "tcp_server", "port": port}
        return {
            **TRACKER,
            "inputs": [{"input": given, "format": {"kind": "json_lines"}}],
            "service": {**conduct, "save": "1 h"},
        }

    here.mkdir()
    with served(config(here)) as running, connected(port) as sender:
        sender.sendall(b"".join(lines(70)))
        wait_for(lambda: (here / "record.jsonl").stat().st_size and running.counters.counts["scans_taken_total"] == 70)
        (here / "record.jsonl").rename(here / "old.jsonl")
        wait_for(lambda: running.counters.counts["saves_total"] == 1)
        copytree(here, killed, ignore=ignore_patterns(".*"))
    ran({**config(killed), "inputs": [feed()]}, [Arrival(line, 1e6) for line in lines(80)])
    records = [read_recording(killed / name)[0].scans for name in ("old.jsonl", "record.jsonl")]
    assert [scan.time for scans in records for scan in scans] == [1.5 * k for k in range(80)]


def test_a_record_says_where_x_points_and_of_another_frame_another_one_is_begun_beside(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """It was an error, and under systemd one at each start."""
    experiment, notes = vedette.load(TRACKER), {"origin": "59, 10", "frame": "x north, y east"}

    def begun(name: str, notes: dict[str, str]) -> str:
        recorder = Recorder.append(str(tmp_path / name), experiment, notes)
        recorder.flush()
        recorder.close()
        return (tmp_path / name).read_text()

    assert json.loads(begun("new", notes))["notes"] == notes
    other = {**notes, "frame": "x east, y north"}
    assert begun("old", {}) == begun("old", other)
    assert not caplog.records
    assert begun("old", {}) == begun("old", notes)  # without notes x is east: its places would be mirrored
    assert [each.getMessage() for each in caplog.records] == ["record"]
    caplog.clear()
    before = (tmp_path / "new").read_bytes()
    (tmp_path / "new-2").write_bytes(bytes(100))  # as a copy that was cut by another program had left it
    for count in (1, 2):
        assert begun("new", other) == before.decode()
        assert json.loads((tmp_path / "new-3").read_text())["notes"] == other
        assert len(caplog.records) == count


def test_a_record_goes_on_where_its_state_was_saved_and_not_where_another_was(tmp_path: Path) -> None:
    """A sensor that is renamed for a while: the first record was cut where the second one had ended."""
    names, record = {"south": "sud"}, tmp_path / "record.jsonl"
    conduct = {"record": str(record), "store": {"kind": "sqlite", "path": str(tmp_path / "state.sqlite")}}
    given = {**TRACKER, "inputs": [feed()], "service": conduct}
    sensors = {names.get(name, name): sensor for name, sensor in TRACKER["sensors"].items()}
    told = [Arrival(line, 0.0) for line in lines(60)]
    ran(given, told[:40])
    ran({**given, "sensors": sensors, "inputs": [feed(sensors={"south": "sud"})]}, told[40:44])
    ran(given, told[44:])
    taken = [[scan.time for scan in read_recording(tmp_path / name)[0].scans] for name in ("record.jsonl", "record-2.jsonl")]
    assert taken == [[1.5 * k for k in (*range(40), *range(44, 60))], [1.5 * k for k in range(40, 44)]]


def test_a_record_that_is_emptied_is_begun_anew_without_a_hole(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """As logrotate's copytruncate does: it was written on where it had ended, after NULs, and no service could go on."""
    record, port = tmp_path / "record.jsonl", free_port()
    inputs = [{"input": {"kind": "tcp_server", "port": port}, "format": {"kind": "json_lines"}}]
    config = {**TRACKER, "inputs": inputs, "service": {"record": str(record), "save": 0.05}}
    with served(config) as running, connected(port) as sender:
        for part in (lines(40), lines(80)[40:]):
            record.write_bytes(b"")  # before anything is there, too
            size = running.counters.counts["scans_taken_total"]
            sender.sendall(b"".join(part))
            wait_for(lambda size=size: running.counters.counts["scans_taken_total"] == size + 40)  # type: ignore[misc]
            wait_for(lambda: len(record.read_bytes().splitlines()) == 41)
    assert [scan.time for scan in read_recording(record)[0].scans] == [1.5 * k for k in range(40, 80)]
    assert len([each for each in caplog.records if "path" in vars(each)]) == 1


def test_a_record_that_is_cut_within_is_left_alone_and_told(tmp_path: Path) -> None:
    recorder = Recorder.append(str(tmp_path / "record.jsonl"), vedette.load(TRACKER), {})
    recorder.flush()
    with recorder.path.open("r+b") as other:
        other.truncate(20)
    recorder.waiting.append(b"{}\n")
    with pytest.raises(OSError, match="move it away"):
        recorder.flush()
    assert recorder.path.stat().st_size == 20
    recorder.close()


def test_a_record_that_ends_in_a_part_of_a_line_goes_on_after_the_last_whole_one(tmp_path: Path) -> None:
    record = tmp_path / "record.jsonl"
    experiment, state = vedette.load(TRACKER), undisturbed([])

    def record_scan(time: float) -> list[bytes]:
        recorder = Recorder.append(str(record), experiment, {})
        scan = vedette.Scan(time, "north", vedette.Detections.of([[time, 1.0]]))
        recorder.write(Taken(scan, (), state))
        recorder.flush()
        recorder.close()
        return record.read_bytes().splitlines(keepends=True)

    head, first = record_scan(0.0)
    *_, second = record_scan(1.0)
    whole = head + first
    for cut in {*range(0, len(whole), 9), len(head) - 1, len(head), len(whole) - 1, len(whole)}:
        record.write_bytes(whole[:cut])
        kept = [head, *[first] * (cut == len(whole))]
        assert record_scan(1.0) == [*kept, second], cut


def test_scans_that_were_dropped_stand_in_the_record(tmp_path: Path) -> None:
    record = tmp_path / "record.jsonl"
    config = {**TRACKER, "inputs": [feed()], "service": {"queue": 50, "full": "drop", "record": str(record)}}
    running = made(config, [])
    (given,) = running.service.parts.inputs
    for message in given.format.decode(given.format.start(), b"".join(lines(80))).messages:
        for formed in running.listening.groupers[0].add(message, 5.0):
            running.listening.put(formed, given)
    running.run()
    counts = running.counters.counts
    assert (counts["scans_taken_total"], counts["scans_dropped_total"]) == (50, 30)
    assert running.ails == {}
    recording, _ = read_recording(record)
    assert (len(recording.scans), len(recording.refused)) == (50, 30)
    assert as_json(replayed(record, TRACKER)) == as_json(running.state)


POLAR = {
    "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.05}},
    "sensors": {
        "radar": {"kind": "cartesian_position", "sigma": 20.0, "detection_probability": 0.9, "clutter_density": 2e-7}
    },
    "preprocessors": {
        "radar": {
            "kind": "unbiased_conversion",
            "sensors": {"plots": {"kind": "range_bearing", "sigma_range": 8.0, "sigma_bearing": "0.5 deg"}},
        }
    },
    "associator": {"kind": "jpda"},
    "birth": {"kind": "from_returns", "spread": {"vx": 4.0, "vy": 4.0}},
    "lifecycle": {"kind": "existence", "lifetime": "10 min", "confirm": 0.99, "delete": 0.01},
}


def polar(count: int) -> list[dict[str, Any]]:
    rng, out = np.random.default_rng(7), []
    for k in range(count):
        x, y = 900.0 + 6.0 * k, 400.0 - 4.0 * k
        z = [[float(np.hypot(x, y) + rng.normal(0, 8)), float(np.arctan2(y, x) + rng.normal(0, 0.008))]]
        out.append({"time": 1.5 * k, "sensor": "plots", "z": z})
    return out


def test_preprocessors_make_what_the_tracker_takes_as_in_a_run(tmp_path: Path) -> None:
    told = polar(40)
    told[12], told[13] = told[13], told[12]
    record = tmp_path / "record.jsonl"
    config = {**POLAR, "inputs": [feed()], "service": {"horizon": "5 s", "record": str(record)}}
    running = ran(config, tuple(Arrival(json.dumps(each).encode(), each["time"]) for each in told))
    raw = vedette.load(POLAR).preprocessors["radar"].sensors["plots"].measurement
    path = tmp_path / "raw.jsonl"
    scans = tuple(Scan(each["time"], "plots", vedette.Detections.of(each["z"], 2)) for each in polar(40))
    write_recording(path, vedette.Recording(scans), {"plots": raw})
    expected = replayed(path, POLAR)
    assert as_json(running.state) == as_json(expected)
    assert as_json(replayed(record, POLAR)) == as_json(expected)
    assert running.counters.counts["scans_taken_total"] == 40
    assert expected.confirmed.any()
