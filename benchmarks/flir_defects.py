"""What cameras, their operators and their coders do to frames that no recorded infrared clip shows."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from vedette import Array

Boxes = dict[int, Array]
Defect = Callable[[Array, Boxes, np.random.Generator], int]
"""Changes frames (k, h, w) and boxes; returns in which frame the target is back, 0 for none."""


def text(frames: Array, boxes: Boxes, rng: np.random.Generator) -> int:
    known = sorted(boxes)
    x, y = np.rint(boxes[known[len(known) // 2]][:2]).astype(int)
    sign, bright = np.zeros(frames.shape[1:], np.uint8), rng.choice([20.0, 240.0])
    for a, b in (((x - 40, y), (x - 6, y)), ((x + 6, y), (x + 40, y)), ((x, y - 40), (x, y - 6)), ((x, y + 6), (x, y + 40))):
        cv2.line(sign, a, b, 255, 1)
    for row in (15, 30, 240):
        cv2.putText(sign, "AZ 123.4 EL 05.6  WHT", (8, row), cv2.FONT_HERSHEY_PLAIN, 0.9, 255, 1)
    frames[:, sign > 0] = bright
    return 0


def dead(frames: Array, boxes: Boxes, rng: np.random.Generator) -> int:
    shape = frames.shape[1:]
    stuck = rng.uniform(size=shape) < 0.002
    stuck |= cv2.dilate((rng.uniform(size=shape) < 0.0003).astype(np.uint8), np.ones((2, 2), np.uint8)) > 0
    level, blinks = rng.choice([10.0, 245.0], shape), rng.uniform(size=shape) < 0.3
    for frame in frames:
        now = stuck & (~blinks | (rng.uniform(size=shape) < 0.5))
        frame[now] = level[now]
    return 0


def gain(frames: Array, boxes: Boxes, rng: np.random.Generator) -> int:
    by, level = 1.0, 0.0
    for k, frame in enumerate(frames):
        if k % 25 == 20:
            by, level = rng.uniform(0.5, 1.6), rng.uniform(-30.0, 30.0)
        middle = np.median(frame)
        frame[:] = middle + level + by * (frame - middle)
    return 0


def frozen(frames: Array, boxes: Boxes, rng: np.random.Generator) -> int:
    k = 20
    while k < len(frames) - 10:
        count = int(rng.integers(2, 9))
        frames[k + 1 : k + count] = frames[k]
        for j in range(k + 1, k + count):
            boxes.pop(j, None)
            if k in boxes:
                boxes[j] = boxes[k]
        k += count + int(rng.integers(8, 20))
    return 0


def interlaced(frames: Array, boxes: Boxes, rng: np.random.Generator) -> int:
    frames[1:, ::2] = frames[:-1, ::2].copy()
    return 0


def _warped(frames: Array, boxes: Boxes, k: int, by: float, off: Array) -> None:
    """Show frame k zoomed around its middle and shifted; mirrored beyond its edge."""
    size = np.array(frames.shape[:0:-1])
    M = np.column_stack([by * np.eye(2), (1.0 - by) * 0.5 * (size - 1) + off])
    frames[k] = cv2.warpAffine(frames[k], M, tuple(size), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT_101)
    if k in boxes:
        x, y = M @ [*boxes[k][:2], 1.0]
        boxes[k] = np.array([x, y, *(by * boxes[k][2:])])
        if not (0 <= x < size[0] and 0 <= y < size[1]):
            del boxes[k]


def jerks(frames: Array, boxes: Boxes, rng: np.random.Generator) -> int:
    off, goal, back = np.zeros(2), np.zeros(2), 0
    for k in range(len(frames)):
        if k % 30 == 29:
            angle = rng.uniform(0.0, 2.0 * np.pi)
            goal = rng.uniform(8.0, 30.0) * np.array([np.cos(angle), np.sin(angle)])
            back = k + 2 if k + 20 < len(frames) else back
        off = off + np.clip(goal - off, -15.0, 15.0)
        _warped(frames, boxes, k, 1.0, off)
    return back


def smears(frames: Array, boxes: Boxes, rng: np.random.Generator) -> int:
    off, speed = np.zeros(2), np.zeros(2)
    for k in range(len(frames)):
        speed = 0.7 * speed - 0.1 * off + rng.normal(0.0, 1.5, 2)
        off = off + speed
        steps = np.linspace(-0.5, 0.5, 7)
        size = frames.shape[:0:-1]
        frames[k] = np.mean(
            [cv2.warpAffine(frames[k], np.column_stack([np.eye(2), s * speed]), size, borderMode=2) for s in steps], axis=0
        )
        _warped(frames, boxes, k, 1.0, off)
    return 0


def zooms(frames: Array, boxes: Boxes, rng: np.random.Generator) -> int:
    way = np.interp(np.arange(len(frames)), [40, 45, 90, 95], [0.0, 1.0, 1.0, 0.0])
    for k in range(len(frames)):
        _warped(frames, boxes, k, 1.5 ** float(way[k]), np.zeros(2))
    return 0


def noise(frames: Array, boxes: Boxes, rng: np.random.Generator) -> int:
    fixed = rng.normal(0.0, 2.0, frames.shape[1:]) + rng.normal(0.0, 2.0, frames.shape[2])
    frames += fixed + rng.normal(0.0, 5.0, frames.shape)
    return 0


DEFECTS: dict[str, Defect] = {
    each.__name__: each for each in (text, dead, gain, frozen, interlaced, jerks, smears, zooms, noise)
}
