"""How often equal spots that cross keep their ids, and how often it is told where they may have been exchanged.

    python -m benchmarks.flir_crossing [--runs 100] [--seed 37] [--case NAME]     six minutes

Spots of 60 counts over noise of 1.5, spread 2 px, meet within 2 px after 25 frames, followed by examples/flir_clip.toml
from boxes of 10 px. "Exchanged": each ends within 4 px of the place of one of them. "Told": a link below .95 in tracks.csv.
The mean risk, 1 less the least link, would equal the part exchanged if links were calibrated.
"""

from __future__ import annotations

import argparse
from itertools import permutations
from pathlib import Path

import numpy as np

import vedette
from vedette import Array, Frame, Gaussian, Scan

EXAMPLE = Path(__file__).parents[1] / "examples" / "flir_clip.toml"
SHAPE, MEETING, FRAMES, SURE = (120, 160), 25.0, 60, 0.95

APART = {2: ((1.0, 0.0), (-1.0, 0.0)), 3: ((1.155, 0.0), (-0.577, 1.0), (-0.577, -1.0))}
APART[4] = ((1.414, 0.0), (-1.414, 0.0), (0.0, 1.414), (0.0, -1.414))
"""Velocities in px a frame of so many targets, each 2 px a frame or more from all others."""

CASES = {
    "head-on, 2 px a frame apart": (APART[2], (60.0, 60.0), 0.0),
    "one stands, 2 px a frame apart": (((2.0, 0.0), (0.0, 0.0)), (60.0, 60.0), 0.0),
    "at 60 degrees, 2 px a frame apart": (((1.0, 0.0), (0.0, 1.732)), (60.0, 60.0), 0.0),
    "head-on, 4 px a frame apart": (((2.0, 0.0), (-2.0, 0.0)), (60.0, 60.0), 0.0),
    "head-on, 1 px a frame apart": (((0.5, 0.0), (-0.5, 0.0)), (60.0, 60.0), 0.0),
    "2 px apart, velocities wander by .06 px a frame": (APART[2], (60.0, 60.0), 0.06),
    "2 px apart, one of .6 of the brightness": (APART[2], (60.0, 36.0), 0.0),
    "three, 2 px a frame apart": (APART[3], (60.0,) * 3, 0.0),
    "three in a row, speeds 2, 0 and -2": (((2.0, 0.0), (0.0, 0.0), (-2.0, 0.0)), (60.0,) * 3, 0.0),
    "four, 2 px a frame apart": (APART[4], (60.0,) * 4, 0.0),
}
"""Velocities in px a frame, peaks in count, and what each axis of a velocity gains a frame, in px a frame."""


def flown(velocities: Array, turn: float, rng: np.random.Generator) -> Array:
    """Return the places (frames, t, 2) of targets that meet halfway."""
    where = np.array([[80.0, 50.0], *([80.0, 50.0 + rng.uniform(-2.0, 2.0)] for _ in velocities[1:])])
    at, velocity, places = where - (MEETING + rng.uniform(-0.5, 0.5)) * velocities, velocities.copy(), []
    for _ in range(FRAMES):
        places.append(at.copy())
        velocity += turn * rng.normal(size=velocity.shape)
        at += velocity
    return np.array(places)


def followed(places: Array, peaks: tuple[float, ...], rng: np.random.Generator) -> tuple[str, float]:
    """Return whether the ids were kept, exchanged or lost, and the largest risk that was told."""
    tracker = vedette.load(EXAMPLE).tracker
    start = np.array([[*at, 0.0, 0.0, 10.0, 10.0] for at in places[0]])
    state = tracker.start(Gaussian(start, np.repeat(np.diag([1.0, 1.0, 1e4, 1e4, 0.0, 0.0])[None], len(start), 0)), 0.0)
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    risk = 0.0
    for k, both in enumerate(places):
        pixels = 60.0 + rng.normal(0.0, 1.5, SHAPE)
        for at, peak in zip(both, peaks, strict=True):
            pixels += peak * np.exp(-((x - at[0]) ** 2 + (y - at[1]) ** 2) / 8.0)
        state = tracker.step(state, Scan.image(k / 30, "camera", Frame(pixels)))
        assert state.links is not None
        risk = max(risk, float(np.nanmax(1.0 - state.links, initial=0.0)))
    found = tracker.estimate(state).mean[:, :2]
    for order in permutations(range(len(found))):
        if np.linalg.norm(found[list(order)] - places[-1], axis=1).max() < 4.0:
            return "exchanged" if any(np.diff(order) < 0) else "kept", risk
    return "lost", risk


def main() -> None:
    """Run all cases."""
    parser = argparse.ArgumentParser("python -m benchmarks.flir_crossing", description=__doc__)
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--seed", type=int, default=37)
    parser.add_argument("--case", default="", help="a part of the names of the cases to run")
    runs, seed = (given := parser.parse_args()).runs, given.seed
    for name, (velocities, peaks, turn) in ((name, case) for name, case in CASES.items() if given.case in name):
        ends = []
        for run in range(runs):
            rng = np.random.default_rng([seed, run])
            ends.append(followed(flown(np.array(velocities), turn, rng), peaks, rng))
        count = {ending: sum(end == ending for end, _ in ends) for ending in ("kept", "exchanged", "lost")}
        changed = [risk > 1.0 - SURE for end, risk in ends if end != "kept"]
        others = [risk > 1.0 - SURE for end, risk in ends if end == "kept"]
        print(
            f"{name}: kept {count['kept']}, exchanged {count['exchanged']}, lost {count['lost']} of {runs}; told in "
            f"{sum(changed)} of {len(changed)} that were not kept, and in {sum(others)} of {len(others)} that were; "
            f"mean risk {np.mean([risk for _, risk in ends]):.2f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
