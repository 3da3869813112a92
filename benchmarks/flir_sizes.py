"""Drawn targets whose boxes change: that near or leave by 1 to 3 % a frame, or come in from the edge of the frame.

    python -m benchmarks.flir_sizes [--seed 1] [--draws 1] [--every 1] [--each] [--set NAME=VALUE]

An animal on four legs, a boat with a cabin and a drone with four arms, before rough land, in noise of 1.5 counts; in every
second run the camera turns by .3 px a frame:

leaves    from 20 to 60 px long, smaller by 1, 2 or 3 % a frame, until 9 px
nears     from 10 to 24 px, larger by 1, 2 or 3 % a frame, until 80 px
enters    20 to 60 px, by .02 to .08 of its length a frame; the first box is what the first frame shows of it, a fifth or two
stays     as large as it was

True boxes hold what the frame shows of it. Places are judged by half the box's longer side, but 5 px at least.
"""

from __future__ import annotations

import argparse
from itertools import product
from typing import Any

import cv2
import numpy as np

from benchmarks.flir_cameras import eight
from benchmarks.flir_clips import Clip, Followed, follow, held, losses, overlap, tracker
from vedette import Array

SIZE, FRAMES, FINE = (192, 256), 90, 96
SHAPES = ("animal", "boat", "drone")


def shape(kind: str, phase: float) -> Array:
    """Return the light (FINE, FINE) of a target whose length is half of that, at a phase of its step."""
    y, x = (axis / (0.5 * FINE) for axis in np.mgrid[:FINE, :FINE] - 0.5 * (FINE - 1))

    def blob(cx: float, cy: float, sx: float, sy: float) -> Array:
        return np.asarray(np.exp(-((((x - cx) / sx) ** 2 + ((y - cy) / sy) ** 2) ** 2)))

    if kind == "animal":
        swing = 0.08 * np.sin(phase)
        stands = ((-0.3, 1), (-0.22, -1), (0.18, -1), (0.26, 1))
        legs = [0.7 * blob(cx + sign * swing, 0.22, 0.05, 0.16) for cx, sign in stands]
        parts = [0.8 * blob(-0.03, -0.02, 0.36, 0.17), blob(0.4, -0.16, 0.12, 0.1), *legs]
    elif kind == "boat":
        parts = [0.6 * blob(0.0, 0.1, 0.5, 0.1), blob(-0.15, -0.08, 0.13, 0.14), 0.8 * blob(0.2, -0.05, 0.02, 0.2)]
    else:
        arms = [0.7 * blob(sx * 0.36, sy * 0.12, 0.14, 0.07) for sx, sy in product((-1, 1), (-1, 1))]
        parts = [blob(0.0, 0.0, 0.16, 0.13), 0.6 * blob(0.0, 0.0, 0.4, 0.05), *arms]
    return np.max(parts, axis=0)


def rough(rng: np.random.Generator) -> Array:
    """Return land, larger than a frame by 40 px on each side: slopes, clumps and grass."""
    size = tuple(side + 80 for side in SIZE)
    return 70.0 + sum(
        weight * cv2.GaussianBlur(rng.normal(size=size), (0, 0), wide) * wide
        for weight, wide in ((30.0, 25.0), (20.0, 6.0), (6.0, 1.5))
    )


def drawn(name: str, kind: str, lengths: Array, path: Array, rng: np.random.Generator, turns: float) -> Clip:
    """Return a clip of a target of so many px (k,) along a path (k, 2), and boxes of what the frames show of it."""
    land, bright, frames, boxes = rough(rng), rng.uniform(40.0, 90.0), [], {}
    last = np.array(SIZE[::-1]) - 0.5
    for k, (length, at) in enumerate(zip(lengths, path, strict=True)):
        light, scale = shape(kind, 0.7 * k), length / (0.5 * FINE)
        if scale < 1.0:
            light = cv2.GaussianBlur(light, (0, 0), 0.4 / scale)
        M = np.column_stack([scale * np.eye(2), at - scale * 0.5 * (FINE - 1)])
        seen = np.clip(cv2.warpAffine(light, M, SIZE[::-1], flags=cv2.INTER_LINEAR), 0.0, 1.0)
        shift = np.array([[1.0, 0.0, -40.0 - turns * k], [0.0, 1.0, -40.0]])
        behind = cv2.warpAffine(land, shift, SIZE[::-1])
        frame = behind + seen * (np.median(land) + bright - 0.5 * behind - 0.5 * np.median(land))
        frames.append(cv2.GaussianBlur(frame, (0, 0), 0.6) + rng.normal(0.0, 1.5, SIZE))
        rows, columns = np.nonzero(light > 0.3 * light.max())
        low, high = (scale * (np.array([f(columns), f(rows)]) - 0.5 * (FINE - 1)) + at for f in (np.min, np.max))
        low, high = np.maximum(low - 0.5 * scale, -0.5), np.minimum(high + 0.5 * scale, last)
        if np.all(high - low >= 3.0):
            boxes[k] = np.concatenate([0.5 * (low + high), high - low])
    start = min(boxes)
    return Clip(name, eight(frames[start:]), {k - start: box for k, box in boxes.items()}, ())


def scenes(seed: int) -> list[tuple[str, Clip]]:
    """Return clips of every kind, drawn by a seed."""
    made, middle, number = [], 0.5 * np.array(SIZE[::-1]), 0

    def add(what: str, kind: str, lengths: Array, path: Array | None, text: str) -> None:
        nonlocal number
        rng = np.random.default_rng([seed, number])
        if path is None:
            way = rng.uniform(0.0, 2.0 * np.pi)
            gone = 0.8 * (np.arange(len(lengths)) - 0.5 * len(lengths))
            path = middle + gone[:, None] * np.array([np.cos(way), np.sin(way)])
        made.append((what, drawn(f"{what} {kind} {text}", kind, lengths, path, rng, 0.3 * (number % 2))))
        number += 1

    steps = np.arange(FRAMES)
    for kind, first, rate in product(SHAPES, (20.0, 32.0, 45.0, 60.0), (0.01, 0.02, 0.03)):
        count = min(FRAMES, int(np.log(first / 9.0) / rate))
        add("leaves", kind, first * np.exp(-rate * steps[:count]), None, f"{first:.0f} px, {rate}")
    for kind, first, rate in product(SHAPES, (10.0, 16.0, 24.0), (0.01, 0.02, 0.03)):
        count = min(FRAMES, int(np.log(80.0 / first) / rate))
        add("nears", kind, first * np.exp(rate * steps[:count]), None, f"{first:.0f} px, {rate}")
    for kind, length, speed, shown in product(SHAPES, (20.0, 35.0, 60.0), (0.02, 0.04, 0.08), (0.2, 0.4)):
        right = number % 4 < 2
        x = -0.5 * length + shown * length + speed * length * steps
        x = np.minimum(x, 0.5 * SIZE[1] + 0.3 * (x - 0.5 * SIZE[1]))
        y = np.full(FRAMES, 0.5 * SIZE[0]) + 0.2 * steps
        add(
            "enters",
            kind,
            np.full(FRAMES, length),
            np.column_stack([SIZE[1] - 1 - x if right else x, y]),
            f"{length:.0f} px, {speed}, {shown}",
        )
    for kind, length in product(SHAPES, (16.0, 24.0, 36.0, 60.0)):
        add("stays", kind, np.full(FRAMES, length), None, f"{length:.0f} px")
    return made


def well(one: Followed) -> Array:
    """Return in which frames with a target the track is near it (k,)."""
    known = np.isfinite(one.error)
    return np.asarray(one.error[known] <= np.maximum(5.0, 0.5 * one.true[known, 2:].max(axis=1)))


def larger(one: Followed) -> Array:
    """Return the logarithm of how much larger the box is than the true one (k,), by the root of their areas."""
    known = np.isfinite(one.error)
    return np.asarray(0.5 * np.log(np.prod(one.found[known, 2:], axis=1) / np.prod(one.true[known, 2:], axis=1)))


def told(runs: list[Followed]) -> str:
    """Return the figures of runs in a line."""
    near, off = np.concatenate([well(one) for one in runs]), np.concatenate([larger(one) for one in runs])
    gone, good = [each for one in runs for each in losses(one)], np.concatenate([held(one) for one in runs])
    lost = np.concatenate(gone) if gone else np.zeros(0)
    over = [overlap(one) for one in runs]
    return (
        f"{len(runs):3} runs: near {near.mean():.3f}, lost at the end {sum(not well(one)[-10:].any() for one in runs)}, "
        f"overlap {np.mean(np.concatenate(over)):.3f}, at the end {np.mean([each[-1] for each in over]):.3f}, size off by "
        f"{np.sqrt(np.mean(off**2)):.3f}; good frames doubted {good.sum()} of {len(good)}, lost ones told "
        f"{lost.sum():.0f} of {len(lost)}"
    )


def main() -> None:
    """Print how well boxes of each kind are followed."""
    parser = argparse.ArgumentParser(
        "python -m benchmarks.flir_sizes", description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--draws", type=int, default=1)
    parser.add_argument("--every", type=int, default=1, help="one in so many")
    parser.add_argument("--each", action="store_true", help="print each run that fails, too")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="a parameter of the estimator")
    given = parser.parse_args()
    made: Any = tracker(**dict(assigned.split("=", 1) for assigned in given.set))
    runs: dict[str, list[Followed]] = {}
    for seed in range(given.seed, given.seed + given.draws):
        for what, clip in scenes(seed)[:: given.every]:
            one = follow(made, clip, 0, len(clip.frames))
            runs.setdefault(what, []).append(one)
            if given.each and (well(one).mean() < 0.9 or held(one).mean() > 0.05 or overlap(one)[-1] < 0.4):
                sides = f"{one.found[-1, 2:].round(1)} for {one.true[-1, 2:].round(1)}"
                print(f"    {clip.name}: {told([one])}, sides at the end {sides}", flush=True)
    for what, own in runs.items():
        print(f"{what:7}{told(own)}", flush=True)


if __name__ == "__main__":
    main()
