"""A service that is stopped, killed or restarted goes on as if nothing had happened."""

from __future__ import annotations

import errno
import json
import signal
import sqlite3
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import closing
from io import FileIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from attrs import evolve

import vedette
from support.services import (
    PATIENCE,
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
from vedette import ConfigError, InputError
from vedette.streams import Arrival, Saved
from vedette_live import keeping, recorder, saving
from vedette_live.acknowledging import MISSED, Acknowledging
from vedette_live.config import load_service
from vedette_live.reports import report_of
from vedette_live.running import Running
from vedette_live.saving import formed_from
from vedette_live.stores.sqlite import SqliteStore


def config(tmp_path: Path, port: int, **service: object) -> dict[str, object]:
    return {
        **TRACKER,
        "inputs": [{"input": {"kind": "tcp_server", "port": port}, "format": {"kind": "json_lines"}}],
        "service": {"store": {"kind": "sqlite", "path": str(tmp_path / "state.sqlite")}, "save": 0.05, **service},
    }


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
    expected = undisturbed(lines(60))
    assert as_json(running.state) == as_json(expected)
    assert running.counters.counts["messages_repeated_total"] == 10


def of_file(tmp_path: Path, **more: Any) -> dict[str, object]:
    given = {"input": {"kind": "file", "path": str(tmp_path / "feed"), "follow": False}, **more}
    record = str(tmp_path / "record.jsonl")
    return {**config(tmp_path, 1, horizon="4 s", record=record), "inputs": [{"format": {"kind": "json_lines"}, **given}]}


def to_its_end(given: Mapping[str, Any]) -> Running:
    running = Running(load_service(given))
    running.run()
    return running


def counted(running: Running) -> tuple[int, int, int, int]:
    names = ("scans_taken_total", "scans_refused_total", "messages_refused_total", "messages_repeated_total")
    taken, refused, unusable, repeated = (running.counters.counts[name] for name in names)
    return taken, refused, unusable, repeated


@pytest.mark.parametrize("piece", [300, 2**16])
def test_a_file_is_read_on_after_a_restart(tmp_path: Path, piece: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """It was read from its beginning, and all of it refused, which the record and the health told of."""
    monkeypatch.setattr("vedette_live.inputs.files.PIECE", piece)
    told, bad = lines(60), b'{"sensor": "north", "time": 1, "z": [[1, 2, 3]]}\n'
    for end in (30, 45, 60):
        (tmp_path / "feed").write_bytes(b"".join([*told[:7], bad, *told[7:end]]) + b"".join(told[end : end + 1])[:20])
        running = to_its_end(of_file(tmp_path))
        assert not running.ails
    assert counted(running)[:2] == (60, 0)
    assert running.counters.counts["messages_repeated_total"] == 0
    assert as_json(running.state) == as_json(undisturbed(told))
    assert b"left_out" not in (tmp_path / "record.jsonl").read_bytes()


def test_a_file_in_the_place_of_the_one_that_was_read_is_read_whole_and_that_is_told(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    told = lines(60)
    for part in (told[:30], told[30:32], told[32:]):  # the second is shorter, the third longer than what was read
        (tmp_path / "feed").write_bytes(b"".join(part))
        running = to_its_end(of_file(tmp_path))
    assert counted(running) == (60, 0, 0, 0)
    assert as_json(running.state) == as_json(undisturbed(told))
    assert caplog.messages.count("another file than before") == 2


@pytest.mark.parametrize("kills", [2, pytest.param(12, marks=pytest.mark.nightly("a service starts twelve times"))])
@pytest.mark.by_turns
def test_a_service_that_is_killed_takes_each_line_of_a_file_once(tmp_path: Path, kills: int) -> None:
    """Of a scan that was open they are read again, and of others that stand between them are not."""
    rng, plots = np.random.default_rng(2), list[bytes]()
    for k in range(200):
        for name in ("north", "south"):
            plots += [b"%.2f,%s,%.3f,%.3f\n" % (k + 0.1 * j, name.encode(), *rng.uniform(-900, 900, 2)) for j in range(3)]
    given = of_file(
        tmp_path,
        input={"kind": "file", "path": str(tmp_path / "feed"), "every": 0.01},
        format={"kind": "csv_lines", "columns": ["time", "sensor", "x", "y"]},
        scans={"by": "interval", "length": 1.0, "wait": 600.0},
    )
    (tmp_path / "config.json").write_text(json.dumps(given))
    record = tmp_path / "record.jsonl"
    (tmp_path / "feed").write_bytes(b"time,sensor,x,y\n")
    parts = np.array_split(np.arange(len(plots)), kills + 1)
    for part in parts[:-1]:
        with (tmp_path / "feed").open("ab") as file:
            file.write(b"".join(plots[k] for k in part))
        before = len(record.read_bytes()) if record.exists() else -1
        with subprocess.Popen([sys.executable, "-m", "vedette", "serve", str(tmp_path / "config.json")]) as service:
            wait_for(lambda before=before: record.exists() and len(record.read_bytes()) > before)  # type: ignore[misc]
            service.kill()
    with (tmp_path / "feed").open("ab") as file:
        file.write(b"".join(plots[k] for k in parts[-1]))
    given["inputs"][0]["input"]["follow"] = False  # type: ignore[index]
    running = to_its_end(given)
    assert counted(running)[:3] == (400, 0, 0)
    scans = [json.loads(line) for line in record.read_bytes().splitlines()[1:]]
    assert [(scan["time"], len(scan["z"])) for scan in scans] == [(k + 0.2, 3) for k in range(200) for _ in range(2)]


@pytest.mark.parametrize("horizon", ["3 s", "1 s"])
def test_what_is_sent_again_after_a_restart_is_not_taken_twice(tmp_path: Path, horizon: str) -> None:
    """The scan at the edge of the horizon was, where that is a whole number of intervals."""
    told = [json.dumps({**json.loads(line), "n": None}).encode() for line in lines(20)]
    given = {**config(tmp_path, 1, horizon=horizon), "inputs": [feed()]}
    ran(given, [Arrival(line, 0.0) for line in told])
    again = ran(given, [Arrival(line, 0.0) for line in told])
    assert again.counters.counts["scans_taken_total"] == 20
    assert as_json(again.state) == as_json(undisturbed(told))


@pytest.mark.parametrize("horizon", ["0 s", "4 s"])
def test_a_copy_of_a_message_of_a_turn_is_recognised_after_a_restart(tmp_path: Path, horizon: str) -> None:
    """It was a return of the turn that was open: copies of messages were forgotten."""
    places = np.random.default_rng(4).uniform(-900, 900, (40, 2)).tolist()
    told = [json.dumps({"time": 0.5 * k, "sensor": "north", "z": [z]}).encode() for k, z in enumerate(places)]
    given = {**config(tmp_path, 1, horizon=horizon), "inputs": [feed(scans={"by": "interval", "length": 2.0, "wait": 1e12})]}

    def sent(*which: int) -> list[Arrival]:
        return [Arrival(told[k], 1e6 + 0.5 * k) for k in which]

    ran(given, sent(*range(20)))
    again = ran(given, sent(20, 13, 21, 19, *range(22, 40)))
    assert counted(again)[:3] == (10, 0, 2)
    whole = ran({**given, "service": {}}, sent(*range(40)))
    assert as_json(again.state) == as_json(whole.state)


@pytest.mark.parametrize("horizon", ["0 s", "4 s"])
def test_a_wrong_time_far_ahead_is_given_up_after_a_restart_too(
    tmp_path: Path, horizon: str, caplog: pytest.LogCaptureFixture
) -> None:
    """It was saved, and all that came later was refused for good; the output sent no report more."""
    told = [json.dumps({**json.loads(line), "n": None}).encode() for line in lines(40)]
    wrong = json.dumps({**json.loads(told[20]), "time": 500.0}).encode()
    given = {
        **config(tmp_path, 1, horizon=horizon),
        "inputs": [feed()],
        "outputs": [
            {"output": {"kind": "file", "path": str(tmp_path / "out")}, "format": {"kind": "json_lines"}, "every": "1 s"}
        ],
    }
    ran(given, [Arrival(line, 0.0) for line in [*told[:20], wrong, *told[20:23]]])
    again = ran(given, [Arrival(line, 0.0) for line in told[23:]])
    assert "scans given up" in caplog.messages
    assert again.state is not None
    assert again.state.time == json.loads(told[-1])["time"]
    assert as_json(again.state) == as_json(undisturbed([*told[:20], *told[28:]]))
    assert not again.ails
    assert json.loads((tmp_path / "out").read_bytes().splitlines()[-1])["time"] == again.state.time


def test_what_is_sent_again_before_it_was_saved_is_not_taken_twice(tmp_path: Path) -> None:
    """The connection was lost, not the service; the answer goes to the new one, once all is saved."""
    port, todo = free_port(), lines(40)
    with served(config(tmp_path, port, save=3600.0)) as running:
        with connected(port) as first:
            first.sendall(b"".join(todo[:30]))
            wait_for(lambda: running.counters.counts["scans_taken_total"] == 30)
        with connected(port) as second:
            second.sendall(b"".join(todo))
            wait_for(lambda: running.counters.counts["messages_total"] == 70)
            wait_for(lambda: running.counters.counts["scans_taken_total"] == 40)
            running.kept.save(running._window)
            with second.makefile("rb") as told:
                answers = [json.loads(told.readline()) for _ in range(2)]
    assert {answer["sensor"]: answer["ack"] for answer in answers} == {"north": 39, "south": 38}
    assert running.counters.counts["messages_repeated_total"] == 30
    assert as_json(running.state) == as_json(undisturbed(todo))


def numbered(sensor: str, number: int, time: float, z: list[list[float]], answers: list[bytes]) -> Arrival:
    told = json.dumps({"time": time, "sensor": sensor, "z": z, "n": number})
    return Arrival(f"{told}\n".encode(), time, "", answers.append)


def test_a_message_that_cannot_be_used_is_answered_once_all_before_it_is_kept(tmp_path: Path) -> None:
    """Its answer says so of them; one of a sensor that nobody knows has none before it."""
    answers = list[bytes]()
    came = [("north", 5, [[0.0, 0.0]]), ("north", 6, [[1.0, 2.0, 3.0]]), ("nroth", 7, [[0.0, 0.0]])]
    ran(
        {**config(tmp_path, 1, save=3600.0), "inputs": [feed()]},
        [numbered(sensor, n, float(n), z, answers) for sensor, n, z in came],
    )
    kept, *refused = map(json.loads, answers)
    assert kept == {"ack": 5, "sensor": "north"}
    assert [(answer["ack"], answer["sensor"], bool(answer["refused"])) for answer in refused] == [
        (6, "north", True), (7, "nroth", True),
    ]  # fmt: skip
    answers.clear()
    ran({**TRACKER, "inputs": [feed()]}, [numbered("north", 3, 0.0, [[1.0]], answers)])
    (answer,) = map(json.loads, answers)
    assert (answer["ack"], answer["sensor"], bool(answer["refused"])) == (3, "north", True)


def test_a_line_that_cannot_be_read_is_answered(tmp_path: Path) -> None:
    """Its sender may wait for the answer; where its number cannot be read, the answer has none. So with the first line."""
    answers = list[bytes]()
    told = [
        b'{"sensor": "north", "n": 4}',
        b'{"time": 5.0, "sensor": "north", "z": [[0, 0]], "n": 5}',
        b'{"n": 6',
        b'{"n": 6',
    ]
    arrivals = [Arrival(line + b"\n", 0.0, "", answers.append) for line in told]
    running = ran({**config(tmp_path, 1, save=3600.0), "inputs": [feed()]}, arrivals[3:] + arrivals[:3])
    assert [(answer.get("ack"), "refused" in answer) for answer in map(json.loads, answers)] == [
        (None, True), (None, True), (4, True), (5, False),
    ]  # fmt: skip
    counts = running.counters.counts
    assert (counts["messages_refused_total"], counts["messages_taken_total"]) == (3, 1)
    answers.clear()

    def late() -> Iterator[Arrival]:
        yield numbered("north", 7, 100.0, [[0.0, 0.0]], answers)
        wait_for(lambda: answers)  # or both are taken at once, in order
        yield numbered("north", 8, 50.0, [[0.0, 0.0]], answers)

    ran({**TRACKER, "inputs": [feed()]}, late())
    taken, refused = map(json.loads, answers)
    assert taken == {"ack": 7, "sensor": "north"}
    assert refused["ack"] == 8
    assert "late" in refused["refused"]


@pytest.mark.parametrize("restart", [False, True])
def test_a_sender_whose_last_line_was_late_may_send_all_again(tmp_path: Path, restart: bool) -> None:
    answers, z = list[bytes](), [[0.0, 0.0]]
    given = {**config(tmp_path, 1, horizon=3.0), "inputs": [feed()]}
    sent = [numbered("north", n, time, z, answers) for n, time in ((7, 7.0), (8, 6.0))]
    if restart:
        ran(given, sent)
    again = ran(given, [*sent, *sent])
    assert (again.ails, again.counters.counts["messages_refused_total"]) == ({}, 0)


@pytest.mark.parametrize("restart", [False, True])
def test_a_number_that_was_left_out_may_come_late_and_once(tmp_path: Path, restart: bool) -> None:
    """It counted as come before, so that its scan was lost, and its sender was told that it was kept."""
    answers, todo = list[bytes](), [json.loads(line) for line in lines(12) if b"north" in line]
    sent = [numbered("north", each["n"], each["time"], each["z"], answers) for each in todo]
    given = {**config(tmp_path, 1, horizon="4 s"), "inputs": [feed()]}
    early, rest = [*sent[:2], sent[3]], [sent[2], sent[3], sent[2], *sent[4:], sent[0]]
    if restart:
        ran(given, early)
        running = ran(given, rest)
    else:
        running = ran(given, [*early, *rest])
    counts = running.counters.counts
    assert [counts[f"{name}_total"] for name in ("scans_taken", "scans_late", "messages_repeated")] == [6, 1, 3]
    assert as_json(running.state) == as_json(undisturbed(line for line in lines(12) if b"north" in line))
    assert not running.ails
    told = [json.loads(answer) for answer in answers]
    assert {"ack": todo[-1]["n"], "sensor": "north"} in told
    assert not any("refused" in each for each in told)
    ran(given, [numbered("north", 20, 30.0, [], answers), numbered("north", 15, 16.0, [[0.0, 0.0]], answers)])
    (late,) = [json.loads(answer) for answer in answers if b"refused" in answer]
    assert late["ack"] == 15
    assert "late" in late["refused"]


def test_what_comes_late_is_answered_once_it_is_kept(tmp_path: Path) -> None:
    """A higher number was kept before; who sends it again meanwhile must not be told that it is safe."""
    numbers, answers = Acknowledging(), list[bytes]()
    numbers.begin("0 a", answers.append)
    for number in (("0 a", "north", count) for count in (0, 2)):
        numbers.note(number)
        numbers.take([number])
    numbers.keep(numbers.taken())
    assert numbers.untaken(numbers.kept) == {"0 north": [(1, 1)]}
    late = ("0 a", "north", 1)
    assert not numbers.came(late)
    numbers.note(late)
    assert numbers.came(late)
    assert numbers.untaken(numbers.kept) == {"0 north": [(1, 1)]}
    numbers.keep(numbers.taken())
    assert [json.loads(answer)["ack"] for answer in answers] == [2]
    numbers.take([late])
    assert numbers.untaken(numbers.kept) == {"0 north": []}
    numbers.keep(numbers.taken())
    assert [json.loads(answer)["ack"] for answer in answers] == [2, 1]


def test_numbers_left_out_are_remembered_in_bounds() -> None:
    numbers = Acknowledging()
    for count in range(0, 4 * MISSED, 2):
        numbers.note(("0 a", "north", count))
    assert len(numbers.missed["0 north"]) == MISSED
    assert numbers.came(("0 a", "north", 1))
    assert not numbers.came(("0 a", "north", 4 * MISSED - 3))


def test_a_sender_that_counts_anew_is_told(tmp_path: Path) -> None:
    """It was answered as one that sends again, and what it sent was taken by nobody."""
    answers, z = list[bytes](), [[0.0, 0.0]]
    given = {**config(tmp_path, 1), "inputs": [feed()]}
    ran(given, [numbered("north", 7, 7.0, z, answers)])
    anew = ran(given, [numbered("north", 7, 7.0, z, answers), numbered("north", 2, 200.0, z, answers)])
    assert list(anew.ails) == ["numbers of 'north'"]
    assert "got 2 after 7" in anew.ails["numbers of 'north'"]
    assert (anew.counters.counts["messages_repeated_total"], anew.counters.counts["messages_refused_total"]) == (1, 1)
    assert [json.loads(answer).get("ack") for answer in answers] == [7, None, 7]
    assert "got 2 after 7" in json.loads(answers[1])["refused"]
    assert ran(given, [numbered("north", 8, 201.0, z, answers)]).ails == {}


@pytest.mark.costly
def test_a_full_disk_does_not_end_the_service_and_is_told(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """The database may have no further page, and the record no further byte, for a while."""
    port, todo, record = free_port(), lines(120), tmp_path / "record.jsonl"
    with served(config(tmp_path, port, record=str(record))) as running:
        counts = running.counters.counts
        send(port, todo[:20], 20)
        direct, recorder = running.kept.store.connection, running.kept.recorder  # type: ignore[union-attr]
        assert recorder is not None
        direct.execute(f"PRAGMA max_page_count = {direct.execute('PRAGMA page_count').fetchone()[0]}")
        file, recorder.file = recorder.file, FullFile(recorder.file.fileno(), "r+b", closefd=False)
        with connected(port) as here:
            here.sendall(b"".join(todo[20:]))
            wait_for(lambda: counts["scans_taken_total"] == 120)
            wait_for(lambda: counts["saves_failed_total"] > 2)
            assert set(running.ails) & {"store", "record"}
            direct.execute("PRAGMA max_page_count = 1000000")
            recorder.file = file
            wait_for(lambda: not running.ails)
    assert [record.getMessage() for record in caplog.records].count("not saved") == 1
    assert as_json(running.state) == as_json(undisturbed(todo))
    assert as_json(replayed(record, TRACKER)) == as_json(running.state)


def test_what_a_disk_that_is_full_for_long_costs_is_told(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """More waits then than is kept: record and tracks lacked the oldest without a word."""
    monkeypatch.setattr(recorder, "MOST", 5)
    monkeypatch.setattr(keeping, "_UNSAVED", 6)
    record = str(tmp_path / "record.jsonl")

    def late() -> Iterator[Arrival]:
        into = running.kept.recorder
        assert into is not None
        file, into.file = into.file, FullFile(into.file.fileno(), "r+b", closefd=False)
        for count, line in enumerate(lines(40), 1):
            yield Arrival(line, 0.0)
            wait_for(lambda count=count: running.counters.counts["scans_taken_total"] == count)  # type: ignore[misc]
        wait_for(lambda: running.counters.counts["saves_failed_total"])
        into.file = file

    running = made({**config(tmp_path, 1, record=record), "inputs": [feed()]}, late())
    running.run()
    lacking = {text: value for each in caplog.records for text, value in vars(each).items() if text in ("lines", "reports")}
    assert set(lacking) == {"lines", "reports"}
    assert min(lacking.values()) > 20


@pytest.mark.parametrize("first", [0, 20])
def test_a_stop_while_nothing_can_be_written_is_an_error_that_counts_what_is_not_kept(tmp_path: Path, first: int) -> None:
    """It ended with "stopped", and exit code 0."""
    record = str(tmp_path / "record.jsonl")
    given = {**config(tmp_path, 1, record=record), "inputs": [feed()]}
    ran(given, [Arrival(line, 0.0) for line in lines(first)])

    def late() -> Iterator[Arrival]:
        into = running.kept.recorder
        assert into is not None
        into.file = FullFile(into.file.fileno(), "r+b", closefd=False)
        yield from (Arrival(line, 0.0) for line in lines(60)[first:])

    running = made(given, late())
    with pytest.raises(InputError) as told:
        running.run()
    store, lacking = str(told.value).splitlines()
    assert f" {60 - first} scans" in store
    assert (f"after {1.5 * (first - 1):.6f} s" in store) == (first > 0)
    assert f" {60 - first} lines" in lacking
    assert ran(given, [Arrival(line, 0.0) for line in lines(60)[first:]]).ails == {}


class FullFile(FileIO):
    """A file on a full disk, which takes a few bytes before it says so."""

    def write(self, data: Any) -> int:
        if len(data) < 10:
            raise OSError(errno.ENOSPC, "No space left on device")
        return super().write(data[:-9])


@pytest.mark.parametrize("kills", [2, pytest.param(10, marks=pytest.mark.nightly("eleven processes"))])
@pytest.mark.costly
def test_a_service_that_is_killed_goes_on_with_a_sender_that_repeats(tmp_path: Path, kills: int) -> None:
    port, todo, sent = free_port(), lines(200), 0
    record = tmp_path / "record.jsonl"
    path = tmp_path / "service.json"
    path.write_text(json.dumps(config(tmp_path, port, record=str(record))))
    for round_ in range(kills + 1):
        service = subprocess.Popen([sys.executable, "-m", "vedette", "serve", str(path)], stderr=subprocess.DEVNULL)
        try:
            last = round_ == kills
            sent = send(port, todo[sent:], 200, None if last else sent + 150 // kills)
        finally:
            service.send_signal(signal.SIGTERM if last else signal.SIGKILL)
            service.wait(PATIENCE)
    with closing(SqliteStore(path=str(tmp_path / "state.sqlite")).open()) as store:
        saved = store.load()
    assert saved is not None
    tracker = vedette.build(TRACKER)
    state = tracker.state_from(saved.states["before"])
    for scan in saved.states["scans"]:
        state = tracker.step(state, formed_from(scan).scan)
    assert as_json(state) == as_json(undisturbed(lines(200)))
    assert as_json(replayed(record, TRACKER)) == as_json(state)


def test_a_damaged_state_is_told_and_the_one_before_it_used(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    store = SqliteStore(path=str(tmp_path / "state.sqlite"))
    opened = store.open()
    for i in range(3):
        opened.save(Saved({"i": i}, {}, {}), [])
    opened.close()
    with closing(sqlite3.connect(tmp_path / "state.sqlite")) as direct, direct:
        assert direct.execute("SELECT COUNT(*) FROM states").fetchone() == (2,)
        direct.execute("UPDATE states SET content = replace(content, '2', '7') WHERE id = (SELECT MAX(id) FROM states)")
    again = store.open()
    saved = again.load()
    assert saved is not None
    assert saved.states == {"i": 1}
    assert [record.message for record in caplog.records] == ["store"]
    again.close()


def test_a_record_keeps_what_a_damaged_store_forgot(tmp_path: Path) -> None:
    """A sender that was answered does not send it again."""
    port, record = free_port(), tmp_path / "record.jsonl"
    given = config(tmp_path, port, record=str(record))
    for count in (10, 20):
        with served(given):
            send(port, lines(count), count)
    whole = record.read_bytes()
    (tmp_path / "state.sqlite").write_bytes(b"")
    assert goes_on(given) == undisturbed(lines(10)).time
    assert record.read_bytes() == whole


def test_a_file_that_is_damaged_is_set_aside_and_its_copy_used(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    path = tmp_path / "state.sqlite"
    store = SqliteStore(path=str(path))
    opened = store.open()
    opened.save(Saved({"i": 1}, {}, {}), [])
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
    assert [record.message for record in caplog.records] == ["store", "store"]
    again.close()
    path.write_bytes(b"damaged again")
    store.open().close()
    assert (tmp_path / "state.sqlite.damaged").read_bytes() == bytes(data)
    assert (tmp_path / "state.sqlite.damaged2").read_bytes() == b"damaged again"


def test_a_copy_that_cannot_be_made_is_told_by_the_health_until_it_is(tmp_path: Path) -> None:
    """On a full disk the log told it once, and all was well."""
    port, before = free_port(), tmp_path / "state.sqlite.before"
    with served(config(tmp_path, port)):
        send(port, lines(10), 10)
    before.mkdir()
    with served(config(tmp_path, port)) as running:
        wait_for(lambda: before.name in running.ails.get("copy of the store", ""))
        before.rmdir()
        wait_for(lambda: not running.ails)
        assert before.is_file()


@pytest.mark.costly
def test_two_services_do_not_share_a_store_or_a_record(tmp_path: Path) -> None:
    port, record = free_port(), str(tmp_path / "record.jsonl")
    with served(config(tmp_path, port, record=record)):
        send(port, lines(4), 4)
        for path in ("state.sqlite", "other.sqlite"):
            other = config(tmp_path, free_port(), record=record, store={"kind": "sqlite", "path": str(tmp_path / path)})
            with pytest.raises(ConfigError):
                Running(load_service(other)).run()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["record.jsonl", "state.sqlite"]


def goes_on(config: dict[str, object]) -> float | None:
    """Return the time of the state that a service begins with."""
    running = Running(load_service(config))
    window = running.kept.open()
    running.kept.close()
    return None if window is None else window.state.time


def test_a_state_of_another_config_is_used_where_it_fits_and_what_changed_is_told(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    port = free_port()
    given = config(tmp_path, port)
    with served(given):
        send(port, lines(10), 10)
    last = undisturbed(lines(10)).time
    assert goes_on(given) == last
    assert not caplog.records
    less = {**TRACKER["sensors"], "north": {**TRACKER["sensors"]["north"], "detection_probability": 0.8}}
    assert goes_on({**given, "sensors": less}) == last
    assert [vars(record)["changed"] for record in caplog.records if "changed" in vars(record)] == [
        ["sensors.north.detection_probability"]
    ]
    other = {"kind": "kalman", "motion": {"kind": "constant_acceleration", "sigma_jerk": 0.1}}
    spread = {"kind": "from_returns", "spread": {"vx": 4.0, "vy": 4.0, "ax": 1.0, "ay": 1.0}}
    assert goes_on({**given, "estimator": other, "birth": spread}) is None
    assert caplog.records[-1].levelname == "ERROR"


@pytest.mark.parametrize(
    ("changed", "why"),
    [
        ({"clocks": None}, "TypeError"),
        ({"missed": {"0 north": [[1, 2, 3]]}}, "ValueError"),
        ({"missed": [1]}, "AttributeError"),
        ({"recorded": {}}, "TypeError"),
        ({"made": {}}, "KeyError: 'axes'"),
    ],
)
def test_a_state_of_another_layout_is_left_out_and_told(
    changed: Mapping[str, Any], why: str, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """As another Vedette may have written it: the service began with KeyError, again and again."""
    given = {**config(tmp_path, 1), "inputs": [feed()]}
    ran(given, [numbered("north", 1, 1.0, [[0.0, 0.0]], [])])
    store = SqliteStore(path=str(tmp_path / "state.sqlite")).open()
    saved = store.load()
    assert saved is not None
    store.save(evolve(saved, states={**saved.states, **changed}), [])
    store.close()
    assert goes_on(given) is None
    assert vars(caplog.records[-1])["why"].startswith(why)


def test_ids_go_on_where_a_state_is_left_out(tmp_path: Path) -> None:
    """They began at 0 again, and an export joined strangers: also to those that only outputs were told of."""
    given = {**config(tmp_path, 1), "inputs": [feed()]}
    first = ran(given, [Arrival(line, 0.0) for line in lines(20)]).state
    other = {**given, "lifecycle": {"kind": "m_of_n"}}
    second = ran(other, [Arrival(line, 0.0) for line in lines(40)[20:]]).state
    assert first is not None
    assert second is not None
    assert 0 < first.born <= min(second.ids)
    again = ran({**given, "sensors": TRACKER["sensors"]}, [Arrival(line, 0.0) for line in lines(60)[40:]]).state
    assert again is not None
    assert second.born <= min(again.ids)


def test_counts_of_another_layout_are_left_out_with_their_state(tmp_path: Path) -> None:
    given = {**config(tmp_path, 1), "inputs": [feed()]}
    ran(given, [numbered("north", 1, 1.0, [[0.0, 0.0]], [])])
    store = SqliteStore(path=str(tmp_path / "state.sqlite")).open()
    saved = store.load()
    assert saved is not None
    store.save(evolve(saved, counters={"scans_taken_total": {"north": 1}}), [])
    store.close()
    assert goes_on(given) is None


def test_a_database_of_another_program_is_refused_and_left_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / "state.sqlite"
    with closing(sqlite3.connect(path)) as direct, direct:
        direct.execute("CREATE TABLE bookmarks (place)")
    with pytest.raises(InputError, match="another program"):
        SqliteStore(path=str(path)).open()
    with closing(sqlite3.connect(path)) as direct, direct:
        assert direct.execute("SELECT name FROM sqlite_master").fetchall() == [("bookmarks",)]


def test_a_store_without_a_column_is_refused_and_one_in_another_order_is_used(tmp_path: Path) -> None:
    """Each save failed, which the health alone told."""
    given, path = {**config(tmp_path, 1), "inputs": [feed()]}, tmp_path / "state.sqlite"
    SqliteStore(path=str(path)).open().close()
    with closing(sqlite3.connect(path)) as direct, direct:
        direct.execute("ALTER TABLE tracks DROP COLUMN confirmed")
    with pytest.raises(InputError, match=r"tracks\.confirmed"):
        ran(given, [])
    with closing(sqlite3.connect(path)) as direct, direct:
        direct.execute("ALTER TABLE tracks ADD COLUMN confirmed INTEGER NOT NULL DEFAULT 0")
    counts = ran(given, [Arrival(line, 0.0) for line in lines(40)]).counters.counts
    assert counts["saves_failed_total"] == 0
    with closing(sqlite3.connect(path)) as direct, direct:
        assert set(direct.execute("SELECT confirmed, typeof(mean), typeof(cov) FROM tracks")) == {(1, "text", "text")}


def test_a_state_of_other_code_is_told(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    port = free_port()
    with served(config(tmp_path, port)):
        send(port, lines(10), 10)
    own = saving.identity
    monkeypatch.setattr(saving, "identity", lambda packages: {**own(packages), "numpy": "1.0"})
    assert goes_on(config(tmp_path, port)) is not None
    assert [len(vars(record)["changed"]) for record in caplog.records if "changed" in vars(record)] == [1]


def test_tracks_are_rows_and_old_ones_are_pruned(tmp_path: Path) -> None:
    port = free_port()
    given = config(tmp_path, port)
    given["service"] = {**given["service"], "store": {**given["service"]["store"], "keep": "30 s"}}  # type: ignore[dict-item, index]
    with served(given):
        send(port, lines(60), 60)
    with closing(sqlite3.connect(tmp_path / "state.sqlite")) as direct, direct:
        rows = direct.execute("SELECT time, id, x, y, confirmed FROM tracks ORDER BY time").fetchall()
    expected, tracker = undisturbed(lines(60)), vedette.build(TRACKER)
    assert rows[0][0] >= expected.time - 30.0 - 9 * 1.5
    last = {row[1]: row[2:4] for row in rows if row[0] == expected.time}
    means = tracker.estimate(expected).mean
    for i in np.flatnonzero(expected.confirmed):
        assert last[int(expected.ids[i])] == tuple(means[i, :2])
    assert all(row[4] for row in rows)


def test_a_report_far_ahead_prunes_nothing_until_those_after_it_bear_it_out(tmp_path: Path) -> None:
    """One wrong time, a week ahead, deleted all that was kept."""
    ahead, given = 8 * 86400.0, {**config(tmp_path, 1), "inputs": [feed()]}
    running = ran(given, [Arrival(line, 0.0) for line in lines(40)])
    assert running.state is not None
    report = report_of(running.service, running.state)
    store = SqliteStore(path=str(tmp_path / "state.sqlite")).open()
    saved = store.load()
    assert saved is not None

    def oldest() -> float:
        with closing(sqlite3.connect(tmp_path / "state.sqlite")) as direct:
            return float(direct.execute("SELECT MIN(time) FROM tracks").fetchone()[0])

    before = oldest()
    for k in range(11):
        assert oldest() == before
        store.save(saved, [evolve(report, time=report.time + (ahead if k else 0.0) + k)])
    store.close()
    assert oldest() == report.time + ahead + 1


def test_a_stopped_service_has_kept_the_tracks_within_its_horizon_and_a_restart_keeps_them_anew(tmp_path: Path) -> None:
    """A late scan after the restart changes them: what was kept of them at the stop is replaced."""
    base, todo = tmp_path / "state.sqlite", lines(80)
    given = {**config(tmp_path, 1, horizon="10 s"), "inputs": [feed()]}
    rows = list[list[tuple[float, int, str]]]()
    for part in ([*todo[:57], *todo[58:60]], [todo[57], *todo[60:]]):
        ran(given, tuple(Arrival(line, 1e6) for line in part))
        with closing(sqlite3.connect(base)) as direct:
            rows.append(direct.execute("SELECT time, id, mean FROM tracks ORDER BY time, id").fetchall())
    assert rows[0][-1][0] == 1.5 * 59
    state, built = undisturbed([]), vedette.build(TRACKER)
    expected = list[tuple[float, int, str]]()
    for line in todo:
        told = json.loads(line)
        state = built.step(state, vedette.Scan(told["time"], told["sensor"], vedette.Detections.of(told["z"], 2)))
        of = zip(state.ids.tolist(), built.estimate(state).mean.tolist(), state.confirmed.tolist(), strict=True)
        expected += sorted((state.time, number, json.dumps(mean)) for number, mean, confirmed in of if confirmed)
    assert rows[1] == expected
