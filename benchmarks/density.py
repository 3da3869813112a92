"""Kinds of association by the spacing of targets, beside an innovation's sigma of some 6 m: time, coverage, false tracks.

    python -m benchmarks.density                       300 targets, 15, 25 and 50 m apart on average
    python -m benchmarks.density --spacings 15 --kinds jpda gnn
    python -m benchmarks.density --targets 40 --spacings 150
    python -m benchmarks.density --targets 30 --spacings 150 --kinds lmb gnn --births uniform

Targets are uniform over a square and drift at some 1 m/s; sigma 5 m, P_D .9, 1e-5 false returns a m^2, 25 scans of seed 1.
Covered: the least share of targets with a confirmed track within 15 m from the tenth scan on; told apart: the share that has
one of its own at the end.
"""

from __future__ import annotations

import argparse
from time import process_time

import numpy as np
from scipy.optimize import linear_sum_assignment

import vedette
from vedette import Detections, Scan

SCANS, SIGMA, CLUTTER, NEAR = 25, 5.0, 1e-5, 15.0
KINDS = {
    "nearest": {"kind": "nearest"},
    "gnn": {"kind": "gnn"},
    "pda": {"kind": "pda"},
    "m_best_jpda": {"kind": "m_best_jpda"},
    "jpda": {"kind": "jpda"},
    "jpda_star": {"kind": "jpda_star"},
    "k_best": {"kind": "k_best", "hypotheses": 20},
    "n_scan": {"kind": "n_scan", "hypotheses": 20},
    "lmb": {"kind": "lmb"},
    "variational": {"kind": "variational"},
}


def line(kind: str, spacing: float, targets: int, births: str) -> str:
    """Return a row of the table."""
    side = spacing * np.sqrt(targets)
    birth = {"kind": births, "spread": {"vx": 2.0, "vy": 2.0}}
    if births == "uniform":
        birth |= {"view": {axis: {"low": 0.0, "high": side} for axis in "xy"}, "initial": targets, "rate": 0.1}
    tracker = vedette.build({
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.2}},
        "sensors": {"radar": {
            "kind": "cartesian_position", "sigma": SIGMA, "detection_probability": 0.9, "clutter_density": CLUTTER}},
        "associator": KINDS[kind],
        "birth": birth,
        "lifecycle": {"kind": "existence"},
    })  # fmt: skip
    rng = np.random.default_rng(1)
    start, speed = rng.uniform(0, side, (targets, 2)), rng.normal(0, 1, (targets, 2))
    state, spent, covered, false, own = tracker.start(), [], [], [], 0.0
    for time in range(SCANS):
        at = start + speed * time
        seen = at[rng.random(targets) < 0.9]
        clutter = int(rng.poisson(CLUTTER * side * side))
        z = np.concatenate([seen + rng.normal(0, SIGMA, seen.shape), rng.uniform(0, side, (clutter, 2))])
        began = process_time()
        state = tracker.step(state, Scan(float(time), "radar", Detections.of(z, 2)))
        spent.append(1e3 * (process_time() - began))
        order = tracker.state.locate(tracker.sensors["radar"].observes)
        shown = tracker.estimate(state).mean[state.confirmed][:, order]
        if time >= 9:
            apart = np.linalg.norm(shown[:, None] - at[None], axis=-1)
            covered.append(float(np.mean((apart <= NEAR).any(axis=0))))
            false.append(int(np.count_nonzero((apart > NEAR).all(axis=1))))
            pairs = linear_sum_assignment(np.minimum(apart, NEAR))
            own = float(np.count_nonzero(apart[pairs] < NEAR)) / targets
    cells = [f"{spacing:g}", kind, f"{np.median(spent):.1f}", f"{np.quantile(spent, 0.95):.1f}", f"{min(covered):.3f}"]
    return f"| {' | '.join([*cells, f'{own:.3f}', f'{np.mean(false):.1f}'])} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser("python -m benchmarks.density", description=__doc__)
    parser.add_argument("--spacings", type=float, nargs="+", default=[15.0, 25.0, 50.0])
    parser.add_argument("--targets", type=int, default=300)
    parser.add_argument("--births", default="from_returns", choices=["from_returns", "uniform"])
    parser.add_argument("--kinds", nargs="+", default=list(KINDS), choices=list(KINDS))
    given = parser.parse_args()
    print("| spacing m | kind | median ms | p95 ms | covered | told apart | false |\n" + "| --- " * 7 + "|")
    for spacing in given.spacings:
        for kind in given.kinds:
            print(line(kind, spacing, given.targets, given.births), flush=True)


if __name__ == "__main__":
    main()
