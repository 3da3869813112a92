"""Contenders take turns, A B C A B C .., so that a machine that slows down slows all of them; only ratios count."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median, quantiles
from time import monotonic
from typing import Any

import numpy as np

from benchmarks.contenders.textbook import solve
from benchmarks.problems import make
from benchmarks.worker import SIZES

ROOT = Path(__file__).parent.parent
ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
AGREE = 1e-9
"""Tolerance of means and covariances, relative to their largest entry."""


class Refused(Exception):
    """A contender's answer does not fit the problem, or is missing."""


class Contender:
    """A worker process. `absent` says why there is none."""

    def __init__(self, name: str, module: str, python: str = sys.executable, **environment: str) -> None:
        self.name = name
        command = [python, "-m", "benchmarks.worker", module]
        known = {**os.environ, **ONE_THREAD, "PYTHONPATH": str(ROOT), **environment}
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, cwd=ROOT, env=known
        )
        self.hello = self._read()
        self.absent: str | None = self.hello.get("absent")
        self.version: str = self.hello.get("version", "")

    def ask(self, what: str, **more: Any) -> dict[str, Any]:
        """Send one request and return its answer."""
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps({"ask": what, **more}) + "\n")
        self._process.stdin.flush()
        answer = self._read()
        if "failed" in answer:
            raise Refused(f"{self.name}: {answer['failed']}")
        return answer

    def _read(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        return json.loads(line) if line else {"absent": "its process ended", "failed": "its process ended"}

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.close()
        self._process.wait(timeout=10)
        self._process.stdout.close()


@dataclass(frozen=True)
class Case:
    """A problem's figures."""

    family: str
    modes: int = 1
    tracks: int | None = None
    returns: int = 1
    steps: int = 50
    axes: int = 2

    @property
    def sizes(self) -> dict[str, Any]:
        return {size: getattr(self, size) for size in SIZES}


@dataclass
class Spread:
    """A median and its quartiles."""

    middle: float
    low: float
    high: float

    @classmethod
    def of(cls, values: list[float]) -> Spread:
        low, _, high = quantiles(values, n=4) if len(values) > 1 else (values[0],) * 3
        return cls(median(values), low, high)


@dataclass
class Race:
    """Seconds a step of every entry, round by round; an entry is a contender's name and level."""

    case: Case
    each: dict[tuple[str, str], list[float]] = field(default_factory=dict)
    refused: dict[tuple[str, str], str] = field(default_factory=dict)

    def seconds(self, entry: tuple[str, str]) -> Spread | None:
        """Return the seconds a step."""
        return Spread.of(self.each[entry]) if self.each.get(entry) else None

    def ratio(self, entry: tuple[str, str], base: tuple[str, str]) -> Spread | None:
        """Return `base`'s multiple that `entry` takes: quotients within each round."""
        pairs = list(zip(self.each.get(entry, []), self.each.get(base, []), strict=False))
        return Spread.of([a / b for a, b in pairs]) if pairs else None


def run(
    case: Case, entries: list[tuple[Contender, str]], rounds: int, sample: float, budget: float, tolerance: dict[str, float]
) -> Race:
    """Run all entries that offer the case, after each has shown that it solves it.

    A sample takes at least `sample` s; rounds end early, after a fifth of them but no fewer than two, when `budget` s are
    spent.
    """
    race = Race(case)
    truth = solve(make(**case.sizes))
    ready: list[tuple[Contender, str, int]] = []
    for contender, level in entries:
        if contender.absent is not None:
            continue
        try:
            _agree(
                contender, contender.ask("answer", level=level, **case.sizes), truth, tolerance.get(contender.name, AGREE)
            )
            ready.append((contender, level, _repeats(contender, level, case, sample)))
        except Refused as reason:
            race.refused[contender.name, level] = str(reason)
    end = monotonic() + budget
    for i in range(rounds):
        if i >= max(2, rounds // 5) and monotonic() > end:
            break
        for contender, level, repeats in ready:
            answer = contender.ask("time", level=level, repeats=repeats, **case.sizes)
            race.each.setdefault((contender.name, level), []).append(answer["each"])
    for contender in {contender for contender, _ in entries if contender.absent is None}:
        contender.ask("forget")
    return race


def _agree(contender: Contender, answer: dict[str, Any], truth: tuple[Any, Any], tolerance: float) -> None:
    for what, right in zip(("mean", "cov"), truth, strict=True):
        found = np.array(answer[what])
        off = np.max(np.abs(found - right)) / np.max(np.abs(right)) if found.shape == right.shape else np.inf
        if not off <= tolerance:
            raise Refused(f"{contender.name}: its {what} is off by {off:.1e} of the largest entry, over {tolerance:.0e}")


def _repeats(contender: Contender, level: str, case: Case, sample: float) -> int:
    """Return the number of runs that makes a sample long enough to be measured."""
    repeats = 1
    while (took := contender.ask("time", level=level, repeats=repeats, **case.sizes)["seconds"]) < sample:
        repeats = max(repeats + 1, min(100 * repeats, int(1.1 * repeats * sample / max(took, 1e-6))))
    return repeats
