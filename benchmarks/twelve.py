"""Every kind of association on a published scene: twelve targets in the plane, up to ten at once, that begin at four places.

    python -m benchmarks.twelve                    100 runs of both scenes; some 20 minutes of a core
    python -m benchmarks.twelve --runs 10          a rough picture
    python -m benchmarks.twelve --seed 2 --scenes dense

Vo, Vo, Labeled Random Finite Sets and Multi-Object Conjugate Priors, IEEE Trans. Signal Processing 61, 2013, and the linear
scene of Vo, Vo, Phung, IEEE T-SP 62, 2014. Truth moves without noise, trackers allow for 5 m/s^2; positions have 10 m of
noise, false returns are uniform over 2,000 m x 2,000 m. OSPA (c = 100 m, p = 1) is that of tracks of existence of at least
.5, as its mean over scans and runs; differences from `jpda` are paired by runs. All kinds that enumerate have as many
hypotheses, and meet the same returns.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from time import process_time

import numpy as np

import vedette
from vedette import Detections, Scan
from vedette.metrics import distances, ospa
from vedette.space import Array

SCANS, SIGMA, SIDE, CUTOFF, HYPOTHESES = 100, 10.0, 2000.0, 100.0, 200
SCENES = {"sparse": (0.98, 30.0), "dense": (0.88, 66.0)}
"""P_D and mean number of false returns a scan."""
PLACES = ((0, 0), (400, -600), (-800, -200), (-200, 800))
TARGETS = (
    *((0, 0, -10, 1, 70), (1, -10, 5, 1, 100), (2, 20, -5, 1, 70), (1, -7, -4, 20, 100)),
    *((1, -2.5, 10, 20, 100), (0, 7.5, -5, 20, 100), (2, 12, 7, 40, 100), (3, 15, -10, 40, 100)),
    *((2, 3, 15, 60, 100), (3, -3, -15, 60, 100), (0, -20, -15, 80, 100), (3, 15, -5, 80, 100)),
)
"""Place, velocity in m/s, first and last scan; the place is where the target was a scan before the first."""
KINDS = {
    "jpda": {"kind": "jpda"},
    "m_best_jpda": {"kind": "m_best_jpda", "m": HYPOTHESES},
    "jpda_star": {"kind": "jpda_star"},
    "k_best": {"kind": "k_best", "hypotheses": HYPOTHESES},
    "k_best, mean shown": {"kind": "k_best", "hypotheses": HYPOTHESES, "show": "mean"},
    "n_scan, 3 scans": {"kind": "n_scan", "scans": 3, "hypotheses": HYPOTHESES},
    "variational": {"kind": "variational", "hypotheses": HYPOTHESES},
    "lmb": {"kind": "lmb"},
    "gnn": {"kind": "gnn"},
    "nearest": {"kind": "nearest"},
    "pda": {"kind": "pda"},
}


def positions(scan: int) -> Array:
    """Return the positions (j, 2) of the targets that are there in a scan, counted from 1."""
    there = [(*PLACES[place], vx, vy, scan - first + 1) for place, vx, vy, first, last in TARGETS if first <= scan <= last]
    x, y, vx, vy, ago = np.array(there, dtype=float).T
    return np.stack([x + vx * ago, y + vy * ago], axis=-1)


def drawn(seed: int, run: int, p_detect: float, false: float) -> Iterator[tuple[Array, Scan]]:
    """Yield of each scan where the targets are (j, 2), and its returns."""
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(run,)))
    for scan in range(1, SCANS + 1):
        there = positions(scan)
        own = there[rng.random(len(there)) < p_detect]
        clutter = SIDE * (rng.random((rng.poisson(false), 2)) - 0.5)
        z = np.concatenate([own + SIGMA * rng.standard_normal(own.shape), clutter])
        yield there, Scan(float(scan), "radar", Detections.of(z, 2))


def tracker(associator: dict[str, object], p_detect: float, false: float) -> vedette.Tracker:
    """Return the tracker with the scene's own parameters; a target survives a scan with probability .99."""
    lifetime = -1.0 / np.log(0.99)
    rate = 0.03 / (lifetime * 0.01)  # .03 of those who come in a scan at a place are there at its end
    appear = [
        {"at": {"x": [x, 10], "y": [y, 10], "vx": [0, 10], "vy": [0, 10]}, "initial": 0.03, "rate": rate} for x, y in PLACES
    ]
    return vedette.build({
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity_piecewise", "sigma_accel": 5.0}},
        "sensors": {"radar": {
            "kind": "cartesian_position", "sigma": SIGMA, "detection_probability": p_detect,
            "clutter_density": false / SIDE**2}},
        "gate": {"probability": 1.0, "largest_distance": 20.0},
        "associator": associator,
        "birth": {"kind": "poisson", "lifetime": lifetime, "appear": appear},
        "lifecycle": {"kind": "existence", "lifetime": lifetime, "confirm": 0.5, "show": 0.5, "delete": 1e-4},
    })  # fmt: skip


def judged(run: int, seed: int, scene: str, kinds: Sequence[str]) -> list[tuple[float, float]]:
    """Return of each kind the mean OSPA of a run in m, and the mean CPU time of a step in ms."""
    scans, found = list(drawn(seed, run, *SCENES[scene])), []
    for kind in kinds:
        one = tracker(KINDS[kind], *SCENES[scene])
        order, state, total, spent = one.state.locate(one.sensors["radar"].observes), one.start(), 0.0, 0.0
        for there, scan in scans:
            began = process_time()
            state = one.step(state, scan)
            spent += process_time() - began
            shown = one.estimate(state).mean[state.confirmed][:, order]
            total += ospa(distances(there, shown), CUTOFF, 1.0)
        found.append((total / SCANS, 1e3 * spent / SCANS))
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser("python -m benchmarks.twelve", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--seed", type=int, default=2013)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--scenes", nargs="+", default=list(SCENES), choices=list(SCENES))
    parser.add_argument("--kinds", nargs="+", default=list(KINDS), choices=list(KINDS))
    given = parser.parse_args(arguments)
    print(f"{given.runs} runs of seed {given.seed}\n\n| scene | associator | OSPA m | paired difference m | CPU a step ms |")
    print("| --- " * 5 + "|")
    for scene in given.scenes:
        with ProcessPoolExecutor(given.jobs) as pool:
            each = partial(judged, seed=given.seed, scene=scene, kinds=given.kinds)
            figures = np.array(list(pool.map(each, range(given.runs))))
        root = np.sqrt(given.runs)
        for i, kind in enumerate(given.kinds):
            value, apart = figures[:, i, 0], figures[:, i, 0] - figures[:, 0, 0]
            print(
                f"| {scene} | {kind} | {np.mean(value):.2f} +- {np.std(value) / root:.2f} | {np.mean(apart):+.2f} +- "
                f"{np.std(apart) / root:.2f} | {np.mean(figures[:, i, 1]):.2f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
