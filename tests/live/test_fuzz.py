"""Streams of no meaning through whole services: nothing raises, grows or is lost count of."""

from __future__ import annotations

import os
import re
import resource
from collections.abc import Callable, Iterator
from itertools import dropwhile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from live.test_formats import CSV, JSON, SENTENCES, asterix_blocks
from support.services import TRACKER, feed, ran
from vedette.streams import Arrival

COLUMNS = ["time", "sensor", "x", "y"]
MORE = (
    b'{"time": 3.0, "sensor": "south", "z": [[1, 2]], "identity": ["a"], "noise": [[[4, 0], [0, 9]]]}\n',
    b'{"sensor": "north", "z": [[1e3, 2.5e-1]], "axes": ["y", "x"], "pose": {"position": [0, 1], "heading": 0.5}}\n',
)
SAMPLES: dict[str, tuple[dict[str, Any], Callable[[], bytes]]] = {
    "json": ({"kind": "json_lines"}, lambda: b"".join((*JSON, *MORE))),
    "csv": ({"kind": "csv_lines", "columns": COLUMNS}, lambda: b"".join(CSV)),
    "nmea": ({"kind": "nmea"}, lambda: b"".join(SENTENCES)),
    "asterix": ({"kind": "asterix"}, asterix_blocks),
}
GLUE = [
    b"\n",
    b"\x00",
    b"\xff" * 3,
    b"{",
    b"[" * 50,
    b"9" * 30,
    b",",
    b"!AIVDM,1,1,,A,",
    b"$GPGGA",
    b'"',
    b"nan",
    b"*00",
    b"0",
]


def datagrams(whole: bytes, count: int) -> Iterator[bytes]:
    """Yield pieces of some messages, most of them damaged."""
    rng = np.random.default_rng(5)
    for _ in range(count):
        begin, end = sorted(rng.integers(0, len(whole) + 1, 2).tolist()) if rng.random() < 0.3 else (0, len(whole))
        made = bytearray(whole[begin:end])
        for _ in range(int(rng.integers(0, 5))):
            at = int(rng.integers(0, len(made) + 1))
            how = rng.integers(4)
            if how == 0:
                made[at : at + 1] = bytes([int(rng.integers(256))])
            elif how == 1:
                made[at:at] = GLUE[int(rng.integers(len(GLUE)))]
            elif how == 2:
                del made[at : at + int(rng.integers(1, 9))]
            else:
                made[at:at] = made[max(at - 20, 0) : at]
        yield bytes(made)


def expected(name: str, data: bytes) -> int | None:
    """Return how many messages a datagram holds, right or wrong; None where that takes a decoder."""
    lines = [line for line in data.split(b"\n") if line.strip()]
    if name == "json":
        return len(lines)
    if name == "csv":
        texts = [line.decode(errors="replace").strip("\r\n") for line in lines]
        told = dropwhile(lambda text: text.lstrip().startswith("#"), filter(str.strip, texts))  # comments may come first
        rows = [[cell.strip() for cell in text.split(",")] for text in told]
        words = [len(row) == len(COLUMNS) and all(re.match(r"(?!nan$)[^\W\d_]", cell) for cell in row) for row in rows[:1]]
        return sum(row != COLUMNS for row in rows) - sum(words) + (rows[:1] == [COLUMNS])
    return None


def resident() -> float:
    """MB that this process holds."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() / 1e6


@pytest.mark.parametrize("count", [300, pytest.param(100_000, marks=pytest.mark.nightly("minutes"))])
@pytest.mark.parametrize("name", SAMPLES)
@pytest.mark.by_turns
def test_a_service_takes_or_refuses_whatever_comes(name: str, count: int) -> None:
    if name == "asterix":
        pytest.importorskip("asterix.generated")
    format_, sample = SAMPLES[name]
    total, held = 0, list[float]()

    def arrivals() -> Iterator[Arrival]:
        nonlocal total
        for i, data in enumerate(datagrams(sample(), count)):
            total += expected(name, data) or 0
            if i % max(count // 10, 1) == 0 and os.name == "posix" and Path("/proc/self/statm").exists():
                held.append(resident())
            yield Arrival(data, 1000.0 + i, f"sender {i}")

    polar = {"kind": "range_bearing", "sigma_range": 50.0, "sigma_bearing": 0.01, "detection_probability": 0.9}
    config = {
        **TRACKER,
        "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 1.0}},
        "sensors": {**TRACKER["sensors"], "polar": {**polar, "clutter_density": 2e-7}},
        "inputs": [feed(format=format_, scans={"clock": "receiver"}, sensors=NAMES[name])],
        "service": {"full": "wait", "horizon": "5 s", "origin": {"latitude": 37.8, "longitude": -122.3}},
    }
    running = ran(config, arrivals())
    counts = running.counters.counts
    assert counts["pieces_total"] == count
    assert not running.ails
    assert counts["messages_total"] == counts["messages_taken_total"] + counts["messages_refused_total"]
    assert min(counts["messages_taken_total"], counts["messages_refused_total"], counts["scans_taken_total"]) > count // 10
    assert not total or total == counts["messages_total"]
    assert len(running.listening.numbers.kept) <= 3
    if count > 10_000 and held:
        assert max(held) - held[3] < 10.0, held


NAMES: dict[str, dict[str, str]] = {
    "json": {},
    "csv": {},
    "nmea": {"": "north"},
    "asterix": {"2/17": "polar"},
}
