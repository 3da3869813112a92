"""`vedette replay` sends all of a recording, whatever is answered."""

from __future__ import annotations

import json
import socket
from pathlib import Path
from threading import Thread
from time import sleep

import numpy as np
import pytest

import vedette
from support.services import PATIENCE, TRACKER, feed, lines, ran
from vedette import Detections, Recording, Scan
from vedette.cli import main
from vedette.streams import Arrival
from vedette_files import FRAMES, NORTH_EAST, Terms, code, write_recording
from vedette_live.formats.json_lines import JsonLines
from vedette_live.grouping import Grouper, Grouping
from vedette_live.placing import Placing
from vedette_live.reports import report_of
from vedette_standard.sensors.partial import Partial
from vedette_standard.sensors.range_bearing_rate import RangeBearingRate


@pytest.mark.costly
def test_what_a_slow_reader_has_not_taken_yet_arrives_though_it_answered(tmp_path: Path) -> None:
    """A connection that is closed with an answer unread throws away what waits to be sent."""
    scans, z = 300, [[1234.5, float(i)] for i in range(200)]
    head = '{"format": "vedette", "version": 1, "sensors": {"radar": {"x": "m", "y": "m"}}}\n'
    told = [f'{{"time": {k}, "sensor": "radar", "z": {z}}}\n' for k in range(scans)]
    (tmp_path / "recording.jsonl").write_text("".join([head, *told]))
    came = list[bytes]()
    with socket.create_server(("127.0.0.1", 0)) as server:

        def read() -> None:
            here, _ = server.accept()
            with here, here.makefile("rb") as stream:
                here.settimeout(PATIENCE)
                here.sendall(b'{"ack": 0}\n' * 10)
                sleep(1.0)
                came.extend(stream)

        reader = Thread(target=read)
        reader.start()
        to = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        assert main(["replay", str(tmp_path / "recording.jsonl"), "--to", to, "--speed", "max"]) == 0
        reader.join(PATIENCE)
    assert len(came) == scans
    assert b'"n": 299' in came[-1]


def test_a_recording_whose_x_points_north_is_at_the_same_place_in_a_run_and_served(
    tmp_path: Path, capfdbinary: pytest.CaptureFixture[bytes]
) -> None:
    """It was served mirrored: a replay did not tell where x points, and a service could not be told."""
    notes = {"origin": "59.0, 10.0", "frame": NORTH_EAST}
    scans = tuple(Scan(1.5 * k, "north", Detections.of([[3000.0 + k, 400.0]])) for k in range(9))
    spaces = {"north": vedette.build(TRACKER).sensors["north"].measurement}
    write_recording(tmp_path / "r.jsonl", Recording(scans, notes=notes), spaces)
    assert main(["replay", str(tmp_path / "r.jsonl"), "--speed", "max"]) == 0
    sent, told = capfdbinary.readouterr()
    assert told == b""
    service = {"origin": {"latitude": 59.0, "longitude": 10.0}}
    config = {**TRACKER, "inputs": [feed()]}
    running = ran({**config, "service": {**service, "frame": NORTH_EAST}}, [Arrival(sent, 1e6)])
    result = vedette.load({**TRACKER, "source": {"kind": "jsonl", "path": str(tmp_path / "r.jsonl")}}).run()
    place = Terms.of(result.recording.notes).values(result.tracks[0])
    assert running.state is not None
    report = report_of(running.service, running.state)
    assert report.geodetic is not None
    served = [float(one[0]) for one in report.geodetic(report.mean)[:2]]
    assert served == [place["latitude"][-1], place["longitude"][-1]]
    assert ran({**config, "service": service}, [Arrival(sent, 1e6)]).counters.counts["messages_refused_total"] == 9
    write_recording(tmp_path / "r.jsonl", Recording(scans), spaces)
    assert main(["replay", str(tmp_path / "r.jsonl"), "--speed", "max"]) == 0
    sent, told = capfdbinary.readouterr()
    assert b"frame" not in sent
    assert b"x and y point" in told


def test_a_record_and_the_one_begun_beside_it_are_sent_to_one_service(
    tmp_path: Path, capfdbinary: pytest.CaptureFixture[bytes]
) -> None:
    """Sent alone, the second counted from 0 again: a service refused 30 of 60."""
    config, told = {**TRACKER, "inputs": [feed()]}, lines(60)
    for frame, part in ((FRAMES[0], told[:30]), (NORTH_EAST, told[30:])):
        service = {"record": str(tmp_path / "r.jsonl"), "frame": frame, "origin": {"latitude": 59.0, "longitude": 10.0}}
        ran({**config, "service": service}, [Arrival(line, 1e6) for line in part])
    files = [str(tmp_path / name) for name in ("r.jsonl", "r-2.jsonl")]
    assert main(["replay", *files, "--speed", "max"]) == 0
    sent = [json.loads(line) for line in capfdbinary.readouterr().out.splitlines()]
    assert [line["n"] for line in sent] == list(range(60))
    assert [line["time"] for line in sent] == [json.loads(line)["time"] for line in told]
    assert [line["frame"] for line in sent] == [FRAMES[0]] * 30 + [NORTH_EAST] * 30


def test_what_a_recording_says_of_returns_is_taken_as_it_was(
    tmp_path: Path, capfdbinary: pytest.CaptureFixture[bytes]
) -> None:
    """Numbers of ships, null of none, and errors of returns that lack a component were refused, their times passed over."""
    noise, lacks = np.tile(np.diag([4.0, 1e-4, np.nan]), (3, 1, 1)), np.tile([False, False, True], (3, 1))
    z, names = np.tile([100.0, 0.5, np.nan], (3, 1)), np.array([257000123, -1, code("N7")])
    doppler = RangeBearingRate(5.0, 0.01, 1.0)
    times = np.array([0.1, 0.7, 1.0])
    seen = Detections(z, np.ones(3, dtype=bool), noise=noise, missing=lacks, identity=names, time=times)
    write_recording(tmp_path / "r.jsonl", Recording((Scan(1.0, "radar", seen),)), {"radar": doppler.measurement})
    assert main(["replay", str(tmp_path / "r.jsonl"), "--to", "-", "--speed", "max"]) == 0
    decoded = JsonLines().decode(JsonLines().start(), capfdbinary.readouterr().out)
    assert [message.refused for message in decoded.messages] == [""]
    placing = Placing({"radar": Partial(doppler, optional={"range_rate": 60.0})}, {}, None)
    (formed,) = Grouper(Grouping(), placing).add(decoded.messages[0], 1.0)
    came = formed.scan.detections
    for one, other in ((came.z, z), (came.missing, lacks), (came.identity, names), (came.time, times)):
        np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(np.asarray(came.noise)[:, :2, :2], noise[:, :2, :2])
