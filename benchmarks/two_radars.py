"""CPU time of a scan of 200 returns where tracks share a radar's offset and returns may be merged, on one core.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python -m benchmarks.two_radars [associator]

Two radars in turn, one turned by 1.5 degrees, look at 166 boats, a tenth of them in pairs some 20 m apart, and see 50 false
returns each.
"""

from __future__ import annotations

import sys
import time

import numpy as np

import vedette
from vedette import Array, Detections, Scan

BOATS, PAIRED, FALSE, SCANS, EVERY, OFF = 166, 16, 50, 80, 1.25, np.radians(1.5)
RADAR = {
    "kind": "range_bearing", "sigma_range": 5.0, "sigma_bearing": "0.2 deg", "detection_probability": 0.9,
    "max_range": 20_000, "clutter_per_scan": FALSE, "clutter_uniform_over": "range",
}  # fmt: skip


def tracker(associator: str) -> vedette.Tracker:
    """Return the tracker: cells of both radars, the offset of the second shared by all tracks."""
    cells = {"range": 15.0, "bearing": 0.01}
    turned = {"kind": "biased", "of": RADAR, "add": {"bearing": "off"}, "spread": {"off": 0.03}}
    steady = {"kind": "random_walk", "axes": ["off"], "unit": "rad", "sigma": 1e-12}
    models = [{"kind": "constant_velocity", "sigma_accel": 0.1}, steady]
    return vedette.build(
        {
            "sensors": {name: {"kind": "coarse", "cells": cells, "of": of} for name, of in (("a", RADAR), ("b", turned))},
            "estimator": {"kind": "ekf", "motion": {"kind": "product", "models": models}},
            "associator": {"kind": associator},
            "birth": {"kind": "from_returns", "initial": 0.2, "sensors": ["a"], "spread": {"vx": 8, "vy": 8, "off": 0.03}},
            "lifecycle": {"kind": "existence", "lifetime": "10 min", "confirm": 0.999, "delete": 0.05},
            "registration": {"offsets": {"off": 0.03}},
        }
    )


def returns(places: Array, turned: bool, rng: np.random.Generator) -> Array:
    """Draw the returns of a scan."""
    x, y = places.T
    z = np.stack([np.hypot(x, y), np.arctan2(y, x) + OFF * turned], axis=1)
    z = (z + rng.normal(0, 1, z.shape) * [5.0, np.radians(0.2)])[rng.random(len(z)) < 0.9]
    false = np.stack([rng.uniform(0, 20_000, FALSE), rng.uniform(-np.pi, np.pi, FALSE)], axis=1)
    return np.concatenate([z, false])


def main(associator: str = "jpda") -> None:
    """Print the CPU time of scans after the first half."""
    made, rng, spent, counts = tracker(associator), np.random.default_rng(1), [], []
    x, v = rng.uniform(-12_000, 12_000, (BOATS, 2)), rng.uniform(-8, 8, (BOATS, 2))
    x[1:PAIRED:2], v[1:PAIRED:2] = x[0:PAIRED:2] + rng.normal(0, 15, (PAIRED // 2, 2)), v[0:PAIRED:2]
    state = made.start(seed=1)
    for k in range(SCANS):
        z = returns(x + v * EVERY * k, k % 2 == 1, rng)
        scan = Scan(EVERY * k, "ab"[k % 2], Detections.of(z, 2))
        began = time.process_time()
        state = made.step(state, scan)
        spent.append(1e3 * (time.process_time() - began))
        counts.append(len(z))
    late, found = np.array(spent[SCANS // 2 :]), np.degrees(float(state.offsets.mean[0]))
    print(f"{associator}: {np.mean(counts):.0f} returns a scan, {np.count_nonzero(state.confirmed)} confirmed tracks")
    print(f"mean {late.mean():.1f} ms a scan, .95 within {np.quantile(late, 0.95):.1f} ms; offset {found:.2f} deg")


if __name__ == "__main__":
    main(*sys.argv[1:])
