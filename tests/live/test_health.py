"""The health of a service: who asks and goes away is no error; a silent sensor is, or an input by which nothing comes."""

from __future__ import annotations

import json
import socket
import struct
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from threading import Event
from threading import enumerate as threads
from typing import Any

import numpy as np
import pytest

from support.services import PATIENCE, TRACKER, connected, feed, free_port, lines, ran, served, wait_for
from vedette.streams import Arrival
from vedette_live import rhythm
from vedette_live.health import Health
from vedette_live.rhythm import LOOKS, MANY, PAUSES, SHORT, Rhythm


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


def well(running: Any) -> bool:
    return 'input_well{input="0"} 1' in running.counters.text()


@pytest.mark.parametrize("kind", ["tcp_client", "file"])
def test_an_input_by_which_nothing_can_come_is_told_until_something_can(
    kind: str, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """The health was well, and of a file that is not there the log said nothing, either."""
    port, path = free_port(), tmp_path / "plots.jsonl"
    given = {"tcp_client": {"port": port, "pause": 0.2}, "file": {"path": str(path), "every": 0.01}}[kind]
    config = {**TRACKER, "inputs": [{"input": {"kind": kind, **given}, "format": {"kind": "json_lines"}}]}
    with served(config) as running:
        wait_for(lambda: {"tcp_client": "refused", "file": str(path)}[kind] in running.ails.get("input 0", ""))
        wait_for(lambda: [record.getMessage() for record in caplog.records] == ["input waits"] and not well(running))
        with closing(socket.create_server(("127.0.0.1", port)) if kind == "tcp_client" else path.open("wb")):
            wait_for(lambda: not running.ails and well(running))  # before anything comes


def came(times: list[float], returns: Callable[[int], int] = lambda i: 3) -> Rhythm:
    """Return what is known of a sensor whose messages came at these times, with so many returns."""
    heard = Rhythm()
    for i, time in enumerate(times):
        heard.hear(time, time, returns(i))
    return heard


def test_of_a_sensor_that_comes_at_a_steady_interval_a_long_silence_is_told() -> None:
    turns = [2.5 * i for i in range(100)]
    assert came(turns).limit == MANY * 2.5
    assert came([time for i, time in enumerate(turns) if i % 6]).limit == MANY * 2.5  # one in six is lost
    assert came(turns, lambda i: 0).limit == MANY * 2.5
    assert came([time + 0.01 * k for time in turns for k in range(9)], lambda i: 1).limit == pytest.approx(
        MANY * 2.5, rel=0.1
    )
    assert came([0.1 * i for i in range(1000)]).limit == SHORT
    assert came(turns[:LOOKS]).limit == np.inf
    batches = Rhythm()
    for i, time in enumerate(turns):
        batches.hear(time, 60.0 * (i // 24), 3)
    assert batches.limit == PAUSES * 60.0


def test_of_a_sensor_that_comes_seldom_or_may_see_one_target_no_silence_is_told() -> None:
    rng = np.random.default_rng(5)
    for _ in range(1000):
        assert came(np.cumsum(rng.exponential(60.0, LOOKS + 1)).tolist()).limit == np.inf
    assert came([4.0 * i for i in range(100)], lambda i: 1).limit == np.inf


@pytest.mark.costly
def test_a_silent_sensor_is_told_by_the_health_and_counted_by_its_name(monkeypatch: pytest.MonkeyPatch) -> None:
    """One of two radars was silent, and all was well. What comes again ends it; nothing is told while we are busy."""
    monkeypatch.setattr(rhythm, "SHORT", 0.5)
    monkeypatch.setattr(rhythm, "MANY", 0.1)
    monkeypatch.setattr(rhythm, "PAUSES", 0.0)
    port = free_port()
    inputs = [{"input": {"kind": "tcp_server", "port": port}, "format": {"kind": "json_lines"}}]
    names, told = ("north", "south"), lines(140)
    with served({**TRACKER, "inputs": inputs}) as running, connected(port) as sender:
        sender.sendall(b"".join(told[:100]))
        wait_for(lambda: [name for name in names if f"'{name}'" in "".join(running.ails)] == [*names])
        sender.sendall(told[101])
        wait_for(lambda: len(running.ails) == 1)
        (name,) = running.ails
        assert "'south'" in name
        text = running.counters.text()
        assert 'vedette_sensor_scans_total{sensor="north"} 51' in text
        assert 'vedette_input_messages_total{input="0"} 101' in text
        monkeypatch.setattr(rhythm, "LATE", -1.0)  # as if each look were late
        wait_for(lambda: not running.ails)


def test_who_names_objects_may_be_silent() -> None:
    """A receiver of AIS hears nothing where no ship is."""
    told = [{**json.loads(line), "n": None} for line in lines(100)]
    named = [{**each, "identity": [7] * len(each["z"])} for each in told]
    for each, known in ((told, 2), (named, 0)):
        running = ran({**TRACKER, "inputs": [feed()]}, [Arrival(json.dumps(line).encode(), 0.0) for line in each])
        assert (running.counters.counts["scans_taken_total"], len(running.listening.rhythms.known)) == (100, known)
