"""Two boats 12 m apart for a minute and a half, 300 m from a radar whose cells merge them half of the time."""

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
            "associator": {"kind": associator},
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
