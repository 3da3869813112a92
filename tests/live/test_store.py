"""A service that is stopped, killed or restarted goes on as if nothing had happened."""

from __future__ import annotations

import json
import signal
import sqlite3
import subprocess
import sys
from pathlib import Path

import numpy as np

import vedette
from live.test_service import TRACKER, connected, free_port, lines, served, wait_for
from vedette.streams import Saved
from vedette_live.saving import scan_from
from vedette_live.stores.sqlite import SqliteStore


def config(tmp_path: Path, port: int, **service: object) -> dict[str, object]:
    return {
        **TRACKER,
        "inputs": [{"input": {"kind": "tcp_server", "port": port}, "format": {"kind": "json_lines"}}],
        "service": {"store": {"kind": "sqlite", "path": str(tmp_path / "state.sqlite")}, "save": 0.05, **service},
    }


def undisturbed(count: int) -> vedette.tracking.State:
    tracker = vedette.build(TRACKER)
    state = tracker.start(seed=np.random.SeedSequence(0).spawn(2)[1])
    for line in lines(count):
        told = json.loads(line)
        state = tracker.step(state, vedette.Scan(told["time"], told["sensor"], vedette.Detections.of(told["z"], 2)))
    return state


def send(port: int, todo: list[bytes], wanted: int, stop_after: int | None = None) -> int:
    """Send lines until `wanted` of them are acknowledged, or `stop_after`; return how many are."""
    known = {"north": -1, "south": -1}
    with connected(port) as here, here.makefile("rb") as told:
        for line in todo:
            here.sendall(line)
        while max(known.values()) < (wanted - 1 if stop_after is None else stop_after):
            answer = told.readline()
            if not answer:
                break
            known[json.loads(answer)["sensor"]] = json.loads(answer)["ack"]
    return min(known.values()) + 1


def test_a_service_that_is_restarted_goes_on_to_the_last_bit(tmp_path: Path) -> None:
    port, todo = free_port(), lines(60)
    with served(config(tmp_path, port, horizon="4 s")) as running:
        send(port, todo[:30], 30)
    with served(config(tmp_path, port, horizon="4 s")) as running:
        send(port, todo[20:], 60)  # ten lines come again
        wait_for(lambda: running.counters.counts["scans_taken_total"] == 60)
    expected = undisturbed(60)
    assert running.state is not None
    assert json.dumps(running.state.to_data()) == json.dumps(expected.to_data())
    assert running.counters.counts["messages_repeated_total"] == 10


def test_a_service_that_is_killed_goes_on_with_a_sender_that_repeats(tmp_path: Path) -> None:
    port, todo, sent = free_port(), lines(200), 0
    record = tmp_path / "record.jsonl"
    path = tmp_path / "service.json"
    path.write_text(json.dumps(config(tmp_path, port, record=str(record))))
    for round_ in range(4):
        service = subprocess.Popen([sys.executable, "-m", "vedette", "serve", str(path)], stderr=subprocess.DEVNULL)
        try:
            last = round_ == 3
            sent = send(port, todo[sent:], 200, None if last else sent + 30)
        finally:
            service.send_signal(signal.SIGTERM if last else signal.SIGKILL)
            service.wait(20)
    saved = SqliteStore(path=str(tmp_path / "state.sqlite")).open().load()
    assert saved is not None
    tracker = vedette.build(TRACKER)
    state = tracker.state_from(saved.states["before"])
    for scan in saved.states["scans"]:
        state = tracker.step(state, scan_from(scan))
    assert json.dumps(state.to_data()) == json.dumps(undisturbed(200).to_data())
    result = vedette.load({**TRACKER, "source": {"kind": "jsonl", "path": str(record)}}).run()
    assert len(result.scans) == 200


def test_a_damaged_state_is_told_and_the_one_before_it_used(tmp_path: Path) -> None:
    store = SqliteStore(path=str(tmp_path / "state.sqlite"))
    opened = store.open()
    for i in range(3):
        opened.save(Saved("digest", {"i": i}, {}, {}), [])
    opened.close()
    with sqlite3.connect(tmp_path / "state.sqlite") as direct:
        assert direct.execute("SELECT COUNT(*) FROM states").fetchone() == (2,)
        direct.execute("UPDATE states SET content = replace(content, '2', '7') WHERE id = (SELECT MAX(id) FROM states)")
    again = store.open()
    saved = again.load()
    assert saved is not None
    assert saved.states == {"i": 1}
    again.close()


def test_a_file_that_is_damaged_is_set_aside_and_its_copy_used(tmp_path: Path) -> None:
    path = tmp_path / "state.sqlite"
    store = SqliteStore(path=str(path))
    opened = store.open()
    opened.save(Saved("digest", {"i": 1}, {}, {}), [])
    opened.close()
    store.open().close()  # makes the copy
    data = bytearray(path.read_bytes())
    data[20:4000] = b"\xff" * 3980
    path.write_bytes(bytes(data))
    again = store.open()
    saved = again.load()
    assert saved is not None
    assert saved.states == {"i": 1}
    assert (tmp_path / "state.sqlite.damaged").read_bytes() == bytes(data)
    assert getattr(again, "told", [])
    again.close()


def test_a_state_of_another_config_is_left_out(tmp_path: Path) -> None:
    port = free_port()
    with served(config(tmp_path, port)):
        send(port, lines(10), 10)
    other = {**config(tmp_path, port), "seed": 7}
    with served(other) as running:
        assert running.state is None


def test_tracks_are_rows_and_old_ones_are_pruned(tmp_path: Path) -> None:
    port = free_port()
    given = config(tmp_path, port)
    given["service"] = {**given["service"], "store": {**given["service"]["store"], "keep": "30 s"}}  # type: ignore[dict-item, index]
    with served(given):
        send(port, lines(60), 60)
    with sqlite3.connect(tmp_path / "state.sqlite") as direct:
        rows = direct.execute("SELECT time, id, x, y, confirmed FROM tracks ORDER BY time").fetchall()
    expected, tracker = undisturbed(60), vedette.build(TRACKER)
    assert rows[0][0] >= expected.time - 30.0
    last = {row[1]: row[2:4] for row in rows if row[0] == expected.time}
    means = tracker.estimate(expected).mean
    for i in np.flatnonzero(expected.confirmed):
        assert last[int(expected.ids[i])] == tuple(means[i, :2])
    assert all(row[4] for row in rows)
