"""What users run: whole jobs, beside FilterPy and Stone Soup on the same scenes. The first table of `python -m benchmarks`.

    python -m benchmarks.users                  all jobs; --only WORDS: those whose title has these words
    python -m benchmarks.users --write          puts the table into docs/measured/speed.md

All take turns in one process and one thread, A B C A B C; the times are CPU times, the second least of the rounds: a
virtual machine's clock may skip 2 ms, by which a UKF's scan took .65 us for 4.3. Where two solve the same equations, they
must agree first. Where rules differ, as those by which tracks begin, only the scene is one.
"""

from __future__ import annotations

import argparse
import cProfile
import os
import pstats
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from benchmarks.table import digits, grid, quotient, verdict, write
from benchmarks.whole_jobs import EKF, IMM, UKF, Run, five_vessels, one_object, one_track
from benchmarks.whole_jobs.five_vessels import SCANS, watch

ROOT = Path(__file__).parent.parent
BEGIN, END = "<!-- users: begin -->", "<!-- users: end -->"
AGREE = 1e-6


@dataclass(frozen=True)
class Job:
    """A job by its title, what a time is of, how many of these it has, who does it, and the most that Vedette may take.

    `most`: a share of what another takes. `runs`: how often each does it in a round.
    """

    title: str
    unit: str
    count: int
    by: dict[str, Callable[[], Run]]
    most: dict[str, float]
    runs: int = 1


def command() -> Run:
    """Return the run of the whole command, from file to tracks; its CPU time is that of a process of its own."""

    def run() -> None:
        with tempfile.TemporaryDirectory() as folder:
            place = [str(ROOT / "examples" / "harbour.toml"), "--out", f"{folder}/out"]
            subprocess.run([sys.executable, "-m", "vedette", "run", *place], check=True, stdout=subprocess.DEVNULL)

    return run


JOBS = (
    Job(
        "filter and smooth one object at uneven times",
        "a position",
        one_object.POSITIONS,
        {"vedette": one_object.by_vedette, "filterpy": one_object.by_filterpy, "stonesoup": one_object.by_stonesoup},
        {"filterpy": 1 / 3},
    ),
    Job(
        "EKF, range and bearing",
        "a scan",
        50,
        {
            "vedette": lambda: one_track.fly(EKF),
            "filterpy": lambda: one_track.by_peer("filterpy", "ekf"),
            "stonesoup": lambda: one_track.by_peer("stonesoup", "ekf"),
        },
        {"filterpy": 1 / 5, "stonesoup": 1 / 80},
        10,
    ),
    Job(
        "UKF, range and bearing",
        "a scan",
        50,
        {"vedette": lambda: one_track.fly(UKF | {"kappa": 1.0}), "filterpy": lambda: one_track.by_peer("filterpy", "ukf")},
        {"filterpy": 1 / 15},
        10,
    ),
    Job(
        "IMM of two EKFs, range and bearing",
        "a scan",
        50,
        {"vedette": lambda: one_track.fly(IMM), "filterpy": one_track.imm_by_filterpy},
        {"filterpy": 1 / 20},
        10,
    ),
    Job(
        "1,000 particles, range and bearing",
        "a scan",
        50,
        {"vedette": one_track.particles_by_vedette, "stonesoup": one_track.particles_by_stonesoup},
        {"stonesoup": 1 / 5},
    ),
    Job(
        "five vessels, 25 returns a scan, births and deaths: gnn",
        "a scan",
        SCANS,
        {"vedette": lambda: watch(EKF, "gnn"), "stonesoup": five_vessels.by_stonesoup},
        {"stonesoup": 1 / 100},
    ),
    Job("the same: jpda", "a scan", SCANS, {"vedette": lambda: watch(EKF, "jpda")}, {}),
    Job("the same: IMM of two EKFs, jpda", "a scan", SCANS, {"vedette": lambda: watch(IMM, "jpda")}, {}),
    Job("the same: UKF, gnn", "a scan", SCANS, {"vedette": lambda: watch(UKF, "gnn")}, {}),
    Job("`vedette run examples/harbour.toml`, from file to tracks", "a run", 1, {"vedette": command}, {}),
)
SHORTER = {("stonesoup", "gnn"): 10}
"""Who does only a part of a job, one in so many scans."""


def spent() -> float:
    """Return the CPU seconds of this process and of those that it has waited for."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return process_time() + children.ru_utime + children.ru_stime


@dataclass(frozen=True)
class Found:
    """The second least seconds of each, or why it is left out; and where Vedette's time goes: its costliest functions."""

    job: Job
    seconds: dict[str, float]
    told: list[str]
    lines: list[str]


def measure(job: Job, rounds: int) -> Found:
    """Let all do a job in turns."""
    runs, told, answers = {}, [], {}
    for name, ready in job.by.items():
        try:
            runs[name] = ready()
            answers[name] = runs[name]()
        except ImportError as error:
            told.append(f"{job.title}: {name} is not there: {error}")
            continue
        right = answers.get("vedette")
        if right is not None and not np.allclose(answers[name], right, rtol=AGREE, atol=0.0):
            told.append(f"{job.title}: {name} is left out, as it finds {answers[name]}, not {right}")
            del runs[name]
    each: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(rounds):
        for name, run in runs.items():
            times, share = (job.runs if name == "vedette" else 1), SHORTER.get((name, job.title.rpartition(": ")[2]), 1)
            before = spent()
            for _ in range(times):
                run()
            each[name].append((spent() - before) * share / (times * job.count))
    seconds = {name: sorted(times)[:2][-1] for name, times in each.items()}
    return Found(job, seconds, told, [] if job.by["vedette"] is command else costliest(runs["vedette"]))


def costliest(run: Run) -> list[str]:
    """Return the five functions in which most of the time is spent, with their share."""
    profile = cProfile.Profile(process_time)
    for _ in range(5):
        profile.runcall(run)
    stats: Any = pstats.Stats(profile)
    total = sum(row[2] for row in stats.stats.values())
    first = sorted(stats.stats.items(), key=lambda item: -item[1][2])[:5]
    return [f"{_named(*place)} {row[2] / total:.0%}" for place, row in first]


def _named(path: str, line: int, name: str) -> str:
    if path == "~":
        return f"`{name.removeprefix('<built-in method ').removesuffix('>')}`"
    return f"`{Path(path).stem}.{name}`"


NAMES = {"vedette": "Vedette", "filterpy": "FilterPy", "stonesoup": "Stone Soup"}


def report(found: list[Found]) -> str:
    """Return the tables."""
    rows, targets, lines = [], [], []
    for one in found:
        us = {name: 1e6 * seconds for name, seconds in one.seconds.items()}
        rows.append([f"{one.job.title}, {one.job.unit}", *(digits(us[name]) if name in us else "" for name in NAMES)])
        for name, most in one.job.most.items():
            if name in us:
                ratio = us["vedette"] / us[name]
                against = f"{one.job.title}: Vedette / {NAMES[name]}"
                targets.append([against, quotient(ratio), quotient(most), verdict(ratio <= most)])
        if one.lines:
            lines.append(f"- {one.job.title}: {', '.join(one.lines)}")
    told = "\n".join(f"- {line}" for one in found for line in one.told)
    parts = [
        grid(["us", *NAMES.values()], rows),
        grid(["what", "measured", "at most", ""], targets) if targets else "",
        "Where Vedette's time goes, by `cProfile`, which counts calls of Python too dear:\n\n" + "\n".join(lines)
        if lines
        else "",
        told,
    ]
    return "\n\n".join(part for part in parts if part)


def table(words: str = "", rounds: int = 7, to: Path | None = None) -> str:
    """Measure the jobs whose title has these words; return the tables, and write them into a page if one is given."""
    chosen = [job for job in JOBS if words.lower() in job.title.lower()]
    text = report([measure(job, rounds) for job in chosen]) if chosen else ""
    if to is not None and text:
        write(text, to, BEGIN, END)
    return text


if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    parser = argparse.ArgumentParser("python -m benchmarks.users", description=__doc__)
    parser.add_argument("--only", default="", metavar="WORDS", help="jobs whose title has these words")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--write", action="store_true", help="write the table into docs/measured/speed.md")
    options = parser.parse_args()
    print(table(options.only, options.rounds, ROOT / "docs" / "measured" / "speed.md" if options.write else None))
