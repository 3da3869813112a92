"""Whole services on loopback: what comes in is counted, tracked, sent, recorded and answered."""

from __future__ import annotations

import json
import socket
import urllib.error
import urllib.request
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from threading import Thread
from time import monotonic, sleep
from typing import Any

import numpy as np
import pytest

import vedette
from vedette import ConfigError
from vedette_live.config import load_service
from vedette_live.running import Running

TRACKER: Mapping[str, Any] = {
    "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.05}},
    "sensors": {
        "north": {"kind": "cartesian_position", "sigma": 8.0, "detection_probability": 0.9, "clutter_density": 2e-7},
        "south": {"kind": "cartesian_position", "sigma": 15.0, "detection_probability": 0.9, "clutter_density": 2e-7},
    },
    "associator": {"kind": "jpda"},
    "birth": {"kind": "from_returns", "spread": {"vx": 4.0, "vy": 4.0}},
    "lifecycle": {"kind": "existence", "lifetime": "10 min", "confirm": 0.99, "delete": 0.01},
}


def free_port(kind: int = socket.SOCK_STREAM) -> int:
    with socket.socket(socket.AF_INET, kind) as here:
        here.bind(("127.0.0.1", 0))
        return int(here.getsockname()[1])


def lines(count: int = 80) -> list[bytes]:
    rng = np.random.default_rng(3)
    start, velocity = np.array([[-800.0, -400.0], [600.0, -900.0]]), np.array([[4.0, 2.0], [-2.0, 4.0]])
    out = []
    for k in range(count):
        places = start + 1.5 * k * velocity
        z = [list(place + rng.normal(0, 8, 2)) for place in places if rng.random() < 0.9]
        told = {"time": 1.5 * k, "sensor": ("south", "north")[k % 2], "z": z, "n": k}
        out.append(json.dumps(told).encode() + b"\n")
    return out


@contextmanager
def served(config: Mapping[str, Any]) -> Iterator[Running]:
    """Run a service in a thread; it has ended when this does."""
    running = Running(load_service(config))
    failed = list[BaseException]()

    def run() -> None:
        try:
            running.run()
        except BaseException as error:
            failed.append(error)

    thread = Thread(target=run, daemon=True)
    thread.start()
    try:
        yield running
    finally:
        running.stop.set()
        thread.join(10.0)
        assert not thread.is_alive()
    if failed:
        raise failed[0]


def wait_for(what: Any, timeout: float = 20.0) -> None:
    end = monotonic() + timeout
    while not what():
        assert monotonic() < end, "it did not happen in time"
        sleep(0.01)


def connected(port: int) -> socket.socket:
    """Return a connection, as soon as the service takes one."""
    end = monotonic() + 20.0
    while True:
        try:
            return socket.create_connection(("127.0.0.1", port), timeout=10.0)
        except OSError:
            assert monotonic() < end
            sleep(0.02)


def test_a_file_through_a_service_gives_the_tracks_of_the_library_and_a_record_that_replays(tmp_path: Path) -> None:
    stream = tmp_path / "stream.jsonl"
    shuffled = lines()
    shuffled[10], shuffled[11] = shuffled[11], shuffled[10]
    stream.write_bytes(b"".join(shuffled) + b"{half a line")
    config = {
        **TRACKER,
        "inputs": [{"input": {"kind": "file", "path": str(stream), "follow": False}, "format": {"kind": "json_lines"}}],
        "outputs": [{"output": {"kind": "file", "path": str(tmp_path / "out")}, "format": {"kind": "json_lines"}}],
        "service": {"horizon": "5 s", "record": str(tmp_path / "record.jsonl")},
    }
    with served(config) as running:
        wait_for(lambda: not running.stop.is_set() and running.counters.counts["scans_taken_total"] == 80)
    counts = running.counters.counts
    assert (counts["messages_total"], counts["messages_taken_total"], counts["messages_refused_total"]) == (81, 80, 1)
    tracker = vedette.build(TRACKER)
    state = tracker.start(seed=np.random.SeedSequence(0).spawn(2)[1])
    for line in lines():
        told = json.loads(line)
        state = tracker.step(state, vedette.Scan(told["time"], told["sensor"], vedette.Detections.of(told["z"], 2)))
    assert running.state is not None
    np.testing.assert_array_equal(running.state.ids, state.ids)
    np.testing.assert_array_equal(running.state.belief.mean, state.belief.mean)
    replayed = vedette.load({**TRACKER, "source": {"kind": "jsonl", "path": str(tmp_path / "record.jsonl")}}).run()
    assert {track.id for track in replayed.tracks} >= set(state.ids[state.confirmed].tolist())
    at_end = {track.id: track.mean[-1] for track in replayed.tracks}
    for i in np.flatnonzero(state.confirmed):
        np.testing.assert_array_equal(at_end[int(state.ids[i])], tracker.estimate(state).mean[i])
    last = json.loads((tmp_path / "out").read_bytes().splitlines()[-1])
    assert last["time"] == state.time
    assert {track["id"] for track in last["tracks"]} == set(state.ids[state.confirmed].tolist())


def test_datagrams_are_tracked_sent_on_and_counted() -> None:
    port, back, health = free_port(socket.SOCK_DGRAM), free_port(), free_port()
    config = {
        **TRACKER,
        "inputs": [{"input": {"kind": "udp", "port": port}, "format": {"kind": "json_lines"}}],
        "outputs": [{"output": {"kind": "tcp_server", "port": back}, "format": {"kind": "json_lines"}, "confirmed": False}],
        "service": {"port": health},
    }
    with served(config) as running, connected(back) as reader, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as here:
        wait_for(lambda: running._sinks)
        for line in [*lines(20), b"nonsense"]:
            here.sendto(line, ("127.0.0.1", port))
            sleep(0.005)
        wait_for(lambda: running.counters.counts["messages_total"] == 21)
        wait_for(lambda: running.counters.counts["scans_taken_total"] == 20)
        with reader.makefile("rb") as told:
            reports = [json.loads(told.readline()) for _ in range(3)]
        assert [report["number"] for report in reports] == sorted({report["number"] for report in reports})
        page = urllib.request.urlopen(f"http://127.0.0.1:{health}/metrics", timeout=5).read().decode()
        assert "vedette_scans_taken_total 20\n" in page
        assert urllib.request.urlopen(f"http://127.0.0.1:{health}/health", timeout=5).status == 200
        stranger = urllib.request.Request(f"http://127.0.0.1:{health}/metrics", headers={"Host": "evil.example"})
        with pytest.raises(urllib.error.HTTPError):
            urllib.request.urlopen(stranger, timeout=5)
    counts = running.counters.counts
    assert counts["messages_refused_total"] == 1
    parts = ("taken", "refused", "dropped")
    assert counts["messages_total"] == sum(counts[f"messages_{part}_total"] for part in parts)


def test_numbered_messages_are_answered_once_taken_or_refused() -> None:
    port = free_port()
    config = {**TRACKER, "inputs": [{"input": {"kind": "tcp_server", "port": port}, "format": {"kind": "json_lines"}}]}
    with served(config) as running, connected(port) as here, here.makefile("rb") as told:
        for line in lines(10):
            here.sendall(line)
        answered = set()
        while answered != {("north", 9), ("south", 8)}:
            answer = json.loads(told.readline())
            answered = {each for each in answered if each[0] != answer["sensor"]} | {(answer["sensor"], answer["ack"])}
        here.sendall(lines(10)[9])  # sent again, as a sender does whose answer was lost
        assert json.loads(told.readline()) == {"ack": 9, "sensor": "north"}
    assert running.counters.counts["scans_taken_total"] == 10
    assert running.counters.counts["messages_repeated_total"] == 1


def test_a_token_is_asked_for(tmp_path: Path) -> None:
    port, token = free_port(), tmp_path / "token"
    token.write_bytes(b"correct horse battery staple\n")
    config = {
        **TRACKER,
        "inputs": [
            {
                "input": {"kind": "tcp_server", "port": port, "security": {"token_file": str(token)}},
                "format": {"kind": "json_lines"},
            }
        ],
    }
    with served(config) as running:
        with connected(port) as here:
            here.sendall(b"wrong\n" + lines(1)[0])
            assert here.recv(100) == b""
        with connected(port) as here:
            here.sendall(token.read_bytes() + lines(1)[0])
            wait_for(lambda: running.counters.counts["scans_taken_total"] == 1)
    assert running.counters.counts["messages_total"] == 1


def test_when_the_tracker_is_behind_the_oldest_scans_are_dropped_and_counted() -> None:
    port = free_port(socket.SOCK_DGRAM)
    config = {
        **TRACKER,
        "inputs": [{"input": {"kind": "udp", "port": port}, "format": {"kind": "json_lines"}}],
        "service": {"queue": 4},
    }
    running = Running(load_service(config))
    for formed in (running._groupers[0].add(message, 0.0) for message in decoded(running, lines(10))):
        for one in formed:
            running._put(one, running.service.parts.inputs[0])
    assert running.counters.counts["scans_dropped_total"] == 6
    assert running.counters.counts["messages_dropped_total"] == 6
    assert [one.scan.time for one in running._scans.take(10, 0.0)] == [9.0, 10.5, 12.0, 13.5]


def decoded(running: Running, of: list[bytes]) -> list[Any]:
    format_ = running.service.parts.inputs[0].format
    return list(format_.decode(format_.start(), b"".join(of)).messages)


@pytest.mark.parametrize(
    ("changed", "place"),
    [
        ({"inputs": []}, "inputs"),
        ({"source": {"kind": "jsonl", "path": "x"}}, "source"),
        ({"inputs": [{"input": {"kind": "udp"}, "format": {"kind": "json_lines"}}]}, "inputs[0].input.port"),
        ({"inputs": [{"input": {"kind": "udp", "port": 1}, "format": {"kind": "geojson"}}]}, "inputs[0].format"),
        (
            {"inputs": [{"input": {"kind": "udp", "port": 1}, "format": {"kind": "nmea"}, "sensors": {"a": "west"}}]},
            "inputs[0].sensors.a",
        ),
        (
            {"outputs": [{"output": {"kind": "standard_output"}, "format": {"kind": "csv_lines", "columns": ["x"]}}]},
            "outputs",
        ),
        ({"service": {"horizon": -1}}, "service.horizon"),
        ({"retroactive": True}, "retroactive"),
        ({"colour": 3}, "colour"),
    ],
)
def test_what_cannot_be_served_is_told_with_its_place(changed: Mapping[str, Any], place: str) -> None:
    usual = {"inputs": [{"input": {"kind": "standard_input"}, "format": {"kind": "json_lines"}}]}
    with pytest.raises(ConfigError) as refused:
        load_service({**TRACKER, **usual, **changed})
    assert any(problem.place.startswith(place) for problem in refused.value.problems), refused.value


def test_an_input_that_can_never_be_used_ends_the_service_with_its_place() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        config = {**TRACKER, "inputs": [{"input": {"kind": "tcp_server", "port": port}, "format": {"kind": "json_lines"}}]}
        with pytest.raises(vedette.VedetteError, match=r"inputs\[0\]"):
            Running(load_service(config)).run()


def test_a_thousand_slow_connections_hold_nobody_up() -> None:
    port = free_port()
    config = {
        **TRACKER,
        "inputs": [{"input": {"kind": "tcp_server", "port": port, "most": 2000}, "format": {"kind": "json_lines"}}],
    }
    with served(config) as running:
        slow = [connected(port) for _ in range(300)]
        for here in slow:
            here.sendall(b'{"ti')
        with connected(port) as here:
            here.sendall(b"".join(lines(40)))
            wait_for(lambda: running.counters.counts["scans_taken_total"] == 40)
        for here in slow:
            here.close()
    assert running.counters.counts["messages_refused_total"] == 300


def test_a_recorded_stream_is_a_source(tmp_path: Path) -> None:
    (tmp_path / "stream.jsonl").write_bytes(b"".join(lines()) + b"nonsense\n")
    source = {"kind": "stream", "path": str(tmp_path / "stream.jsonl"), "format": {"kind": "json_lines"}}
    result = vedette.load({**TRACKER, "source": source}).run()
    assert len(result.scans) == 80
    assert len(result.tracks) == 2
    assert result.recording.rows["messages"].refused == 1
