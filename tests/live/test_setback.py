"""Clocks that are set back, and senders that begin again: told, and gone on with."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from support.services import TRACKER, as_json, feed, lines, ran, replayed, undisturbed
from vedette.streams import Arrival
from vedette_live.setback import COUNT, Row

NOW = 4e9  # s, later than the clock by which a silence is told: how busy the machine is tells none
"""s since 1970 when the first line comes."""
Told = dict[str, Any]


def told(count: int = 80) -> list[Told]:
    """Return lines that come when they tell, without numbers."""
    return [{key: value for key, value in json.loads(line).items() if key != "n"} for line in lines(count)]


def sent(given: Iterable[Told], begin: float = NOW, every: float = 1.5, answers: list[bytes] | None = None) -> list[Arrival]:
    """Return lines that come in turn."""
    reply = None if answers is None else answers.append
    return [Arrival(f"{json.dumps(each)}\n".encode(), begin + every * k, "", reply) for k, each in enumerate(given)]


def later(given: Iterable[Told], by: float) -> list[Told]:
    return [{**each, "time": each["time"] + by} for each in given]


def config(folder: Path, **more: Any) -> Told:
    conduct = {"record": str(folder / "record.jsonl"), "store": {"kind": "sqlite", "path": str(folder / "state.sqlite")}}
    return {**TRACKER, "inputs": [feed(**more)], "service": {**conduct, "horizon": "4 s", "full": "wait"}}


def as_lines(given: Iterable[Told]) -> list[bytes]:
    return [json.dumps(each).encode() for each in given]


@pytest.mark.parametrize(
    ("pace", "since", "wanted"),
    [(1.0, 0.0, True), (1.2, 0.0, True), (0.1, 0.0, False), (3.0, 0.0, False), (1.0, 600.0, True)],
)
def test_a_row_of_a_clock_that_was_set_back_comes_as_its_times_are_apart(pace: float, since: float, wanted: bool) -> None:
    """What is sent again comes faster, and a clock that stands still slower. What came before at once costs one row."""
    row = Row()
    at_once = [row.add(0.1 * k, NOW) for k in range(int(10 * since))]
    found = [row.add(since + pace * k, NOW + k) for k in range(3 * COUNT)]
    assert any(found) is wanted
    assert not any(at_once)
    assert not any(Row().add(pace * k, NOW + k) for k in range(COUNT))


def test_after_clocks_of_all_sensors_were_set_back_tracks_begin_anew(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """All was refused for as long as they were set back, or until the store was moved away. The scans before are kept."""
    before, after = later(told(60), 3600.0), told(60)
    running = ran(config(tmp_path), sent([*before, *after]))
    assert caplog.messages.count("tracks begin anew") == 1
    assert running.ails == {}
    counts = running.counters.counts
    assert (counts["scans_taken_total"], counts["scans_refused_total"]) == (120 - COUNT, COUNT)
    first, state = undisturbed(as_lines(before)), running.state
    assert state is not None
    assert as_json(replayed(tmp_path / "record.jsonl.before", TRACKER)) == as_json(first)
    alone = undisturbed(as_lines(after[COUNT:]))
    assert as_json(replayed(tmp_path / "record.jsonl", TRACKER)) == as_json(alone)
    assert (state.time, state.steps, (state.ids - first.born).tolist()) == (alone.time, alone.steps, alone.ids.tolist())
    with closing(sqlite3.connect(tmp_path / "state.sqlite")) as direct:
        kept = [time for (time,) in direct.execute("SELECT DISTINCT time FROM tracks ORDER BY time")]
    assert [time for time in kept if time > 3600.0][-1] == before[-1]["time"]
    assert [time for time in kept if time < 3600.0][-1] == after[-1]["time"]
    again = ran(config(tmp_path), sent(later(told(80)[60:], 0.0)))
    assert as_json(replayed(tmp_path / "record.jsonl", TRACKER)) == as_json(undisturbed(as_lines(told(80)[COUNT:])))
    assert again.ails == {}


@pytest.mark.parametrize("restart", [0, 3])
def test_a_clock_of_one_sensor_that_is_set_back_is_told_and_moves_nothing(tmp_path: Path, restart: int) -> None:
    both = told(80)
    back = [*both[:40], *({**each, "time": each["time"] - 3600.0 * (each["sensor"] == "north")} for each in both[40:])]
    arrivals = sent(back)
    if restart:
        ran(config(tmp_path), arrivals[: 40 + restart])
    running = ran(config(tmp_path), arrivals[(40 + restart) * (restart > 0) :])
    assert list(running.ails) == ["sensor north"]
    kept = [each for k, each in enumerate(both) if k < 40 or each["sensor"] == "south"]
    assert as_json(running.state) == as_json(undisturbed(as_lines(kept)))


def test_a_sensor_that_is_in_time_but_seldom_keeps_the_tracks(tmp_path: Path) -> None:
    """After a restart, too."""
    both = told(80)
    often = [each for each in both if each["sensor"] == "south"]
    seldom = next(each for each in both if each["sensor"] == "north")
    ran(config(tmp_path), sent([seldom, *often[:20]]))
    running = ran(config(tmp_path), sent(later(often[20:], -3600.0), NOW + 60.0))
    assert list(running.ails) == ["sensor south"]


@pytest.mark.parametrize("sends", ["one", "at once", "still"])
def test_late_scans_that_are_of_no_clock_that_was_set_back_move_nothing(tmp_path: Path, sends: str) -> None:
    before, behind = later(told(80), 3600.0), told(80)
    if sends == "one":
        arrivals = sent([each for pair in zip(before[:40], behind[:40], strict=True) for each in pair])
        wanted = before[:40]
    elif sends == "at once":
        arrivals = [*sent(before), *(Arrival(line, NOW + 120.0) for line in as_lines(behind))]
        wanted = before
    else:
        arrivals, wanted = [*sent(before), *sent([{**each, "time": 7.0} for each in behind], NOW + 120.0)], before
    running = ran(config(tmp_path), arrivals)
    assert as_json(running.state) == as_json(undisturbed(as_lines(wanted)))
    assert not (tmp_path / "record.jsonl.before").exists()


def numbered(given: Iterable[Told]) -> list[Told]:
    return [{**each, "n": k} for k, each in enumerate(given)]


@pytest.mark.parametrize("restart", [False, True])
def test_a_numbered_sender_that_begins_again_at_0_is_gone_on_with(
    tmp_path: Path, restart: bool, caplog: pytest.LogCaptureFixture
) -> None:
    """All that it sent counted as come before, and was answered as kept, until its count was past the last one."""
    answers, anew = list[bytes](), list[bytes]()
    first, second = (numbered(each for each in told(count) if each["sensor"] == "north") for count in (160, 80))
    booted = later(second, 0.25)
    given = config(tmp_path, scans={"clock": "offset"})
    arrivals = sent(first, NOW, 3.0, answers), sent(booted, NOW + 300.0, 3.0, anew)
    if restart:
        ran(given, arrivals[0])
    running = ran(given, arrivals[1] if restart else [*arrivals[0], *arrivals[1]])
    counts = running.counters.counts
    assert caplog.messages.count("a sender counts anew") == 1
    late = counts["scans_refused_total"]
    assert counts["scans_taken_total"] + late == 120
    assert late <= COUNT
    assert counts["messages_repeated_total"] == COUNT
    assert running.ails == {}
    assert running.state is not None
    assert running.state.time == pytest.approx(NOW + 300.0 + 3.0 * 39)
    assert json.loads(anew[-1]) == {"ack": 39, "sensor": "north"}
    again = ran(given, sent(booted, NOW + 600.0)[-5:])
    assert again.counters.counts["messages_repeated_total"] == COUNT + 5


def test_a_numbered_sensor_alone_that_begins_again_has_new_tracks(tmp_path: Path) -> None:
    first, second = (numbered(each for each in told(count) if each["sensor"] == "north") for count in (160, 80))
    running = ran(config(tmp_path), sent([*later(first, 100.0), *second], NOW, 3.0))
    assert running.ails == {}
    assert running.state is not None
    assert running.state.time == second[-1]["time"]


def test_who_sends_all_again_counts_not_anew(tmp_path: Path) -> None:
    """Faster than its times are apart, or one line over two paths."""
    given = numbered(told(60))
    twice = [each for k in range(60) for each in (given[k], given[max(k - 20, 0)])]
    for arrivals in (
        [*sent(given), *(Arrival(line, NOW + 100.0 + 0.01 * k) for k, line in enumerate(as_lines(given)))],
        [Arrival(line, NOW + 0.75 * k) for k, line in enumerate(as_lines(twice))],
    ):
        running = ran({**TRACKER, "inputs": [feed()], "service": {"full": "wait"}}, arrivals)
        assert running.counters.counts["messages_repeated_total"] == 60
        assert running.listening.numbers.begins == {}
        assert as_json(running.state) == as_json(undisturbed(lines(60)))


def test_a_program_that_is_restarted_and_counts_anew_is_gone_on_with(tmp_path: Path) -> None:
    """Its clock is right: each line was refused, as its number did not rise."""
    first = numbered(told(60))
    second = numbered(told(120)[60:])
    running = ran({**TRACKER, "inputs": [feed()], "service": {"full": "wait"}}, sent([*first, *second]))
    counts = running.counters.counts
    assert running.ails == {}
    assert counts["messages_refused_total"] <= 2 * COUNT
    assert counts["scans_taken_total"] + counts["messages_refused_total"] == 120
