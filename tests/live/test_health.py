"""The health of a service over HTTP: who asks and goes away is no error."""

from __future__ import annotations

import socket
import struct
from threading import Event
from threading import enumerate as threads

import pytest

from support.services import PATIENCE, free_port
from vedette_live.health import Health


def test_who_asks_and_does_not_wait_for_the_answer_leaves_nothing_in_the_log(capfd: pytest.CaptureFixture[str]) -> None:
    asked, gone = Event(), Event()

    def metrics() -> str:
        asked.set()
        assert gone.wait(PATIENCE)
        return "x" * 10**7

    health = Health(port := free_port(), metrics, str)
    here = socket.create_connection(("127.0.0.1", port), timeout=PATIENCE)
    here.sendall(f"GET /metrics HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n".encode())
    assert asked.wait(PATIENCE)
    here.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # closed as who has no more time does
    here.close()
    gone.set()
    health.close()
    for answering in [thread for thread in threads() if "process_request" in thread.name]:
        answering.join(PATIENCE)
    assert capfd.readouterr().err == ""
