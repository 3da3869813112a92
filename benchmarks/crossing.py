"""Every kind of association on a published benchmark: four targets meet half-way and part (examples/crossing.toml).

    VEDETTE_DATA=FOLDER python -m benchmarks.crossing                 100 runs of seed 2018; some five minutes a core
    VEDETTE_DATA=FOLDER python -m benchmarks.crossing --runs 10       a rough picture
    VEDETTE_DATA=FOLDER python -m benchmarks.crossing --seed 1        other draws

FOLDER holds `mtt/run0.jsonl`, of which the truth is taken; detections are drawn as the benchmark says. All trackers meet
the same ones. GOSPA (c = 10 m, p = 2, alpha = 2) is that of the tracks of existence above .4, as the root of its mean square
over scans and runs; differences from `k_best` with 200 hypotheses are paired by runs, in mean squares. Identity switches:
how often another track than before covers a target, within 10 m, as in the CLEAR measures, of all four targets together.
"""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from time import process_time

import numpy as np
from numpy.typing import NDArray

import vedette
from vedette import Detections, Scan, Tracker
from vedette.metrics import covering, switches
from vedette.metrics.gospa import distances, gospa
from vedette.space import Array, Indices
from vedette.tracking import State

EXAMPLE = Path(__file__).parents[1] / "examples" / "crossing.toml"
SCANS, P_DETECT, SIGMA, FALSE, WIDTH = 81, 0.9, 1.0, 10.0, 300.0
SHOWN, CUTOFF = 0.4, 10.0
TRACKERS = {
    "k_best, 200": "{kind='k_best', hypotheses=200}",
    "k_best, 200, mean shown": "{kind='k_best', hypotheses=200, show='mean'}",
    "k_best, 20": "{kind='k_best', hypotheses=20}",
    "n_scan, 3 scans": "{kind='n_scan', scans=3, hypotheses=100}",
    "variational": "{kind='variational'}",
    "lmb": "{kind='lmb'}",
    "m_best_jpda, 200": "{kind='m_best_jpda', m=200}",
    "jpda": "{kind='jpda'}",
    "gnn": "{kind='gnn'}",
}
"""Name to the associator that is put into the example; birth, lifecycle and gate stay."""


def truth() -> dict[str, Mapping[float, Array]]:
    """Return of each target its positions (2,) by time."""
    folder = os.environ.get("VEDETTE_DATA")
    if not folder:
        raise SystemExit("VEDETTE_DATA: must name the folder that holds mtt/run0.jsonl")
    found: dict[str, dict[float, Array]] = {}
    for line in (Path(folder) / "mtt" / "run0.jsonl").read_text().splitlines():
        row = json.loads(line)
        if isinstance(row.get("truth"), str):
            found.setdefault(row["truth"], {})[row["time"]] = np.array(row["state"][:2])
    return {name: found[name] for name in sorted(found)}


def drawn(targets: Mapping[str, Mapping[float, Array]], seed: int, run: int) -> list[Scan]:
    """Return the detections of one run: each target's with its noise, then false ones, uniform over the square."""
    return drawn_with_sources(targets, seed, run)[0]


def drawn_with_sources(
    targets: Mapping[str, Mapping[float, Array]], seed: int, run: int
) -> tuple[list[Scan], list[NDArray[np.int64]]]:
    """Return the detections of one run, and the number of the target that each is of, -1 for none."""
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(run,)))
    scans, sources = [], []
    for time in map(float, range(SCANS)):
        there = [time in track for track in targets.values()]
        seen = np.array(there) & (rng.random(len(targets)) < P_DETECT)
        own = np.array([track[time] for track, is_seen in zip(targets.values(), seen, strict=True) if is_seen]).reshape(
            -1, 2
        )
        own = own + SIGMA * rng.standard_normal((len(own), 2))
        false = WIDTH * rng.random((rng.poisson(FALSE), 2))
        scans.append(Scan(time, "radar", Detections.of(np.concatenate([own, false]), 2)))
        sources.append(np.append(np.flatnonzero(seen), np.full(len(false), -1)))
    return scans, sources


def compared(tracker: Tracker, state: State, targets: Mapping[str, Mapping[float, Array]]) -> tuple[float, Array, Indices]:
    """Return the square of GOSPA, how far shown tracks are from targets (k, t), inf from absent ones, and their ids (t,)."""
    order = [tracker.state.names.index(axis) for axis in ("x", "y")]
    is_shown = state.existence > SHOWN
    shown = tracker.estimate(state).mean[is_shown][:, order]
    there = np.array([state.time in track for track in targets.values()])
    real = np.array([track[state.time] for track in targets.values() if state.time in track]).reshape(-1, 2)
    far = np.full((len(there), len(shown)), np.inf)
    far[there] = distances(real, shown)
    return gospa(far[there], CUTOFF).value ** 2, far, state.ids[is_shown]


def judged(seed: int, run: int) -> dict[str, tuple[float, float, int]]:
    """Return of each tracker the mean square of GOSPA in m^2 over a run, the mean CPU time of a step in ms, and switches."""
    targets, found = truth(), {}
    scans = drawn(targets, seed, run)
    for name, associator in TRACKERS.items():
        tracker = vedette.load(EXAMPLE, overrides=[f"associator={associator}"]).tracker
        state = tracker.start()
        total, spent, apart, present = 0.0, 0.0, [], []
        for scan in scans:
            begin = process_time()
            state = tracker.step(state, scan)
            spent += process_time() - begin
            square, far, ids = compared(tracker, state, targets)
            total += square
            apart.append(far)
            present.append(ids)
        cover = covering(apart, present, CUTOFF)
        found[name] = (total / SCANS, 1000 * spent / SCANS, sum(map(switches, cover.T)))
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.crossing", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--seed", type=int, default=2018)
    parser.add_argument("--jobs", type=int, default=1)
    given = parser.parse_args(arguments)
    with ProcessPoolExecutor(given.jobs) as pool:
        runs = list(pool.map(judged, [given.seed] * given.runs, range(given.runs)))
    squares = {name: np.array([run[name][0] for run in runs]) for name in TRACKERS}
    changes = {name: np.array([run[name][2] for run in runs]) for name in TRACKERS}
    best, root = squares["k_best, 200"], np.sqrt(given.runs)
    print(f"{given.runs} runs of seed {given.seed}\n")
    print(
        "| associator | RMS GOSPA [m] | paired difference of mean squares [m^2] | identity switches a run "
        "| CPU a step [ms] |\n"
        "| --- | --- | --- | --- | --- |"
    )
    for name, square in squares.items():
        rms, apart, changed = np.sqrt(np.mean(square)), square - best, changes[name]
        print(
            f"| {name} | {rms:.3f} +- {np.std(square) / root / (2 * rms):.3f} | {np.mean(apart):+.2f} +- "
            f"{np.std(apart) / root:.2f} | {np.mean(changed):.2f} +- {np.std(changed) / root:.2f} | "
            f"{np.mean([run[name][1] for run in runs]):.2f} |"
        )


if __name__ == "__main__":
    main()
