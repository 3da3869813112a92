"""Losses of every kind, planted into the segments of recorded infrared clips: are they told, and is the target found again?

    VEDETTE_DATA=FOLDER python -m benchmarks.flir_losses [--clips odd] [--every 3] [--set NAME=VALUE]

Each kind is planted into one in `--every` of the segments of at least 150 frames, each time into others. From frame 50 on:

another    100 frames of another clip, then back
moved      a cut: the picture is shifted by 100 px, at random up or down and left or right, and mirrored beyond its edge
fades      the target fades within 30 frames, and is gone for 60
gone       it is gone at once, for 60 frames
pole       a pole stands before where it flies, for 40 frames
exit       the picture is shifted by 4 px a frame until the target is out of it, for 60 frames more
tip        it fades within 10 frames, and a tip as bright as .8 of it stands where it was, for 60 frames
trees      a wood below it, 1.1 sizes away: no loss

What is taken away is replaced by what is around it. Told: existence below one half, from the eleventh frame of a loss on.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
from attrs import evolve

from benchmarks.flir_clips import Clip, Followed, clips, follow, held, losses, tracker
from vedette import Array

BEGIN = 50
Frames = list[Array]
Boxes = dict[int, Array]
Plant = Callable[[Frames, Boxes, np.random.Generator, Array], int]
"""Changes frames and boxes of a segment, from its own frame 0 on; returns in which frame the target is back, 0 for none."""


def cleaned(pixels: Array, box: Array, rng: np.random.Generator) -> Array:
    """Return the frame with what is around a target in its place, and the noise of its surroundings."""
    mask = np.zeros(pixels.shape, np.uint8)
    half = 0.5 * (1.3 * box[2:] + 4.0)
    low, high = (np.rint(box[:2] + sign * half).astype(int) for sign in (-1, 1))
    low, high = np.maximum(low, 0), np.maximum(high, 0)
    mask[low[1] : high[1] + 1, low[0] : high[0] + 1] = 255
    grey = np.clip(pixels, 0, 255).astype(np.uint8)
    filled = cv2.inpaint(grey, mask, 3.0, cv2.INPAINT_TELEA).astype(float)
    inside = mask > 0
    around = (cv2.dilate(mask, np.ones((9, 9), np.uint8)) > 0) & ~inside
    rough = float(np.std(grey.astype(float)[around] - cv2.GaussianBlur(grey, (0, 0), 2.0).astype(float)[around]))
    return np.where(inside, filled + rough * rng.normal(size=pixels.shape), pixels)


def _gone(frames: Frames, boxes: Boxes, rng: np.random.Generator, share: Callable[[int], float], end: int) -> int:
    """Leave only a share of the target from `BEGIN` on, and none of it as soon as that is below a fifth."""
    for k in range(BEGIN, min(end, len(frames))):
        if k in boxes:
            part = share(k - BEGIN)
            frames[k] = part * frames[k] + (1.0 - part) * cleaned(frames[k], boxes[k], rng)
            if part < 0.2:
                del boxes[k]
    return end


def another(frames: Frames, boxes: Boxes, rng: np.random.Generator, other: Array) -> int:
    for k in range(BEGIN, min(BEGIN + 100, len(frames))):
        frames[k] = other[(k - BEGIN) % len(other)].astype(float)
        boxes.pop(k, None)
    return BEGIN + 100


def moved(frames: Frames, boxes: Boxes, rng: np.random.Generator, other: Array) -> int:
    at = boxes[min(boxes, key=lambda k: abs(k - BEGIN))][:2]
    middle = 0.5 * np.array(frames[0].shape[::-1])
    step = np.where(at > middle, -100, 100)  # so that it stays in the picture
    for k in range(BEGIN, len(frames)):
        M = np.array([[1.0, 0.0, step[0]], [0.0, 1.0, step[1]]])
        frames[k] = cv2.warpAffine(frames[k], M, frames[k].shape[::-1], borderMode=cv2.BORDER_REFLECT)
        if k in boxes:
            boxes[k] = boxes[k] + [*step, 0.0, 0.0]
    return BEGIN


def fades(frames: Frames, boxes: Boxes, rng: np.random.Generator, other: Array) -> int:
    return _gone(frames, boxes, rng, lambda k: max(1.0 - k / 30.0, 0.0), BEGIN + 90)


def gone(frames: Frames, boxes: Boxes, rng: np.random.Generator, other: Array) -> int:
    return _gone(frames, boxes, rng, lambda k: 0.0, BEGIN + 60)


def pole(frames: Frames, boxes: Boxes, rng: np.random.Generator, other: Array) -> int:
    box = boxes[min(boxes, key=lambda k: abs(k - BEGIN))]
    for k in range(BEGIN, min(BEGIN + 40, len(frames))):
        if k in boxes:
            own = boxes.pop(k)
            reach = own[2] + 3.0 + abs(own[0] - box[0])
            low, high = (int(np.clip(box[0] + sign * reach, 0, frames[k].shape[1])) for sign in (-1, 1))
            frames[k] = frames[k].copy()
            frames[k][:, low:high] = 0.8 * np.median(frames[k]) + rng.normal(0.0, 1.5, (len(frames[k]), high - low))
    return BEGIN + 40


def leaves(frames: Frames, boxes: Boxes, rng: np.random.Generator, other: Array) -> int:
    shift = 0
    for k in range(BEGIN, len(frames)):
        inside = k in boxes and boxes[k][0] + shift > -0.5 * boxes[k][2]
        shift -= 4 if inside else 0
        M = np.array([[1.0, 0.0, shift], [0.0, 1.0, 0.0]])
        frames[k] = cv2.warpAffine(frames[k], M, frames[k].shape[::-1], borderMode=cv2.BORDER_REFLECT_101)
        if k in boxes:
            boxes[k] = boxes[k] + [shift, 0.0, 0.0, 0.0]
            if boxes[k][0] < 0:
                frames[k] = frames[k].copy()
                mirrored = boxes[k] * [-1.0, 1.0, 1.0, 1.0]
                frames[k] = cleaned(frames[k], mirrored, rng)
                del boxes[k]
    return 0


def tip(frames: Frames, boxes: Boxes, rng: np.random.Generator, other: Array) -> int:
    first = min(boxes, key=lambda k: abs(k - BEGIN))
    x, y, w, h = boxes[first]
    rows, columns = np.mgrid[: frames[0].shape[0], : frames[0].shape[1]]
    bump = np.exp(-0.5 * (((columns - x) / (0.3 * w)) ** 2 + ((rows - y) / (0.3 * h)) ** 2))
    near = frames[first][int(max(y - h / 2, 0)) : int(y + h / 2) + 1, int(max(x - w / 2, 0)) : int(x + w / 2) + 1]
    bright = 0.8 * (float(near.max()) - float(np.median(frames[first])))
    end = _gone(frames, boxes, rng, lambda k: max(1.0 - k / 10.0, 0.0), BEGIN + 70)
    for k in range(BEGIN, min(end, len(frames))):
        frames[k] = frames[k] + bright * min((k - BEGIN) / 10.0, 1.0) * bump
    return end


def trees(frames: Frames, boxes: Boxes, rng: np.random.Generator, other: Array) -> int:
    rows, columns = np.mgrid[: frames[0].shape[0], : frames[0].shape[1]]
    crown = 2.0 * np.sin(columns / 5.0) + 1.5 * np.sin(columns / 2.3)
    rough = 30.0 + 10.0 * cv2.GaussianBlur(rng.normal(size=frames[0].shape), (0, 0), 1.0) * 3.0
    last = None
    for k in range(len(frames)):
        last = boxes.get(k, last)
        if last is not None:
            edge = last[1] + 1.1 * max(last[2], last[3]) + 2.0 + 60.0 * max(0.0, 1.0 - k / BEGIN)
            frames[k] = np.where(rows > edge + crown, frames[k] + rough, frames[k])
    return 0


KINDS: dict[str, Plant] = {
    "another": another,
    "moved": moved,
    "fades": fades,
    "gone": gone,
    "pole": pole,
    "exit": leaves,
    "tip": tip,
    "trees": trees,
}


def planted(recorded: list[Clip], every: int) -> list[tuple[str, Clip, int]]:
    """Return clips of one segment each with a loss in it, its kind, and in which frame the target is back, 0 for none."""
    parts = [(clip, *part) for clip in recorded for part in clip.segments if part[1] - part[0] >= 150]
    made = []
    for number, (kind, plant) in enumerate(KINDS.items()):
        for i, (clip, begin, end) in enumerate(parts):
            if i % every != number % every:
                continue
            start = min(k for k in clip.boxes if k >= begin)
            frames = [each.astype(float) for each in clip.frames[start:end]]
            boxes = {k - start: box.copy() for k, box in clip.boxes.items() if start <= k < end}
            other = parts[(i + len(parts) // 2) % len(parts)][0].frames
            back = plant(frames, boxes, np.random.default_rng([number, i]), other)
            eight = np.clip(np.rint(np.array(frames)), 0, 255).astype(np.uint8)
            made.append((kind, evolve(clip, frames=eight, boxes=boxes, segments=((0, len(eight)),)), back))
    return made


def again(one: Followed, back: int) -> bool | None:
    """Return whether the target is held again within 15 frames after it is back; None if it is not back so long."""
    if not back or not np.isfinite(one.error[back : back + 16]).sum() > 10:
        return None
    well = (one.error <= np.maximum(10.0, 0.5 * one.true[:, 2:].max(axis=1))) & ~one.doubted
    return bool(well[back : back + 16].any())


def main() -> None:
    """Print what was told of each kind of loss, and how often the target was found again."""
    parser = argparse.ArgumentParser(
        "python -m benchmarks.flir_losses", description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--clips", choices=["all", "odd", "even"], default="odd")
    parser.add_argument("--every", type=int, default=3)
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="a parameter of the estimator")
    given = parser.parse_args()
    made: Any = tracker(**dict(assigned.split("=", 1) for assigned in given.set))
    of_kind: dict[str, list[tuple[Followed, int]]] = {}
    for kind, clip, back in planted(clips(given.clips), given.every):
        of_kind.setdefault(kind, []).append((follow(made, clip, 0, len(clip.frames)), back))
    of_kind["all"] = [run for own in of_kind.values() for run in own]
    for kind, runs in of_kind.items():
        lost = np.concatenate([each for one, _ in runs for each in losses(one)] or [np.zeros(0)])
        good = np.concatenate([held(one) for one, _ in runs])
        found = [seen for one, back in runs if (seen := again(one, back)) is not None]
        print(
            f"{kind:8} {len(runs):2} runs: lost frames told {lost.mean() if len(lost) else np.nan:.2f} of {len(lost)}, good "
            f"frames doubted {good.mean():.4f} of {len(good)}, found again within 15 frames {sum(found)} of {len(found)}",
            flush=True,
        )


if __name__ == "__main__":
    main()
