"""`vedette replay` sends all of a recording, whatever is answered."""

from __future__ import annotations

import socket
from pathlib import Path
from threading import Thread
from time import sleep

from support.services import PATIENCE
from vedette.cli import main


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
