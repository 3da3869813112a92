"""One kind of progress for runs, studies and reproductions: it wraps what is looped over."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from typing import Any

import pytest

import vedette
from vedette.progress import silent
from vedette_report.progress import on_terminal

CONFIG: dict[str, Any] = {
    "source": {
        "kind": "simulation",
        "duration": 4,
        "looks": {"radar": {"interval": 1, "first": 1}},
        "ships": {"one": {"start": [0, 0], "speed": 5}},
    },
    "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0}},
    "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
    "associator": {"kind": "nearest"},
    "birth": {"kind": "from_returns", "spread": {"vx": 10, "vy": 10}},
    "lifecycle": {"kind": "m_of_n"},
}


class Heard:
    """Notes what it wraps and how much of it was given out."""

    def __init__(self) -> None:
        self.loops: dict[str, list[Any]] = {}

    def __call__(self, items: Sequence[Any], about: str, /) -> Iterator[Any]:
        given = self.loops.setdefault(about, [])
        for item in items:
            given.append(item)
            yield item


def test_a_run_tells_its_scans() -> None:
    heard = Heard()
    result = vedette.load(CONFIG).run(progress=heard)
    assert [scan.time for scan in heard.loops["tracking"]] == [scan.time for scan in result.scans]


def test_a_study_tells_its_runs() -> None:
    heard = Heard()
    vedette.monte_carlo(CONFIG, 7, chunk=3, sweep={"sensors.radar.sigma": [4.0, 5.0]}, progress=heard)
    assert heard.loops == {"runs": list(range(14))}


def test_nothing_is_shown_where_nobody_looks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: False)
    with on_terminal() as progress:
        assert progress is silent
    assert list(silent([1, 2], "things")) == [1, 2]
