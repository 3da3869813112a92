"""Time, memory and coverage of examples/swarm.toml, as it is or with as many targets as asked for at the same density.

    python -m benchmarks.swarm                          jpda and gnn, 1,000 targets
    python -m benchmarks.swarm --seeds 1 2 3            the same of several scenes
    python -m benchmarks.swarm --targets 100 300 1000 3000 10000 --plot docs/many-targets.svg

Each line is a process of its own: CPU time of `Tracker.step` over the scans (median, 95th percentile, worst), resident
memory beyond the idle process that has built the tracker and drawn its scans, the share of targets with a confirmed track
within 20 m (the least from the tenth scan on, and the last), false confirmed tracks, and the share of inexact weights.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
from itertools import product
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

import vedette

ROOT = Path(__file__).parent.parent
NEAR = 20.0
OWN = {"gnn": ("birth.initial=0.45", "lifecycle.delete=0.15"), "variational": ("lifecycle.confirm=0.8",)}
"""What else a hard choice takes to cover as many targets as soon; and `variational`, which makes several tracks
that may be one target one track, so that no more false ones are confirmed. Chosen on seeds 1 to 3.
"""
COLUMNS = (
    *("targets", "seed", "returns", "tracks", "associator", "median ms", "p95 ms", "worst ms"),
    *("MB", "covered", "false", "not exact"),
)
FIRST = 9
"""Scans after which coverage counts."""


def overrides(associator: str, targets: int) -> list[str]:
    """Return what makes the example one of so many targets."""
    side, places = 150.0 * math.sqrt(targets), ("source.populations.target.area", "source.looks.radar.clutter")
    squares = [f"{place}.{axis}.high={side:.1f}" for place in places for axis in "xy"]
    return [
        f"associator.kind={associator}",
        *OWN.get(associator, ()),
        f"source.populations.target.count={targets}",
        *squares,
    ]


def resident() -> float:
    """Return the resident memory in MB."""
    with Path("/proc/self/statm").open() as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


def measure(associator: str, targets: int, more: list[str]) -> dict[str, Any]:
    """Return the figures of one run."""
    experiment = vedette.load(ROOT / "examples" / "swarm.toml", overrides=[*overrides(associator, targets), *more])
    steps = experiment.steps()
    tracker, truth = experiment.tracker, steps.recording.truth
    scans = list(steps.recording.scans)
    state, idle = tracker.start(seed=1), resident()
    seconds, memory, covered, false, judged = [], idle, [], [], 0
    for i, scan in enumerate(scans):
        judged += len(state.ids)
        began = process_time()
        state = tracker.step(state, scan)
        seconds.append(process_time() - began)
        memory = max(memory, resident())
        shown = tracker.estimate(state).mean[state.confirmed][:, tracker.state.locate(truth[0].space)][:, :2]
        there = np.array([each.at(scan.time)[:2] for each in truth])
        if i >= FIRST and len(shown):
            covered.append(float(np.mean(cKDTree(shown).query(there)[0] <= NEAR)))
            false.append(int(np.count_nonzero(cKDTree(there).query(shown)[0] > NEAR)))
    return {
        "associator": associator,
        "targets": targets,
        "returns": float(np.mean([len(scan.detections.z) for scan in scans])),
        "tracks": len(state.ids),
        "median": 1e3 * float(np.median(seconds)),
        "p95": 1e3 * float(np.quantile(seconds, 0.95)),
        "worst": 1e3 * max(seconds),
        "MB": memory - idle,
        "covered": min(covered, default=0.0),
        "covered_last": covered[-1] if covered else 0.0,
        "false": float(np.mean(false)) if false else 0.0,
        "approximated": state.approximated / judged if judged else 0.0,
    }


def alone(associator: str, targets: int, seed: int, more: list[str]) -> dict[str, Any]:
    """Return the figures of one run in a process of its own."""
    command = [sys.executable, "-m", "benchmarks.swarm", "--one", associator, "--targets", str(targets)]
    for one in (f"seed={seed}", *more):
        command += ["--set", one]
    known = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    done = subprocess.run(command, check=True, capture_output=True, text=True, cwd=ROOT, env=known)
    return json.loads(done.stdout) | {"seed": seed}


def plot(rows: list[dict[str, Any]], path: Path) -> None:
    """Draw how time and memory grow."""
    import matplotlib as mpl

    mpl.use("svg")
    mpl.rcParams["svg.hashsalt"] = "swarm"
    import matplotlib.pyplot as plt

    figure, panels = plt.subplots(1, 2, figsize=(9, 3.5), layout="constrained")
    for panel, (what, label) in zip(panels, (("p95", "95th percentile of a scan, ms"), ("MB", "memory, MB")), strict=True):
        for name in dict.fromkeys(row["associator"] for row in rows):
            own = [row for row in rows if row["associator"] == name]
            sizes = sorted({row["targets"] for row in own})
            worst = [max(row[what] for row in own if row["targets"] == size) for size in sizes]
            panel.loglog(sizes, worst, "o-", label=name)
        panel.set(xlabel="targets", ylabel=label)
        panel.grid(alpha=0.3)
        panel.legend()
    figure.savefig(path, metadata={"Date": None})


def line(row: dict[str, Any]) -> str:
    """Return a line of the table."""
    cells = [f"{row['targets']:,}", f"{row['seed']}", f"{row['returns']:,.0f}", f"{row['tracks']:,}", row["associator"]]
    cells += [f"{row[what]:.1f}" for what in ("median", "p95", "worst")] + [f"{row['MB']:.0f}"]
    cells += [f"{row['covered']:.3f} to {row['covered_last']:.3f}", f"{row['false']:.0f}", f"{row['approximated']:.1%}"]
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser("python -m benchmarks.swarm", description=__doc__)
    parser.add_argument("--targets", type=int, nargs="+", default=[1000])
    parser.add_argument("--associators", nargs="+", default=["jpda", "gnn"])
    parser.add_argument("--seeds", type=int, nargs="+", default=[1], help="of the scene; each is a run")
    parser.add_argument("--set", action="append", default=[], help="further overrides of the config")
    parser.add_argument("--plot", type=Path, help="an SVG file of how time and memory grow")
    parser.add_argument("--one", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.one:
        print(json.dumps(measure(given.one, given.targets[0], given.set)))
        return
    rows = []
    print(f"| {' | '.join(COLUMNS)} |\n" + "| --- " * len(COLUMNS) + "|")
    for targets, name, seed in product(given.targets, given.associators, given.seeds):
        row = alone(name, targets, seed, given.set)
        rows.append(row)
        print(line(row), flush=True)
    if given.plot:
        plot(rows, given.plot)


if __name__ == "__main__":
    main()
