"""Losses of every kind, planted into the segments of recorded infrared clips: are they told, and is the target found again?

    VEDETTE_DATA=FOLDER python -m benchmarks.flir_losses [--clips odd] [--every 3] [--set NAME=VALUE]

Each kind is planted into one in `--every` of the segments of at least 150 frames, each time into others. From frame 50 on:

another    100 frames of another clip, its own target taken out, then back
moved      a cut: the picture is shifted by 100 px, at random up or down and left or right, and mirrored beyond its edge
fades      the target fades within 30 frames, and is gone for 60
gone       it is gone at once, for 60 frames
pole       a pole stands before where it flies, for 40 frames
exit       the picture is shifted by 4 px a frame until the target is out of it, for 60 frames more
returns    the picture is shifted by 5 px a frame to the nearer side until it is out of it, and after 30 frames back as fast
tip        it fades within 10 frames, and a tip as bright as .8 of it stands where it was, for 60 frames
passes     a tip stands still where it will be in frame 70, as bright as it, from the start on; it fades there, for 60 frames
trees      a wood below it, 1.1 sizes away: no loss
crosses    a spot as bright and half as large crosses it within 40 frames: no loss
halts      target and camera stand still for 60 frames, with noise of a count, and go on: no loss

What is taken away is replaced by what is around it. Told: existence below one half, from the eleventh frame of a loss on.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
from attrs import evolve

from benchmarks.flir_clips import Clip, Followed, clips, cut, follow, held, losses, tracker
from vedette import Array

BEGIN = 50
Frames = list[Array]
Boxes = dict[int, Array]
Plant = Callable[[Frames, Boxes, np.random.Generator, Clip], int | None]
"""Changes frames and boxes of a segment, from its own frame 0 on; returns in which frame the target is back, 0 for none;
None where it cannot be planted.
"""


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


def another(frames: Frames, boxes: Boxes, rng: np.random.Generator, other: Clip) -> int:
    seen = min(other.boxes)
    for k in range(BEGIN, min(BEGIN + 100, len(frames))):
        i = (k - BEGIN) % len(other.frames)
        box = other.boxes.get(i, other.boxes.get(i - 1, other.boxes[seen]))
        frames[k] = cleaned(other.frames[i].astype(float), box, rng)
        boxes.pop(k, None)
    return BEGIN + 100


def _shift(frames: Frames, boxes: Boxes, rng: np.random.Generator, k: int, step: Array) -> None:
    """Shift frame k and its box, and mirror the rest of the picture, without the target, beyond its edge."""
    M, size = np.array([[1.0, 0.0, step[0]], [0.0, 1.0, step[1]]]), frames[k].shape[::-1]
    shifted = cv2.warpAffine(frames[k], M, size)
    inside = cv2.warpAffine(np.ones_like(frames[k]), M, size) > 0.5
    rest = cleaned(frames[k], boxes[k], rng) if k in boxes else frames[k]
    frames[k] = np.where(inside, shifted, cv2.warpAffine(rest, M, size, borderMode=cv2.BORDER_REFLECT_101))
    if k in boxes:
        boxes[k] = boxes[k] + [*step, 0.0, 0.0]


def moved(frames: Frames, boxes: Boxes, rng: np.random.Generator, other: Clip) -> int:
    at = boxes[min(boxes, key=lambda k: abs(k - BEGIN))][:2]
    middle = 0.5 * np.array(frames[0].shape[::-1])
    step = np.where(at > middle, -100, 100)  # so that it stays in the picture
    for k in range(BEGIN, len(frames)):
        _shift(frames, boxes, rng, k, step)
    return BEGIN


def fades(frames: Frames, boxes: Boxes, rng: np.random.Generator, other: Clip) -> int:
    return _gone(frames, boxes, rng, lambda k: max(1.0 - k / 30.0, 0.0), BEGIN + 90)


def gone(frames: Frames, boxes: Boxes, rng: np.random.Generator, other: Clip) -> int:
    return _gone(frames, boxes, rng, lambda k: 0.0, BEGIN + 60)


def pole(frames: Frames, boxes: Boxes, rng: np.random.Generator, other: Clip) -> int:
    box = boxes[min(boxes, key=lambda k: abs(k - BEGIN))]
    for k in range(BEGIN, min(BEGIN + 40, len(frames))):
        if k in boxes:
            own = boxes.pop(k)
            reach = own[2] + 3.0 + abs(own[0] - box[0])
            low, high = (int(np.clip(box[0] + sign * reach, 0, frames[k].shape[1])) for sign in (-1, 1))
            frames[k] = frames[k].copy()
            frames[k][:, low:high] = 0.8 * np.median(frames[k]) + rng.normal(0.0, 1.5, (len(frames[k]), high - low))
    return BEGIN + 40


def leaves(frames: Frames, boxes: Boxes, rng: np.random.Generator, other: Clip) -> int:
    shift = 0
    for k in range(BEGIN, len(frames)):
        shift -= 4 if k in boxes and boxes[k][0] + shift > -0.5 * boxes[k][2] else 0
        _shift(frames, boxes, rng, k, np.array([shift, 0]))
        if k in boxes and boxes[k][0] < 0:
            del boxes[k]
    return 0


def returns(frames: Frames, boxes: Boxes, rng: np.random.Generator, other: Clip) -> int | None:
    last, shift, out, back = frames[0].shape[1] - 1, 0, len(frames), 0
    step = 5 if boxes[min(boxes, key=lambda k: abs(k - BEGIN))][0] > 0.5 * last else -5
    for k in range(BEGIN, len(frames)):
        shift += step if out == len(frames) else -step if k > out + 30 and shift else 0
        _shift(frames, boxes, rng, k, np.array([shift, 0]))
        if k not in boxes or 0 <= boxes[k][0] <= last:
            back = back or (k if k in boxes and k > out else 0)
            continue
        if abs(boxes[k][0] - 0.5 * last) > 0.5 * (last + boxes[k][2]):
            out = min(out, k)
        del boxes[k]
    return back or None


def _bump(frames: Frames, box: Array, scale: float) -> Array:
    """Return a smooth spot (h, w) at a box, `scale` times as large as the target there, as bright as it."""
    (h, w), (x, y, across, down) = frames[0].shape, box
    rows, columns = np.mgrid[:h, :w]
    return np.exp(-0.5 * (((columns - x) / (0.3 * scale * across)) ** 2 + ((rows - y) / (0.3 * scale * down)) ** 2))


def _bright(frames: Frames, boxes: Boxes) -> tuple[Array, float]:
    """Return the box at `BEGIN`, and by how much the target is brighter there than the frame's median."""
    first = min(boxes, key=lambda k: abs(k - BEGIN))
    x, y, w, h = boxes[first]
    near = frames[first][int(max(y - h / 2, 0)) : int(y + h / 2) + 1, int(max(x - w / 2, 0)) : int(x + w / 2) + 1]
    return boxes[first], float(near.max()) - float(np.median(frames[first]))


def _beneath(pixels: Array, bump: Array, bright: float) -> Array:
    """Return a frame (h, w) behind a spot: as much of it as the spot leaves through."""
    return np.maximum(pixels, pixels + bump / bright * (np.median(pixels) + bright - pixels))


def tip(frames: Frames, boxes: Boxes, rng: np.random.Generator, other: Clip) -> int:
    box, bright = _bright(frames, boxes)
    bump = 0.8 * bright * _bump(frames, box, 1.0)
    end = _gone(frames, boxes, rng, lambda k: max(1.0 - k / 10.0, 0.0), BEGIN + 70)
    for k in range(BEGIN, min(end, len(frames))):
        frames[k] = frames[k] + min((k - BEGIN) / 10.0, 1.0) * bump
    return end


def passes(frames: Frames, boxes: Boxes, rng: np.random.Generator, other: Clip) -> int | None:
    near = [boxes[min(boxes, key=lambda k: abs(k - at))] for at in (0, BEGIN + 20)]
    if np.all(np.abs(near[1] - near[0])[:2] < 1.5 * near[0][2:]):
        return None  # it stands still: that tip is where it always was
    bright = _bright(frames, boxes)[1]
    bump = bright * _bump(frames, boxes[min(boxes, key=lambda k: abs(k - BEGIN - 20))], 1.0)
    end = _gone(frames, boxes, rng, lambda k: float(np.clip((30.0 - k) / 20.0, 0.0, 1.0)), BEGIN + 90)
    for k in range(len(frames)):
        frames[k] = _beneath(frames[k], bump, bright)
    return end


def crosses(frames: Frames, boxes: Boxes, rng: np.random.Generator, other: Clip) -> int:
    bright = _bright(frames, boxes)[1]
    aside = rng.choice([-1.0, 1.0], 2)
    for k in range(BEGIN, min(BEGIN + 40, len(frames))):
        box = boxes.get(k, boxes[min(boxes, key=lambda j: abs(j - k))])
        off = aside * (k - BEGIN - 20.0) / 20.0 * (2.5 * box[2:] + 10.0)
        frames[k] = _beneath(frames[k], bright * _bump(frames, box + [*off, 0.0, 0.0], 0.5), bright)
    return 0


def trees(frames: Frames, boxes: Boxes, rng: np.random.Generator, other: Clip) -> int:
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


def halts(frames: Frames, boxes: Boxes, rng: np.random.Generator, other: Clip) -> int:
    before = boxes.copy()
    boxes.clear()
    still = [frames[BEGIN] + rng.normal(0.0, 1.0, frames[0].shape) for _ in range(60)]
    for k in range(len(frames)):
        source = k if k < BEGIN else max(k - 60, BEGIN)
        if source in before:
            boxes[k] = before[source]
    frames[BEGIN:] = (still + frames[BEGIN:])[: len(frames) - BEGIN]
    return 0


KINDS: dict[str, Plant] = {
    "another": another,
    "moved": moved,
    "fades": fades,
    "gone": gone,
    "pole": pole,
    "exit": leaves,
    "tip": tip,
    "passes": passes,
    "crosses": crosses,
    "trees": trees,
    "halts": halts,
    "returns": returns,
}


def planted(recorded: list[Clip], every: int) -> list[tuple[str, Clip, int]]:
    """Return clips of one segment each with a loss in it, its kind, and in which frame the target is back, 0 for none."""
    parts = [(clip, *part) for clip in recorded for part in clip.segments if part[1] - part[0] >= 150]
    made = []
    for number, (kind, plant) in enumerate(KINDS.items()):
        for i, (clip, begin, end) in enumerate(parts):
            if i % every != number % every:
                continue
            part, boxes = cut(clip, begin, end)
            frames = [each.astype(float) for each in part]
            other = parts[(i + len(parts) // 2) % len(parts)][0]
            back = plant(frames, boxes, np.random.default_rng([number, i]), other)
            if back is None:
                continue
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
