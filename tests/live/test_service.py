"""Whole services on loopback: what comes in is counted, tracked, sent, recorded and answered."""

from __future__ import annotations

import json
import logging
import resource
import socket
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator, Mapping
from functools import reduce
from operator import xor
from pathlib import Path
from threading import Thread
from time import sleep
from typing import Any

import numpy as np
import pytest
from attrs import evolve

import vedette
from support.services import (
    PATIENCE,
    TRACKER,
    Scripted,
    as_json,
    connected,
    feed,
    free_port,
    lines,
    made,
    ran,
    reach,
    served,
    undisturbed,
    wait_for,
)
from vedette import ConfigError
from vedette.streams import Arrival, now
from vedette_live import log
from vedette_live.config import load_service
from vedette_live.inputs import files
from vedette_live.keeping import TOGETHER
from vedette_live.running import Running
from vedette_live.window import Window
from vedette_standard.lifecycles.existence import Existence
from vedette_standard.motion.constant_velocity import ConstantVelocity

LINES = {"kind": "csv_lines", "columns": ["time", "x", "y"]}


def test_a_service_whose_plugin_gives_nan_stops_and_says_whose(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As where a method raises: it went on, wrote {"x": NaN} and ended with 0."""
    stream = tmp_path / "stream.jsonl"
    stream.write_bytes(b"".join(lines()))

    def noise(self: ConstantVelocity, x: np.ndarray, dt: float) -> np.ndarray:
        return np.full((4, 4), np.nan)

    monkeypatch.setattr(ConstantVelocity, "noise", noise)
    (tmp_path / "out").touch()  # it may end before its output begins
    config = {
        **TRACKER,
        "inputs": [
            {
                "input": {"kind": "file", "path": str(stream), "follow": False},
                "format": {"kind": "json_lines"},
            }
        ],
        "outputs": [{"output": {"kind": "file", "path": str(tmp_path / "out")}, "format": {"kind": "json_lines"}}],
    }
    with pytest.raises(vedette.PluginError, match=r"ConstantVelocity\).noise must return .*nan"):
        Running(load_service(config)).run()
    assert b"NaN" not in (tmp_path / "out").read_bytes()


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
        counts = running.counters.counts
        wait_for(lambda: (counts["scans_taken_total"], counts["messages_total"]) == (80, 81))
    assert (counts["messages_total"], counts["messages_taken_total"], counts["messages_refused_total"]) == (81, 80, 1)
    tracker, state = vedette.build(TRACKER), undisturbed(lines())
    assert as_json(running.state) == as_json(state)
    replayed = vedette.load({**TRACKER, "source": {"kind": "jsonl", "path": str(tmp_path / "record.jsonl")}}).run()
    assert {track.id for track in replayed.tracks} >= set(state.ids[state.confirmed].tolist())
    at_end = {track.id: track.mean[-1] for track in replayed.tracks}
    for i in np.flatnonzero(state.confirmed):
        np.testing.assert_array_equal(at_end[int(state.ids[i])], tracker.estimate(state).mean[i])
    last = json.loads((tmp_path / "out").read_bytes().splitlines()[-1])
    assert last["time"] == state.time
    assert {track["id"] for track in last["tracks"]} == set(state.ids[state.confirmed].tolist())


def test_datagrams_are_tracked_sent_on_and_counted() -> None:
    port, back, health = free_port(), free_port(), free_port()
    config = {
        **TRACKER,
        "inputs": [{"input": {"kind": "udp", "port": port}, "format": {"kind": "json_lines"}}],
        "outputs": [{"output": {"kind": "tcp_server", "port": back}, "format": {"kind": "json_lines"}, "confirmed": False}],
        "service": {"port": health},
    }
    with served(config) as running, connected(back) as reader, reach(running, port) as here:
        counts, got = running.counters.counts, b""
        reader.settimeout(0.05)
        for sent, line in enumerate(lines(80), 1):
            here.send(line)
            wait_for(lambda sent=sent: counts["scans_taken_total"] == sent)  # type: ignore[misc]
            try:
                got += reader.recv(2**16)
            except TimeoutError:
                continue  # the reader is not yet known to the output
            if got.count(b"\n") > 2:
                break
        here.send(b"nonsense")
        wait_for(lambda: counts["messages_total"] == sent + counts["messages_refused_total"])
        wait_for(lambda: counts["messages_refused_total"] == counts["pieces_total"] - sent)
        numbers = [json.loads(told)["number"] for told in got.split(b"\n")[:-1]]
        assert len(numbers) > 2
        assert numbers == sorted(set(numbers))
        page = urllib.request.urlopen(f"http://127.0.0.1:{health}/metrics", timeout=60).read().decode()
        assert f"vedette_scans_taken_total {sent}\n" in page
        assert urllib.request.urlopen(f"http://127.0.0.1:{health}/health", timeout=60).status == 200
        stranger = urllib.request.Request(f"http://127.0.0.1:{health}/metrics", headers={"Host": "evil.example"})
        with pytest.raises(urllib.error.HTTPError):
            urllib.request.urlopen(stranger, timeout=60)
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


@pytest.mark.costly
def test_who_sends_no_more_is_answered_to_the_end(tmp_path: Path) -> None:
    """As `nc -N` does, which then reads to the end."""
    port = free_port()
    config = {
        **TRACKER,
        "inputs": [{"input": {"kind": "tcp_server", "port": port, "most": 2}, "format": {"kind": "json_lines"}}],
        "service": {"store": {"kind": "sqlite", "path": str(tmp_path / "state.sqlite")}, "save": 1.0},
    }
    with served(config) as running:
        for count, line in enumerate(lines(3)):  # connections that have ended take no place of others
            with connected(port) as here:
                here.sendall(line)
            wait_for(lambda count=count: running.counters.counts["pieces_total"] == 2 * count + 2)  # type: ignore[misc]
        with connected(port) as here, here.makefile("rb") as told:
            here.sendall(b"".join(lines(10)))
            here.shutdown(socket.SHUT_WR)
            answers = {answer["sensor"]: answer["ack"] for answer in map(json.loads, told)}
        assert answers == {"north": 9, "south": 8}
        with connected(port) as here:
            here.sendall(b"{}\n")
            here.shutdown(socket.SHUT_WR)
            assert here.recv(10) == b""  # it has no numbers, and waits for nothing


@pytest.mark.costly
def test_a_server_that_sends_no_more_is_answered_to_the_end(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        given = {"kind": "tcp_client", "port": server.getsockname()[1]}
        config = {
            **TRACKER,
            "inputs": [{"input": given, "format": {"kind": "json_lines"}}],
            "service": {"store": {"kind": "sqlite", "path": str(tmp_path / "state.sqlite")}, "save": 1.0},
        }
        server.settimeout(PATIENCE)
        with served(config):
            with server.accept()[0] as here, here.makefile("rb") as told:
                here.settimeout(PATIENCE)
                here.sendall(b"".join(lines(10)))
                here.shutdown(socket.SHUT_WR)
                answers = {answer["sensor"]: answer["ack"] for answer in map(json.loads, told)}
            assert answers == {"north": 9, "south": 8}
            server.accept()[0].close()  # it comes again


def test_numbered_markers_are_answered_once_what_came_before_is_kept() -> None:
    """A sender of marks alone, as of a radar that sees nothing, was never answered."""
    port = free_port()
    config = {
        **TRACKER,
        "inputs": [
            {
                "input": {"kind": "tcp_server", "port": port},
                "format": {"kind": "json_lines"},
                "scans": {"by": "turn", "wait": "1 h", "length": "1 h"},
            }
        ],
    }
    told = [
        {"marker": "sector"},
        {"marker": "north"},
        {"z": [[1, 2]]},
        {"marker": "sector"},
        {"marker": "north"},
        {"marker": "north"},
    ]
    with served(config), connected(port) as here, here.makefile("rb") as answers:

        def send(k: int) -> None:
            here.sendall(json.dumps({"time": float(k), "sensor": "north", "n": k, **told[k]}).encode() + b"\n")

        for k in (0, 1):
            send(k)
            assert json.loads(answers.readline())["ack"] == k
        for k in (2, 3, 4):
            send(k)
        assert json.loads(answers.readline())["ack"] == 4
        send(5)
        assert json.loads(answers.readline())["ack"] == 5


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


def test_when_the_tracker_is_behind_the_oldest_scans_are_dropped_counted_and_told(caplog: pytest.LogCaptureFixture) -> None:
    port = free_port()
    config = {
        **TRACKER,
        "inputs": [{"input": {"kind": "udp", "port": port}, "format": {"kind": "json_lines"}}],
        "service": {"queue": 4},
    }
    running = Running(load_service(config))
    for formed in (running.listening.groupers[0].add(message, 0.0) for message in decoded(running, lines(10))):
        for one in formed:
            running.listening.put(one, running.service.parts.inputs[0])
    assert running.counters.counts["scans_dropped_total"] == 6
    assert running.counters.counts["messages_dropped_total"] == 6
    assert list(running.ails) == ["tracker"]
    assert [record.getMessage() for record in caplog.records] == ["scan dropped"]
    assert [one.scan.time for one in running.listening.scans.take(10, 0.0)] == [9.0, 10.5, 12.0, 13.5]


def test_a_tracker_that_is_a_minute_behind_is_told_by_the_health(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever sends by a connection waits, and nothing is dropped: with tracks ten minutes late, all seemed well."""
    behind = list[str]()

    class Ails(dict[str, str]):
        def __setitem__(self, name: str, told: str) -> None:
            behind.append(f"{name}: {told}")

    monkeypatch.setattr("vedette_live.running.now", lambda: 100.0)
    for arrived in (41.0, 39.0):
        running = made({**TRACKER, "inputs": [feed()]}, [Arrival(lines(1)[0], arrived)])
        running.ails = running.listening.ails = Ails()
        running.run()
    assert behind == ["tracker: it is 61 s behind"]


@pytest.mark.parametrize(("first", "step"), [(0.0, 1500.0), (1.8e12, 1500.0)])
def test_times_in_ms_are_told_by_the_health_and_the_log(first: float, step: float, caplog: pytest.LogCaptureFixture) -> None:
    """Relative ones were taken, and no track was confirmed, as all returns were half an hour apart."""
    told = [Arrival(b'{"sensor": "north", "time": %f, "z": []}' % (first + step * k), 1.8e9 + 1.5 * k) for k in range(15)]
    running = ran({**TRACKER, "inputs": [feed(scans={"leap": "1 h"})]}, told)
    assert "in ms" in running.ails["clock of 'north'"]
    assert caplog.messages.count("clock") == 1


def test_each_kind_of_refusal_is_told_at_once_and_the_others_counted(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All refusals within ten seconds were told as one, and those after the first never."""
    wrong = [b'{"n": 6', b'{"sensor": "nroth", "z": []}', b'{"sensor": "north", "z": [[1, 2, 3]]}', b"\xff"]
    again = [b'{"sensor": "nrth", "z": []}', b'{"sensor": "south", "z": [[1, 2, 3, 4]]}', *wrong[:1] * 3]

    def arrivals() -> Iterator[Arrival]:
        yield from (Arrival(line, 0.0) for line in [*wrong, *again])
        wait_for(lambda: len(lines_of("message refused")) == 7)
        yield Arrival(wrong[1], 0.0)

    def lines_of(event: str) -> list[dict[str, Any]]:
        return [vars(record) for record in caplog.records if record.getMessage() == event]

    with caplog.at_level(logging.INFO, "vedette.live"):
        monkeypatch.setattr(log, "_QUIET", 0.5)
        running = ran({**TRACKER, "inputs": [feed()]}, arrivals())
    told = lines_of("message refused")
    assert len({each["why"] for each in told[:4]}) == 4
    assert [each["more"] for each in told] == [0, 0, 0, 0, 2, 0, 0, 0]
    assert len(told) + sum(each["more"] for each in told) == running.counters.counts["messages_refused_total"] == 10
    (end,) = lines_of("stopped")
    assert (end["scans_taken"], end["messages_refused"]) == (0, 10)


def test_a_return_that_is_left_out_is_counted_and_told_once(caplog: pytest.LogCaptureFixture) -> None:
    """Its scan was taken without it, and nobody heard of that."""
    told = [b'{"sensor": "north", "time": 3, "z": [[NaN, 0], [0, 0]]}', b'{"sensor": "north", "time": 2, "z": []}']

    def arrivals() -> Iterator[Arrival]:
        yield Arrival(told[0], 0.0)
        wait_for(lambda: "return left out" in caplog.messages)
        yield Arrival(told[1], 0.0)

    running = ran({**TRACKER, "inputs": [feed()], "service": {"horizon": "5 s"}}, arrivals())
    counts = running.counters.counts
    assert [counts[f"{name}_total"] for name in ("scans_taken", "scans_stepped_again", "returns_left_out")] == [2, 1, 1]
    assert caplog.messages.count("return left out") == 1


def test_reasons_without_end_do_not_fill_the_log(caplog: pytest.LogCaptureFixture) -> None:
    sparing = log.Sparing("input 0")
    for i in range(1000):
        sparing.warn("message refused", f"{chr(0x4E00 + i)} is not known", "")
    assert len(caplog.records) == log.KINDS + 1
    sparing.tell(last=True)
    assert sum(vars(record)["more"] + 1 for record in caplog.records) == 1000


def test_a_stop_is_told(caplog: pytest.LogCaptureFixture) -> None:
    heard = {"input": {"kind": "udp", "port": free_port()}, "format": {"kind": "json_lines"}}
    with caplog.at_level(logging.INFO, "vedette.live"), served({**TRACKER, "inputs": [heard]}) as running:
        wait_for(lambda: "serving" in caplog.messages)
        running.stop.set()
        wait_for(lambda: "stopped" in caplog.messages)
    assert caplog.messages == ["serving", "stopping", "stopped"]


def test_a_stop_is_told_where_its_inputs_end_at_once(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    running = made({**TRACKER, "inputs": [feed()]}, [])
    queue = type(running.listening.scans)
    take = queue.take

    def stopped(*given: Any) -> Any:
        formed = take(*given)
        running.stop.set()
        return formed

    monkeypatch.setattr(queue, "take", stopped)
    with caplog.at_level(logging.INFO, "vedette.live"):
        running.run()
    assert caplog.messages == ["serving", "stopping", "stopped"]


def test_what_a_stop_cuts_is_no_faulty_message(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a file that is read in pieces a line was told to be cut short, and counted as refused."""
    (tmp_path / "plots").write_bytes(b"".join(lines()))
    monkeypatch.setattr(files, "PIECE", 1000)
    read = {"input": {"kind": "file", "path": str(tmp_path / "plots")}, "format": {"kind": "json_lines"}}
    running = Running(load_service({**TRACKER, "inputs": [read]}))
    put = running.listening.put

    def stopped(*given: Any) -> None:
        put(*given)
        running.stop.set()

    monkeypatch.setattr(type(running.listening), "put", lambda self, *given: stopped(*given))
    running.run()
    counts = running.counters.counts
    assert (counts["messages_total"], counts["messages_refused_total"]) == (counts["messages_taken_total"], 0)
    assert 0 < counts["messages_taken_total"] < 80


def test_a_service_that_is_asked_twice_to_stop_drops_what_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    """With 1,000 scans that wait for a slow tracker, nothing but SIGKILL ended it. Both words of one Ctrl-C are one."""
    running = made({**TRACKER, "inputs": [feed()]}, [Arrival(line, 0.0) for line in lines(200)])
    take = Window.take

    def slow(window: Window, formed: Any) -> Any:
        for _ in range(2):
            running.end()
        assert not running.hurried.is_set()
        wait_for(lambda: running.counters.counts["messages_total"] == 200)
        with monkeypatch.context() as later:
            later.setattr("vedette_live.running.now", lambda: now() + 2.0)
            running.end()
        return take(window, formed)

    monkeypatch.setattr(Window, "take", slow)
    running.run()
    counts = running.counters.counts
    assert counts["scans_taken_total"] <= TOGETHER
    assert counts["scans_taken_total"] + counts["scans_dropped_total"] == 200


def test_what_is_answered_is_not_dropped() -> None:
    """Whoever has a connection, and numbers what it sends, waits for room: "kept" would be told of what was dropped."""
    running = Running(load_service({**TRACKER, "inputs": [feed()], "service": {"queue": 4, "full": "drop"}}))
    (waits,) = running.service.parts.inputs
    drops = evolve(waits, input=Scripted(()))
    running.listening.numbers.replies["waits"] = lambda _: None
    messages = decoded(running, lines(10))
    for message, stream, to in [(m, "waits", waits) for m in messages[:3]] + [(m, "drops", drops) for m in messages[3:]]:
        for formed in running.listening.groupers[0].add(message, 0.0, stream):
            running.listening.put(formed, to)
    assert running.counters.counts["scans_dropped_total"] == 6
    (late,) = running.listening.groupers[0].add(messages[9], 0.0, "waits")
    thread = Thread(target=running.listening.put, args=(late, waits), daemon=True)
    thread.start()
    thread.join(0.1)
    assert thread.is_alive()
    assert [one.scan.time for one in running.listening.scans.take(10, 0.0)] == [0.0, 1.5, 3.0, 13.5]
    thread.join(PATIENCE)
    assert [one.scan.time for one in running.listening.scans.take(10, 0.0)] == [13.5]


def test_reports_that_nobody_took_are_counted_at_the_end() -> None:
    output = {"output": {"kind": "tcp_client", "port": free_port()}, "format": {"kind": "json_lines"}}
    running = ran({**TRACKER, "inputs": [feed()], "outputs": [output]}, [Arrival(line, 0.0) for line in lines(4)])
    assert (running.counters.counts["reports_sent_total"], running.counters.counts["reports_dropped_total"] > 0) == (0, True)


def test_scans_without_a_report_of_their_own_are_counted(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Scans that wait are taken together, and one report tells of them all: nothing said so."""
    tells = [{"output": {"kind": "file", "path": str(tmp_path / name)}, "format": {"kind": "json_lines"}} for name in "ab"]
    running = made({**TRACKER, "inputs": [feed()], "outputs": [tells[0], {**tells[1], "every": "3 s"}]}, [])
    (given,) = running.service.parts.inputs
    for message in given.format.decode(given.format.start(), b"".join(lines(80))).messages:
        for formed in running.listening.groupers[0].add(message, 5.0):
            running.listening.put(formed, given)
    with caplog.at_level(logging.INFO, "vedette.live"):
        running.run()
    told, counts = len((tmp_path / "a").read_bytes().splitlines()), running.counters.counts
    assert told < 80 == counts["scans_taken_total"]
    assert counts["reports_merged_total"] == 80 - told == vars(caplog.records[-1])["reports_merged"]


def test_a_turn_that_is_not_complete_is_taken_at_the_stop() -> None:
    port = free_port()
    turn = {"by": "turn", "wait": "1 h", "length": "1 h"}
    config = {
        **TRACKER,
        "inputs": [{"input": {"kind": "udp", "port": port}, "format": {"kind": "json_lines"}, "scans": turn}],
    }
    with served(config) as running, reach(running, port) as here:
        here.send(lines(1)[0])
        wait_for(lambda: running.counters.counts["messages_total"] > running.counters.counts["messages_refused_total"])
    counts = running.counters.counts
    assert (counts["scans_taken_total"], counts["scans_dropped_total"]) == (1, 0)


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
        ({"inputs": [feed(format=LINES)]}, "inputs[0]"),
        ({"inputs": [feed(format={"kind": "nmea"})]}, "inputs[0]"),
        ({"inputs": [feed(format=LINES, sensor="west")]}, "inputs[0].sensor"),
    ],
)
def test_what_cannot_be_served_is_told_with_its_place(changed: Mapping[str, Any], place: str) -> None:
    usual = {"inputs": [{"input": {"kind": "standard_input"}, "format": {"kind": "json_lines"}}]}
    with pytest.raises(ConfigError) as refused:
        load_service({**TRACKER, **usual, **changed})
    assert any(problem.place.startswith(place) for problem in refused.value.problems), refused.value


def test_messages_that_name_no_sensor_are_of_the_one_that_the_input_names() -> None:
    came = [Arrival(b"1.5,100,200\n2.5,101,201\n", 1e6)]
    running = ran({**TRACKER, "inputs": [feed(format=LINES, sensor="south")]}, came)
    assert running.counters.counts["scans_taken_total"] == 2


def test_a_format_that_can_read_nothing_is_told_when_the_config_is_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    """It was said to be able to be served."""
    monkeypatch.setitem(sys.modules, "pyais", None)
    with pytest.raises(ConfigError) as refused:
        load_service({**TRACKER, "inputs": [feed(format={"kind": "nmea"}, sensor="north")]})
    assert [problem.place for problem in refused.value.problems] == ["inputs[0].format"]


def test_a_state_that_no_store_can_keep_is_refused_when_the_service_is_built(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def remembers(self: Existence, existence: Any) -> Any:
        return {"a set": {1, 2}}

    monkeypatch.setattr(Existence, "start", remembers)
    inputs = [{"input": {"kind": "udp", "port": 1}, "format": {"kind": "json_lines"}}]
    assert load_service({**TRACKER, "inputs": inputs})
    with pytest.raises(ConfigError, match=r"service\.store: cannot keep .*memory"):
        load_service({**TRACKER, "inputs": inputs, "service": {"store": {"kind": "sqlite", "path": str(tmp_path / "s")}}})


def test_files_that_are_read_or_written_by_another_part_are_told(tmp_path: Path) -> None:
    path = tmp_path / "stream.jsonl"
    path.write_bytes(b"")
    (tmp_path / "link").symlink_to(path)
    lines_of = {"format": {"kind": "json_lines"}}
    given = {**TRACKER, "inputs": [{"input": {"kind": "file", "path": str(path)}, **lines_of}]}
    output = {"output": {"kind": "file", "path": str(tmp_path / "out")}, **lines_of}
    store = {"kind": "sqlite", "path": str(tmp_path / "out")}
    for changed, place in (
        ({"outputs": [{**output, "output": {"kind": "file", "path": str(path)}}]}, "outputs[0].output.path"),
        ({"outputs": [output, output]}, "outputs[1].output.path"),
        ({"service": {"record": str(tmp_path / "link")}}, "service.record"),
        ({"outputs": [output], "service": {"store": store}}, "service.store.path"),
    ):
        with pytest.raises(ConfigError) as refused:
            load_service({**given, **changed})
        assert [problem.place for problem in refused.value.problems] == [place]


def test_an_input_that_can_never_be_used_ends_the_service_with_its_place() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        config = {**TRACKER, "inputs": [{"input": {"kind": "tcp_server", "port": port}, "format": {"kind": "json_lines"}}]}
        with pytest.raises(vedette.VedetteError, match=r"inputs\[0\]"):
            Running(load_service(config)).run()


def test_a_page_whose_port_is_taken_is_told_before_anything_comes() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        config = {**TRACKER, "inputs": [feed()], "service": {"page": taken.getsockname()[1]}}
        with pytest.raises(vedette.VedetteError, match=rf"page: port {taken.getsockname()[1]} .*in use"):
            ran(config, [])


def test_a_sensor_whose_clock_makes_all_others_late_is_told_by_their_health() -> None:
    """Ordinary scans, one an hour ahead, ordinary ones again; then the clock is past it."""

    def sent(times: list[float], sensor: str) -> list[Arrival]:
        told = [json.dumps({"time": time, "sensor": sensor, "z": [[0.0, 0.0]]}) for time in times]
        return [Arrival(f"{line}\n".encode(), 0.0, "") for line in told]

    north = [float(t) for t in range(20)]
    before = [*sent(north, "north"), *sent([3600.0], "south")]
    running = ran({**TRACKER, "inputs": [feed()]}, before)
    assert running.ails == {}
    running = ran({**TRACKER, "inputs": [feed()]}, [*before, *sent([20.0 + t for t in north], "north")])
    assert list(running.ails) == ["sensor north"]
    assert "its last 20 scans were refused" in running.ails["sensor north"]
    running = ran({**TRACKER, "inputs": [feed()]}, [*before, *sent([*(20.0 + t for t in north), 3601.0, 3602.0], "north")])
    assert running.ails == {}


def test_a_clock_that_stands_still_is_told_by_the_health() -> None:
    """Of its turns none was complete before 50,000 messages, and all seemed well."""

    def sent(times: list[float]) -> list[Arrival]:
        told = [json.dumps({"time": time, "sensor": "north", "z": [[k, 0.0]]}) for k, time in enumerate(times)]
        return [Arrival(f"{line}\n".encode(), 2.0 * k) for k, line in enumerate(told)]

    for scans in ({"by": "turn", "wait": "1 h"}, {"by": "message"}):
        config = {**TRACKER, "inputs": [feed(scans=scans)]}
        assert ran(config, sent([7.0] * 31)).ails == {}
        assert ran(config, sent([7.0] * 32)).ails == {"clock of 'north'": "it stands still at 7.000000 s, for 62 s"}
        assert ran(config, sent([7.0] * 32 + [8.0])).ails == {}


def test_a_thousand_slow_connections_hold_nobody_up() -> None:
    """One of them sends a whole line, byte by byte, and is heard to its end."""
    port, crowd = free_port(), 1000
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if hard < 3 * crowd:
        pytest.skip(f"the system grants {hard} open files")
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, 3 * crowd), hard))
    config = {
        **TRACKER,
        "inputs": [{"input": {"kind": "tcp_server", "port": port, "most": 2 * crowd}, "format": {"kind": "json_lines"}}],
        "service": {"horizon": "1 h"},
    }
    with served(config) as running:
        slow = [connected(port) for _ in range(crowd)]
        for here in slow:
            here.sendall(b'{"ti')
        first, *rest = lines(41)
        first = first.replace(b', "n": 0', b"")  # a number lower than those that overtake it would be one sent again
        with connected(port) as crawling, connected(port) as here:
            for i, byte in enumerate(first):
                crawling.sendall(bytes([byte]))
                sleep(0.001)
                if i == 10:
                    here.sendall(b"".join(rest))
            wait_for(lambda: running.counters.counts["scans_taken_total"] == 41)
        for here in slow:
            here.close()
        wait_for(lambda: running.counters.counts["messages_refused_total"] == crowd)
    assert as_json(running.state) == as_json(undisturbed(lines(41)))


def test_recorded_ais_with_tag_blocks_is_a_source(tmp_path: Path) -> None:
    tags = [f"c:{1_700_000_000 + 10 * k}" for k in range(40)]
    report = "!AIVDM,1,1,,B,177KQJ5000G?tO`K>RA1wUbN0TKH,0*5C"
    tagged = [f"\\{tag}*{reduce(xor, tag.encode()):02X}\\{report}" for tag in tags]
    (tmp_path / "ais.nmea").write_text("\n".join(tagged))
    source = {"kind": "stream", "path": str(tmp_path / "ais.nmea"), "format": {"kind": "nmea", "tagged": True}}
    source["origin"] = {"latitude": 47.5, "longitude": -122.3}
    sensors = {"ais": {"kind": "cartesian_position", "sigma": 10.0}}
    result = vedette.load({**TRACKER, "sensors": sensors, "source": source}).run()
    assert [scan.time for scan in result.scans[:2]] == [1_700_000_000.0, 1_700_000_010.0]
    assert len(result.tracks) == 1


def test_a_recorded_stream_is_a_source(tmp_path: Path) -> None:
    (tmp_path / "stream.jsonl").write_bytes(b"".join(lines()) + b"nonsense\n")
    source = {"kind": "stream", "path": str(tmp_path / "stream.jsonl"), "format": {"kind": "json_lines"}}
    result = vedette.load({**TRACKER, "source": source}).run()
    assert len(result.scans) == 80
    assert len(result.tracks) == 2
    assert result.recording.rows["messages"].refused == 1
