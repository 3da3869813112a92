"""Two boats 12 m apart for a minute and a half, 300 m from a radar whose cells merge them half of the time."""

import sys

import numpy as np
from attrs import frozen
from scipy.optimize import linear_sum_assignment

import vedette
from vedette import Detections, Scan

RADAR = {
    "kind": "range_bearing", "sigma_range": 3.0, "sigma_bearing": "1.5 deg", "sigma_extent": 3.0,
    "detection_probability": 0.9, "min_range": 3, "max_range": 800, "clutter_per_scan": 3, "clutter_uniform_over": "range",
}  # fmt: skip
APART, CELLS = 12.0, {"range": 12.0, "bearing": float(np.radians(5.2))}
RADIUS, SETTLED = 20.0, 30.0


@frozen(eq=False)
class Kept:
    """One run: covered, mean estimated separation in scans in which both gave returns of their own, ids kept."""

    covered: float
    separation: float
    ids: bool


def tracker(associator, *, coarse):
    """The tracker of the boats, which keep their course; `coarse`: it knows the radar's cells."""
    sensor = {"kind": "coarse", "cells": CELLS, "of": RADAR} if coarse else RADAR
    return vedette.build(
        {
            "sensors": {"radar": sensor},
            "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.03}},
            "associator": associator if isinstance(associator, dict) else {"kind": associator},
            "birth": {"kind": "from_returns", "initial": 0.2, "spread": {"vx": 4.0, "vy": 4.0}},
            "lifecycle": {"kind": "existence", "lifetime": "5 min", "confirm": 0.999, "delete": 0.05},
        }
    )


def scene(seed):
    """Yield each scan, the boats' positions (2, 2), and whether each gave a return of its own."""
    sensor, rng = tracker("jpda", coarse=True).sensors["radar"], np.random.default_rng(seed)
    for time in np.arange(0.0, 90.0, 1.68).tolist():
        x = np.array([[-90 + 2 * time, 300 + APART / 2], [-90 + 2 * time, 300 - APART / 2]])
        h, found = sensor.measure(x), rng.random(2) < 0.9
        noise = np.sqrt(np.einsum("...ii->...i", sensor.noise(x))) * rng.standard_normal((2, 2))
        d = h[0] - h[1]
        merged = found.all() and rng.random() < np.exp(-0.5 * d @ np.linalg.solve(sensor.unresolved(x[0]), d))
        own = [h.mean(axis=0) + noise[0]] if merged else list((h + noise)[found])
        false = [rng.uniform([3.0, -np.pi], [800.0, np.pi]) for _ in range(rng.poisson(3))]
        z = rng.permutation(np.array([*own, *false]).reshape(-1, 2))
        yield Scan(time, "radar", Detections.of(z, 2)), x, bool(found.all()) and not merged


def run(associator, *, coarse, seed):
    """One run of a kind."""
    made = tracker(associator, coarse=coarse)
    state, covered, apart, ids = made.start(seed=seed), [], [], {False: [None, None], True: [None, None]}
    for scan, x, resolved in scene(seed):
        state = made.step(state, scan)
        at, numbers = made.estimate(state).mean[state.confirmed, :2], state.ids[state.confirmed]
        far = np.linalg.norm(x[:, None] - at[None], axis=-1)
        rows, columns = linear_sum_assignment(np.minimum(far, 1e4))
        pairs = {i: j for i, j in zip(rows.tolist(), columns.tolist(), strict=True) if far[i, j] < RADIUS}
        settled = scan.time >= SETTLED
        for i, j in pairs.items():
            if not settled or scan.time >= 80.0:
                ids[settled][i] = int(numbers[j])
        if settled:
            covered.append(len(pairs) / 2)
            apart += [float(np.linalg.norm(at[pairs[0]] - at[pairs[1]]))] if resolved and len(pairs) == 2 else []
    same = None not in ids[False] and ids[False] == ids[True]
    return Kept(float(np.mean(covered)), float(np.mean(apart)) if apart else np.nan, same)


def posterior(seed, *, hypotheses, least=1e-5):
    """Whether two boats were sure before 30 s by all hypotheses, and the probability that they kept their order."""
    made = tracker({"kind": "k_best", "hypotheses": hypotheses, "least": least}, coarse=True)
    state, sure, states = made.start(seed=seed), False, []
    for scan, x, _ in scene(seed):
        state = made.step(state, scan)
        at = made.estimator.moments(state.leaves.belief).mean[:, :2]
        near = np.min(np.linalg.norm(at[:, None] - x, axis=-1), axis=1) < RADIUS
        if scan.time < SETTLED:
            sure |= _at_least_two(state.leaves, near) >= 0.999
            states = []
        states.append((state.leaves, at))
    kept = all_of_it = 0.0
    for weight, rows in _hypotheses(state.leaves.hypotheses):
        two = rows[near[rows]]
        before = two
        for leaves, _ in states[:0:-1]:
            before = leaves.parent[before]
        if len(two) == 2 and np.all(before >= 0):
            all_of_it += weight
            kept += weight * (np.diff(at[two, 1]) * np.diff(states[0][1][before, 1]) > 0)[0]
    return bool(sure), kept / all_of_it if all_of_it else 0.0


def _hypotheses(of):
    for weight, begin, end in zip(of.weights.tolist(), of.starts[:-1], of.starts[1:], strict=True):
        yield weight, of.leaves[begin:end]


def _at_least_two(leaves, near):
    number = np.ones(1)
    for cluster in np.unique(leaves.hypotheses.cluster):
        own = np.zeros(len(near) + 1)
        for h, (weight, rows) in enumerate(_hypotheses(leaves.hypotheses)):
            if leaves.hypotheses.cluster[h] == cluster:
                count = np.ones(1)
                for exists in leaves.existence[rows[near[rows]]]:
                    count = np.convolve(count, [1 - exists, exists])
                own[: len(count)] += weight * count
        number = np.convolve(number, np.trim_zeros(own, "b"))
    return 1.0 - np.sum(number[:2])


def row(name, coarse):
    """One row of the table in docs/measured/association.md, of 40 runs."""
    runs = [run(name, coarse=coarse, seed=seed) for seed in range(40)]
    values = [np.array([getattr(each, field) for each in runs], float) for field in ("covered", "separation", "ids")]
    told = [f"{np.nanmean(v):.3f} +- {np.nanstd(v, ddof=1) / np.isfinite(v).sum() ** 0.5:.3f}" for v in values]
    return f"{name}{', told' * coarse}: " + ", ".join(told)


if __name__ == "__main__":
    for each in sys.argv[1:]:
        print(row(each.removesuffix(",told"), each.endswith(",told")), flush=True)
    if not sys.argv[1:]:
        told = [posterior(seed, hypotheses=500) for seed in range(40)]
        both = np.array([sure and order > 0.5 for sure, order in told])
        print(f"sure {np.mean([sure for sure, _ in told]):.3f}", end="")
        print(f", ids kept {both.mean():.3f} +- {both.std() / np.sqrt(39):.3f}")
