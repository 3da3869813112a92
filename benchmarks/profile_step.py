"""Where the time of a scan goes: `python -m benchmarks.profile_step [kf|ekf|ukf|imm|pda|imm_pdaf|gnn ..]`.

Two views. Stages: one more walk through `Tracker.step` with a clock around each part that it calls; medians over many
scans, less the clock's own time, and the rest between the parts. Functions: own time by cProfile, which adds to each call
and so overstates calls against work; read the shares.
"""

from __future__ import annotations

import cProfile
import pstats
import sys
from collections.abc import Callable
from pathlib import Path
from statistics import median
from time import thread_time_ns
from typing import Any

import attrs

from benchmarks.contenders import vedette as contender
from benchmarks.contenders import vedette_kernels
from benchmarks.problems import Problem, make
from vedette import Detections, Scan, kernels
from vedette.tracking import tracker as tracker_module

CASES: dict[str, dict[str, Any]] = {
    "kf": {},
    "ekf": {},
    "ukf": {},
    "imm": {"modes": 2},
    "pda": {"returns": 8},
    "imm_pdaf": {"modes": 3, "returns": 8},
    "gnn": {"tracks": 200, "returns": 373, "steps": 1},
}
SCANS = 4000


class Watch:
    """Wraps functions so that each call adds its time to a name's sum; nested calls count for the outer one."""

    def __init__(self) -> None:
        self.spent: dict[str, int] = {}
        self._inside = False

    def around(self, name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        def timed(*arguments: Any, **named: Any) -> Any:
            if self._inside:
                return function(*arguments, **named)
            self._inside = True
            begin = thread_time_ns()
            try:
                return function(*arguments, **named)
            finally:
                self.spent[name] = self.spent.get(name, 0) + thread_time_ns() - begin
                self._inside = False

        return timed


class Part:
    """A tracker's part whose methods are watched; everything else is the part's own."""

    def __init__(self, part: Any, watch: Watch, names: dict[str, str]) -> None:
        self._part = part
        for method, name in names.items():
            setattr(self, method, watch.around(name, getattr(part, method)))

    def __getattr__(self, name: str) -> Any:
        return getattr(self._part, name)


WATCHED = {
    "estimator": ("predict", "evaluate", "update"),
    "associator": ("associate",),
    "lifecycle": ("predict", "review"),
    "gate": ("scores",),
}


def watched(tracker: Any, watch: Watch) -> Any:
    """Return the tracker with its parts watched. It is frozen and checks its parts, so they are set from outside."""
    same = attrs.evolve(tracker)
    for part, methods in WATCHED.items():
        stand_in = Part(getattr(tracker, part), watch, {method: f"{part}.{method}" for method in methods})
        object.__setattr__(same, part, stand_in)
        object.__setattr__(same._plan, part, stand_in)
    return same


def scans_of(problem: Problem) -> list[Scan]:
    return [Scan(i + 1.0, "radar", Detections.of(z)) for i, z in enumerate(problem.z)]


def walk(tracker: Any, begin: Any, scans: list[Scan], count: int, each: Callable[[], None]) -> list[int]:
    """Return the nanoseconds of each of `count` steps."""
    spent: list[int] = []
    while len(spent) < count:
        state = begin
        for scan in scans:
            each()
            before = thread_time_ns()
            state = tracker.step(state, scan)
            spent.append(thread_time_ns() - before)
    return spent


def stages(problem: Problem) -> None:
    """Print the time of each part of a step."""
    tracker = contender.tracker_of(problem)
    begin, scans = tracker.start(contender.prior_of(problem), 0.0), scans_of(problem)
    count = SCANS if problem.family != "gnn" else 200
    walk(tracker, begin, scans, count // 10, lambda: None)
    whole = median(walk(tracker, begin, scans, count, lambda: None))
    watch = Watch()
    rounds: list[dict[str, int]] = []

    def next_scan() -> None:
        rounds.append(watch.spent)
        watch.spent = {}

    loop: Any = tracker_module
    admitted, existence = loop.admitted, kernels.existence
    loop.admitted = watch.around("admission of the scan", admitted)
    kernels.existence = watch.around("kernels.existence", existence)
    try:
        walk(watched(tracker, watch), begin, scans, count, next_scan)
    finally:
        loop.admitted, kernels.existence = admitted, existence
    empty = Watch()
    nothing = empty.around("clock", lambda: None)
    clock = []
    for _ in range(1000):
        empty.spent = {}
        nothing()
        clock.append(empty.spent["clock"])
    parts = {name: median(one.get(name, 0) for one in rounds[1:]) - median(clock) for name in rounds[-1]}
    print(f"\n{problem.family}: {whole / 1e3:.2f} us a scan through Tracker.step, {vedette_kernels.WHICH}")
    for name, spent in sorted(parts.items(), key=lambda item: -item[1]):
        print(f"  {name:28s} {spent / 1e3:8.2f} us {spent / whole:6.0%}")
    rest = whole - sum(parts.values())
    print(f"  {'the step itself':28s} {rest / 1e3:8.2f} us {rest / whole:6.0%}")


def functions(problem: Problem, most: int = 12) -> None:
    """Print the functions with the largest own time."""
    tracker = contender.tracker_of(problem)
    begin, scans = tracker.start(contender.prior_of(problem), 0.0), scans_of(problem)
    profile = cProfile.Profile()
    count = SCANS if problem.family != "gnn" else 50
    profile.runcall(walk, tracker, begin, scans, count, lambda: None)
    stats: dict[Any, Any] = pstats.Stats(profile).stats  # type: ignore[attr-defined]
    found = {where: entry for where, entry in stats.items() if where[0] != __file__}
    total = sum(entry[2] for entry in found.values())
    print("  own time by function, under cProfile:")
    for (file, _, name), (_, calls, own, _, _) in sorted(found.items(), key=lambda item: -item[1][2])[:most]:
        where = "" if file == "~" else f"{Path(file).parent.name}/{Path(file).name}: "
        print(f"  {own / total:6.0%} {calls / count:7.1f} calls a scan  {where}{name}")


if __name__ == "__main__":
    for family in sys.argv[1:] or CASES:
        if family not in CASES:
            sys.exit(f"{family}: must be one of {', '.join(CASES)}")
        posed = make(family, **CASES[family])
        stages(posed)
        functions(posed)
