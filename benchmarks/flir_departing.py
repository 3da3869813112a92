"""Targets of recorded infrared clips that stand before the roughest part of another scene, and then leave it.

    VEDETTE_DATA=FOLDER python -m benchmarks.flir_departing [BY ...] [--set NAME=VALUE]

The own light of each segment's target is drawn into the segment `BY` further on: it stands there for 8 to 50 frames, as the
camera turns, and then leaves by .4 to 3 px a frame. It hides what is behind it. Place and way keep off that scene's own
target, which stays. Not counted: where one of the first five frames, or a tenth of all, does not show it.
"""

from __future__ import annotations

import argparse
from itertools import product
from typing import Any

import cv2
import numpy as np
from attrs import evolve

from benchmarks.flir_cameras import eight
from benchmarks.flir_changed import told
from benchmarks.flir_clips import NEAR, Clip, Followed, clips, cut, follow, held, tracker
from benchmarks.flir_looks import own
from vedette import Array
from vedette_flir.registration import Registration

FRAMES, ROOM, APART, GRID = 150, 30.0, 40.0, 8
"""Frames of a clip; px that it keeps from the edge, and from the scene's own target; px between places that are compared."""

STANDS, SPEEDS, WAYS = (8, 16, 30, 50), (0.4, 0.8, 1.5, 3.0), 8
OVER, LARGEST, WHITE = 0.5, 40.0, 250.0
"""How far it is brighter than what is at its first place, over its own light; the longest side of its box in px; the
brightest that it is drawn.
"""

Part = tuple[Clip, int, int]


def turns(frames: Array) -> list[Array]:
    """Return where the first pixel (2,) of each frame lies, in px of the first frame."""
    seen = Registration()
    return [seen.take(frame) for frame in frames]


def roughness(frame: Array, size: Array) -> Array:
    """Return how rough a frame is around each place, within a target's size."""
    window = tuple(int(side) // 2 * 2 + 1 for side in 1.3 * size)
    rough = frame - cv2.GaussianBlur(frame, (0, 0), 1.0 * float(size.max()))
    return np.asarray(np.sqrt(cv2.boxFilter(rough * rough, -1, window)))


def departing(one: Part, other: Part, stands: int, speed: float) -> Clip | None:
    """Return the first segment's target before the scene of the second; None if it finds no place or no way there."""
    (frames, boxes), (scenes, others) = cut(*one), cut(*other)
    if one[0].name == other[0].name or frames.shape[1:] != scenes.shape[1:]:
        return None
    count = next((k for k in range(FRAMES) if k not in boxes), FRAMES)
    count = min(count, len(frames), len(scenes))
    if count < stands + 30:
        return None
    where, size = turns(scenes[:count]), boxes[0][2:]
    if size.max() > LARGEST:
        return None
    shape = np.array(scenes.shape[:0:-1])
    rough = roughness(scenes[0].astype(float), size)
    steps = [np.arange(ROOM, side - ROOM, GRID) for side in shape]
    places = sorted(product(*steps), key=lambda at: -rough[int(at[1]), int(at[0])])
    seen = {k: box for k, box in others.items() if k < count}
    for at, n in product(places[:40], range(WAYS)):
        way = np.array([np.cos(2 * np.pi * n / WAYS), np.sin(2 * np.pi * n / WAYS)])
        path = np.array([np.array(at) + max(k - stands, 0) * speed * way - where[k] for k in range(count)])
        inside = np.all((path > ROOM) & (path < shape - ROOM))
        clear = all(np.max(np.abs(path[k] - box[:2])) > APART + 0.5 * box[2:].max() for k, box in seen.items())
        if inside and clear:
            return drawn(one[0], frames, boxes, scenes[:count], path, f"{one[1]} in {other[0].name} {other[1]}")
    return None


def drawn(clip: Clip, frames: Array, boxes: dict[int, Array], scenes: Array, path: Array, name: str) -> Clip | None:
    """Return a clip with a target's light along a path (k, 2), that hides what is behind it."""
    out, placed, level = scenes.astype(float), {}, None
    for k, at in enumerate(path):
        light = own(frames[k].astype(float), boxes[k])
        peak = float(light.max())
        if peak <= 0.0:
            continue
        if level is None:
            half = np.ceil(0.75 * boxes[k][2:]).astype(int)
            low = np.rint(at).astype(int) - half
            beside = out[k][low[1] : low[1] + 2 * half[1], low[0] : low[0] + 2 * half[0]]
            level = min(float(np.quantile(beside, 0.95)), WHITE - OVER * peak)
        M = np.column_stack([np.eye(2), at - boxes[k][:2]])
        part = cv2.warpAffine(light / peak, M, tuple(out[k].shape[::-1]), flags=cv2.INTER_LINEAR)
        out[k] += part * (level + OVER * peak - out[k])
        placed[k] = np.array([*at, *boxes[k][2:]])
    return evolve(clip, name=f"{clip.name} {name}", frames=eight(out), boxes=placed, segments=()) if 0 in placed else None


def every(by: list[int]) -> list[tuple[Clip, int]]:
    """Return the clips that go together, and in which frame each target leaves."""
    parts = [(clip, *part) for which in ("all", "odd") for clip in clips(which) for part in clip.segments]
    made = []
    for b, (i, part) in product(by, enumerate(parts)):
        stands, speed = STANDS[(i + b) % len(STANDS)], SPEEDS[(i // len(STANDS) + b) % len(SPEEDS)]
        clip = departing(part, parts[(i + b) % len(parts)], stands, speed)
        if clip is not None:
            made.append((evolve(clip, name=f"{clip.name}, {stands} frames, {speed} px"), stands))
    return made


def fair(one: Followed) -> bool:
    """Return whether the frames show the target."""
    known = np.isfinite(one.error)
    return bool(one.seen[:5].all() and one.seen[known].mean() >= 0.9)


def main() -> None:
    """Run what is asked for."""
    parser = argparse.ArgumentParser(
        "python -m benchmarks.flir_departing", description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("by", nargs="*", type=int, default=[5, 12], metavar="BY")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="a parameter of the estimator")
    given = parser.parse_args()
    made: Any = tracker(**dict(assigned.split("=", 1) for assigned in given.set))
    runs = []
    for clip, _ in every(given.by):
        one = follow(made, clip, 0, len(clip.frames))
        if fair(one):
            runs.append((one, 0))
            if one.lost or held(one).any() or np.mean(one.error <= NEAR) < 0.98:
                print(f"    {clip.name}: {told([(one, 0)])}", flush=True)
    print(told(runs))


if __name__ == "__main__":
    main()
