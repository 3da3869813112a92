"""Drafts of drawn scenes against configs by hand: `python -m benchmarks.drafts --scenes 200`, or a part with `--first`.

A scene has 1 to 50 objects at 1 to 1,000 m/s that go straight, hover, circle or stop, in scans (with clutter) or as single
reports, with errors of 1 cm to 1 km and digits cut. The config by hand knows errors, rates and speeds, and has the best of
three acceleration noises by the truth. Both are judged by GOSPA (p = 1, alpha = 2) with a cut-off of ten errors; scenes that
the hand covers to .8 are kept. A draft that refuses (exit code 3) is counted apart.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from attrs import frozen
from scipy.optimize import linear_sum_assignment

import vedette
from vedette.space import Array
from vedette_tools.drafting.config import drafted

MOTIONS = ("straight", "hovering", "circling", "stopping")
ROWS = 2500
"""A scene has about so many returns at most, so that a draft takes seconds."""


@frozen(eq=False)
class Scene:
    """What was drawn: `paths` (o, s, 2) at `times` (s,), and the returns as rows of time, x and y."""

    about: Mapping[str, Any]
    times: Array
    paths: Array
    rows: Array


def drawn(number: int, seed: int) -> Scene:
    """Return a scene; the same for the same numbers."""
    rng = np.random.default_rng([seed, number])
    count, speed = int(np.exp(rng.uniform(0, np.log(50)))), float(10 ** rng.uniform(0, 3))
    motion, single = str(rng.choice(MOTIONS)), bool(rng.random() < 0.3)
    dt = float(10 ** rng.uniform(-0.5, 1.0))
    step = speed * dt
    error = float(np.clip(step * 10 ** rng.uniform(-1.5, 0.5), 0.01, 1000.0))
    detected = float(rng.uniform(0.8, 1.0))
    clutter = 0.0 if single or rng.random() < 0.4 else float(10 ** rng.uniform(-1, 2))
    scans = int(np.clip(ROWS / (count + clutter), 40, 200))
    side = step * scans * 0.5 + 40 * error * np.sqrt(count + clutter)
    times = dt * np.arange(scans)
    paths = np.array([_path(rng, motion, times, speed, side) for _ in range(count)])
    seen = [(s, o) for s in range(scans) for o in range(count) if rng.random() < detected]
    rows = [(times[s] + (rng.uniform(0, dt) if single else 0.0), o, s) for s, o in seen]
    table = []
    for at, o, s in rows:
        place = paths[o, s] if not single else np.array([np.interp(at, times, paths[o, :, i]) for i in (0, 1)])
        table.append((at, *(place + error * rng.normal(size=2))))
    table += [(t, *rng.uniform(-side, side, 2)) for t in times for _ in range(rng.poisson(clutter))]
    found = np.array(sorted(table))
    digits = max(0, int(np.ceil(-np.log10(error))) + int(rng.integers(0, 3)))
    found[:, 1:] = np.round(found[:, 1:], digits)
    about = {
        "number": number, "objects": count, "speed": round(speed, 1), "motion": motion, "single": single, "dt": round(dt, 3),
        "error": round(error, 3), "detected": round(detected, 2), "clutter": round(clutter, 1), "side": round(side),
    }  # fmt: skip
    return Scene(about, times, paths, found)


def _path(rng: np.random.Generator, motion: str, times: Array, speed: float, side: float) -> Array:
    """Return the places (s, 2) of one object."""
    start, heading = rng.uniform(-0.7 * side, 0.7 * side, 2), rng.uniform(0, 2 * np.pi)
    ahead = speed * rng.uniform(0.7, 1.3) * np.array([np.cos(heading), np.sin(heading)])
    if motion == "circling":
        turn = 2 * np.pi / (times[-1] * rng.uniform(0.2, 1.0))
        angle = heading + turn * times
        return start + float(np.hypot(*ahead)) / turn * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    moving = np.ones(len(times))
    if motion in ("hovering", "stopping"):
        parts = np.sort(rng.uniform(0, times[-1], 2 if motion == "hovering" else 1))
        moving = np.zeros(len(times)) + (np.searchsorted(parts, times) % 2 == (1 if motion == "hovering" else 0))
    gone = np.concatenate([[0.0], np.cumsum(np.diff(times) * moving[1:])])
    return np.asarray(start + gone[:, None] * ahead)


def by_hand(scene: Scene, folder: Path, accel: float) -> dict[str, Any]:
    """Return a config that knows the scene."""
    about, single = scene.about, scene.about["single"]
    scans = len(np.unique(scene.rows[:, 0]))
    detected = min(about["detected"] if not single else about["objects"] * len(scene.times) / scans / about["objects"], 0.99)
    lifecycle = {"kind": "existence", "confirm": 0.99}
    if single:
        lifecycle |= {"delete": 0.001, "lifetime": 3600.0, "max_out_of_coverage": 3600.0}
    return {
        "source": {
            "kind": "csv", "path": str(folder / "scene.csv"),
            "detections": {"time": "time", "columns": {"x": "x", "y": "y"}},
        },
        "sensors": {
            "sensor": {
                "kind": "cartesian_position", "sigma": about["error"], "detection_probability": detected,
                "clutter_density": max(about["clutter"], 0.001) / (2.0 * about["side"]) ** 2,
            }
        },
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": accel}},
        "associator": {"kind": "jpda"},
        "birth": {"kind": "from_returns", "spread": {"vx": about["speed"], "vy": about["speed"]}},
        "lifecycle": lifecycle,
    }  # fmt: skip


def gospa(scene: Scene, tracks: Sequence[vedette.Track]) -> tuple[float, float]:
    """Return the mean error a scan and object over a cut-off of ten errors, and which part of the objects is covered."""
    cut = 10.0 * scene.about["error"]
    total, covered = 0.0, 0
    placed = [_placed(track, scene.times) for track in tracks]
    for s in range(len(scene.times)):
        own = np.array([places[s] for places in placed if np.isfinite(places[s, 0])]).reshape(-1, 2)
        apart = np.linalg.norm(scene.paths[:, None, s] - own[None], axis=-1)
        rows, columns = linear_sum_assignment(np.minimum(apart, cut))
        near = apart[rows, columns] < cut
        total += float(np.sum(apart[rows, columns][near])) + 0.5 * cut * (len(scene.paths) + len(own) - 2 * np.sum(near))
        covered += int(np.sum(near))
    looks = len(scene.paths) * len(scene.times)
    return total / looks / cut, covered / looks


def _placed(track: vedette.Track, times: Array) -> Array:
    """Return a track's places (s, 2) at the times, NaN where it is not."""
    own = [track.space.names.index(name) for name in ("x", "y")]
    found = np.array([np.interp(times, track.times, track.mean[:, i], left=np.nan, right=np.nan) for i in own])
    return found.T


def one(scene: Scene, folder: Path) -> dict[str, Any]:
    """Return what the draft and the hand come to."""
    lines = "".join(f"{t:.3f},{x:.12g},{y:.12g}\n" for t, x, y in scene.rows)
    (folder / "scene.csv").write_text("time,x,y\n" + lines)
    about = dict(scene.about)
    usual = about["speed"] / (about["dt"] * len(scene.times)) ** 0.5
    hands = [gospa(scene, vedette.load(by_hand(scene, folder, factor * usual)).run().tracks) for factor in (0.03, 0.3, 3.0)]
    about["hand"], about["covered"] = min(hands)
    if about["covered"] < 0.8:
        return about
    begun = time.process_time()
    draft = drafted(folder / "scene.csv")
    about |= {"cpu": round(time.process_time() - begun, 1), "refused": draft.failure}
    (folder / "scene.toml").write_text(draft.text)
    tracks = vedette.load(folder / "scene.toml").run().tracks
    about["draft"], about["draft_covered"] = gospa(scene, tracks)
    return about | {"tracks": len(tracks), "ratio": about["draft"] / about["hand"]}


def main() -> None:
    """Draw, draft and judge; a line of JSON a scene, then what they come to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=200)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    told = []
    with tempfile.TemporaryDirectory() as folder:
        for number in range(given.first, given.first + given.scenes):
            told.append(one(drawn(number, given.seed), Path(folder)))
            print(json.dumps(told[-1]), flush=True)
    kept = [each for each in told if "ratio" in each]
    ratios = [each["ratio"] for each in kept if not each["refused"]]
    refused = sum(bool(each["refused"]) for each in kept)
    if ratios:
        print(f"{len(kept)} of {len(told)} scenes kept, {refused} refused; the others: mean {np.mean(ratios):.2f}, ", end="")
        print(f"median {np.median(ratios):.2f}, worst {max(ratios):.2f}, {sum(ratio > 2 for ratio in ratios)} above 2")


if __name__ == "__main__":
    main()
