"""A contender in its own process: `python -m benchmarks.worker NAME`, one JSON request and one JSON answer per line.

Requests: {"ask": "answer", ...}, {"ask": "time", "repeats": n, ...} with the problem's figures and the level, and
{"ask": "memory"}. Time is the process's CPU time, over all its threads.
"""

from __future__ import annotations

import json
import os
import resource
import sys
from functools import cache
from importlib import import_module
from pathlib import Path
from time import process_time
from typing import Any

from benchmarks.job import Job
from benchmarks.problems import Problem, make

SIZES = ("family", "modes", "tracks", "returns", "steps", "axes")


def peak() -> float:
    """Return the process's peak memory so far in MB. Linux's `ru_maxrss` includes the process that forked it."""
    status = Path("/proc/self/status")
    if status.exists():
        return float(status.read_text().partition("VmHWM:")[2].split()[0]) / 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1024**2 if sys.platform == "darwin" else 1024)


def main(name: str) -> None:
    """Answer until the input ends. What libraries print goes to standard error."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)

    def say(**answer: Any) -> None:
        print(json.dumps(answer), file=answers, flush=True)

    try:
        contender = import_module(f"benchmarks.contenders.{name}")
    except (ImportError, OSError) as error:
        return say(absent=f"{type(error).__name__}: {error}".splitlines()[0])
    say(version=contender.VERSION, imported=peak())

    @cache
    def problem(*sizes: Any) -> Problem:
        return make(*sizes)

    @cache
    def job(level: str, *sizes: Any) -> tuple[Problem, Job]:
        posed = problem(*sizes)
        if (solve := contender.ENTRIES.get(posed.family, {}).get(level)) is None:
            raise LookupError(f"has no level {level!r} for {posed.family!r}")
        return posed, solve(posed)

    for line in sys.stdin:
        request = json.loads(line)
        if request["ask"] == "forget":
            problem.cache_clear()
            job.cache_clear()
            say()
            continue
        if request["ask"] == "memory":
            say(peak=peak())
            continue
        try:
            posed, todo = job(request["level"], *(request[size] for size in SIZES))
            if request["ask"] == "answer":
                mean, cov = todo.answer(todo.run())
                say(mean=mean.tolist(), cov=cov.tolist())
            else:
                before = process_time()
                todo.repeat(request["repeats"])
                spent = process_time() - before
                say(seconds=spent, each=spent / (request["repeats"] * posed.work * todo.share))
        except Exception as error:  # reported to the caller: the other contenders go on
            say(failed=f"{type(error).__name__}: {error}")
    return None


if __name__ == "__main__":
    main(sys.argv[1])
