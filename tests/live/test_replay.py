"""`vedette replay` sends all of a recording, whatever is answered."""

from __future__ import annotations

import socket
from pathlib import Path
from threading import Thread
from time import sleep

import numpy as np
import pytest

from support.services import PATIENCE
from vedette import Detections, Recording, Scan
from vedette.cli import main
from vedette_files import code, write_recording
from vedette_live.formats.json_lines import JsonLines
from vedette_live.grouping import Grouper, Grouping
from vedette_live.placing import Placing
from vedette_standard.sensors.partial import Partial
from vedette_standard.sensors.range_bearing_rate import RangeBearingRate


def test_what_a_slow_reader_has_not_taken_yet_arrives_though_it_answered(tmp_path: Path) -> None:
    """A connection that is closed with an answer unread throws away what waits to be sent."""
    scans, z = 300, [[1234.5, float(i)] for i in range(200)]
    head = '{"format": "vedette", "version": 1, "sensors": {"radar": {"x": "m", "y": "m"}}}\n'
    lines = [f'{{"time": {k}, "sensor": "radar", "z": {z}}}\n' for k in range(scans)]
    (tmp_path / "recording.jsonl").write_text("".join([head, *lines]))
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
