"""Which errors a report of consistency names, on drawn worlds, and how often it gives a false alarm.

    python benchmarks/errors.py KIND FIRST LAST

KIND is `correlated`, `wild` or `distance` (errors that are not white), `white` (Q or R wrong by a factor, errors white) or
`right` (nothing wrong; exact ones are judged at alpha .05 too). FIRST to LAST are the seeds of the worlds. A line a world.
"""

from __future__ import annotations

import sys

import numpy as np

import vedette
from vedette.testing import Errors, World, consistency
from vedette.tracking.tracker import Tracker

WORDS = {"correlated": "correlated in time", "wild": "heavy tails", "distance": "change with the distance"}


def drawn(rng: np.random.Generator, exact: bool, clutter: bool, q: float = 1.0, r: float = 1.0) -> Tracker:
    """Draw a tracker of one target and one radar, with Q and R scaled."""
    sigma, accel, seen = float(rng.uniform(3.0, 30.0)), float(10 ** rng.uniform(-1, 0.3)), float(rng.uniform(0.8, 1.0))
    away, turned = float(rng.uniform(300.0, 1500.0)), float(rng.uniform(-np.pi, np.pi))
    speed, heading = float(rng.uniform(5.0, 25.0)), float(rng.uniform(-np.pi, np.pi))
    low = float(10 ** rng.uniform(-6, -4.5)) if clutter else 0.0
    radar = {"detection_probability": seen, "clutter_density": low}
    if exact:
        radar |= {"kind": "cartesian_position", "sigma": sigma * r**0.5}
    else:
        bearing = float(10 ** rng.uniform(-3, -1.7))
        radar |= {"kind": "range_bearing", "sigma_range": sigma * r**0.5, "sigma_bearing": bearing * r**0.5}
        radar["clutter_density"] *= 1000.0  # per m and rad
    at, going = away * np.array([np.cos(turned), np.sin(turned)]), speed * np.array([np.cos(heading), np.sin(heading)])
    spread = sigma if exact else 20.0
    start = {"x": [at[0], spread], "y": [at[1], spread], "vx": [going[0], 2.0], "vy": [going[1], 2.0]}
    return vedette.build(
        {
            "estimator": {
                "kind": "kalman" if exact else "ekf",
                "motion": {"kind": "constant_velocity", "sigma_accel": accel * q**0.5},
            },
            "sensors": {"radar": radar},
            "associator": {"kind": "pda"},
            "birth": {"kind": "given", "start": {name: list(map(float, pair)) for name, pair in start.items()}},
            "lifecycle": {"kind": "single_target"},
        }
    )


def one(kind: str, seed: int) -> str:
    """Return what a report says of one drawn world."""
    rng = np.random.default_rng([seed, 36])
    exact, clutter = bool(rng.random() < 0.5), bool(rng.random() < 0.3)
    errors = {
        "correlated": Errors(correlation=float(rng.uniform(0.5, 0.9))),
        "wild": Errors(wild=float(rng.uniform(0.03, 0.15))),
        "distance": Errors(growth=float(rng.uniform(0.7, 2.0))),
    }.get(kind)
    q, r = 1.0, 1.0
    if kind == "white":
        factor = float(np.exp(rng.choice([-1, 1]) * rng.uniform(np.log(1.5), np.log(5.0))))
        q, r = (factor, 1.0) if rng.random() < 0.5 else (1.0, factor)
    scene = np.random.default_rng([seed, 37])
    right = drawn(scene, exact, clutter)
    tracker = drawn(np.random.default_rng([seed, 37]), exact, clutter, q, r)
    world = right if errors is None else World(right.estimator, right.sensors, None, {"radar": errors})
    report = consistency(tracker, world=world, seed=seed)
    about = f"{kind} {seed} {'exact' if exact else 'ekf'}{' clutter' if clutter else ''} q {q:.2g} r {r:.2g}"
    if kind == "right":
        strict = consistency(tracker, seed=seed, alpha=0.05) if report.exact else report
        wrong = [verdict.name for verdict in (*report.verdicts, *strict.verdicts) if not verdict.inside]
        return f"{about}: {report.consistent} {strict.consistent} exact {report.exact} {', '.join(wrong)}"
    if kind == "white":
        named = any(words in report.cause for words in WORDS.values())
    else:
        named = WORDS[kind] in report.cause
    return f"{about}: named {named} consistent {report.consistent}: {report.cause}"


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    for number in range(int(sys.argv[2]), int(sys.argv[3])):
        print(one(sys.argv[1], number), flush=True)
