"""Draws the detections of this example: people on a square, on foot and on bicycles, in the MOTChallenge's format.

    python examples/boxes/draw.py

People walk on a plane under a camera 5 m up. Who is nearer hides who is behind; a detector misses the more, the more of a
person is hidden, draws boxes with errors that grow with their size, some of them heavy, confuses who is on foot (class 1)
with who rides (class 2), and finds people where there are none, at some places again and again. All numbers were chosen by
hand before any tracker ran, but for the bicycles, which came later.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

FRAMES, RATE, SEED = 400, 20, 11
WIDTH, HEIGHT, FOCAL, UP = 1280.0, 720.0, 900.0, 5.0
TILT = 0.3  # rad, downwards
PEOPLE, RIDERS = 26, 6
CONFUSED = 0.1  # probability of the wrong class
TALL, WIDE = 1.72, 0.55  # m
SEEN, FALSE, HAUNTED = 0.94, 1.2, 4  # P_D in the open; false boxes a frame; places that give false boxes again and again
PLACE_ERROR, SIZE_ERROR, HEAVY = 0.035, 0.06, 0.06


def boxes_of(ground: np.ndarray, tall: np.ndarray) -> np.ndarray:
    """Return boxes (p, 4), middle and sides in px, of people who stand at x across and y ahead, in m (p, 2)."""
    across, ahead = ground.T
    depth = ahead * np.cos(TILT) + UP * np.sin(TILT)
    down = UP * np.cos(TILT) - ahead * np.sin(TILT)
    up = down - tall * np.cos(TILT)
    x, foot, head = (WIDTH / 2 + FOCAL * across / depth, *(HEIGHT / 2 + FOCAL * v / depth for v in (down, up)))
    width = FOCAL * WIDE * tall / TALL / depth
    return np.stack([x, (foot + head) / 2, width, foot - head], axis=-1)


def walks(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return places (s, p, 2) in m, and which people are there (s, p)."""
    start = np.stack([rng.uniform(-9, 9, PEOPLE), rng.uniform(9, 26, PEOPLE)], axis=-1)
    course, speed = rng.uniform(0, 2 * np.pi, PEOPLE), rng.normal(1.3, 0.25, PEOPLE)
    speed[:RIDERS] *= 2.5
    begin = np.where(rng.random(PEOPLE) < 0.5, 0, rng.integers(0, FRAMES - 100, PEOPLE))
    length = rng.integers(100, FRAMES, PEOPLE)
    places, there = np.zeros((FRAMES, PEOPLE, 2)), np.zeros((FRAMES, PEOPLE), dtype=bool)
    spot = start
    for frame in range(FRAMES):
        there[frame] = (begin <= frame) & (frame < begin + length)
        course = course + rng.normal(0, 0.35 / np.sqrt(RATE), PEOPLE)
        step = np.stack([np.cos(course), np.sin(course)], axis=-1) * speed[:, None] / RATE
        spot = np.where(there[frame][:, None], spot + step, spot)
        near, far = spot[:, 1] < 7.5, spot[:, 1] > 28
        course = np.where((near & (np.sin(course) < 0)) | (far & (np.sin(course) > 0)), -course, course)
        places[frame] = spot
    return places, there


def hidden(boxes: np.ndarray, ahead: np.ndarray) -> np.ndarray:
    """Return how much of each box (p,) the box of someone nearer covers, the most of all."""
    low, high = boxes[:, :2] - boxes[:, 2:] / 2, boxes[:, :2] + boxes[:, 2:] / 2
    sides = np.minimum(high[:, None], high[None]) - np.maximum(low[:, None], low[None])
    shared = np.prod(np.maximum(sides, 0), axis=-1) / np.prod(boxes[:, 2:], axis=-1)[:, None]
    return np.max(np.where(ahead[None] < ahead[:, None], shared, 0.0), axis=1, initial=0.0)


def detected(rng: np.random.Generator, boxes: np.ndarray, ahead: np.ndarray, kinds: np.ndarray) -> list[tuple]:
    """Return what the detector finds in a frame: boxes, scores and classes."""
    covered = hidden(boxes, ahead)
    found = []
    for box, share, kind in zip(boxes, covered, kinds, strict=True):
        if rng.random() < SEEN * np.clip(1.25 - 1.5 * share, 0.0, 1.0):
            wide = (3.0 if rng.random() < HEAVY else 1.0) * (1.0 + share)
            error = wide * np.array([PLACE_ERROR, PLACE_ERROR, SIZE_ERROR, SIZE_ERROR]) * np.tile(box[2:], 2)
            z = box + error * rng.standard_normal(4)
            z[2:] = np.maximum(z[2:], 4.0)
            named = 3 - kind if rng.random() < CONFUSED else kind
            found.append((z, 1 / (1 + np.exp(-rng.normal(2.2 - 1.5 * share, 1.0))), named))
    return found


def false_boxes(rng: np.random.Generator, haunted: np.ndarray, count: int) -> list[tuple]:
    """Return boxes where nobody is."""
    ground = np.stack([rng.uniform(-12, 12, count), rng.uniform(7, 28, count)], axis=-1)
    anywhere = boxes_of(ground, rng.normal(TALL, 0.3, count))
    again = haunted[rng.random(len(haunted)) < 0.12]
    again = again + 0.05 * np.tile(again[:, 2:], 2) * rng.standard_normal(again.shape)
    return [(box, 1 / (1 + np.exp(-rng.normal(-0.2, 1.0))), rng.integers(1, 3)) for box in (*anywhere, *again)]


def draw(folder: Path) -> None:
    """Write gt.txt, det.txt and seqinfo.ini."""
    rng = np.random.default_rng(SEED)
    places, there = walks(rng)
    tall, kinds = rng.normal(TALL, 0.08, PEOPLE), np.where(np.arange(PEOPLE) < RIDERS, 2, 1)
    haunted = boxes_of(
        np.stack([rng.uniform(-7, 7, HAUNTED), rng.uniform(12, 25, HAUNTED)], axis=-1), np.full(HAUNTED, TALL)
    )
    truth, detections = [], []
    for frame in range(FRAMES):
        boxes = boxes_of(places[frame], tall)
        inside = there[frame] & np.all((boxes[:, :2] > 0) & (boxes[:, :2] < [WIDTH, HEIGHT]), axis=-1)
        truth += [line(frame + 1, i + 1, boxes[i], f"1,{kinds[i]},1.0") for i in np.flatnonzero(inside)]
        found = detected(rng, boxes[inside], places[frame, inside, 1], kinds[inside])
        found += false_boxes(rng, haunted, rng.poisson(FALSE))
        for i in rng.permutation(len(found)):
            box, score, kind = found[i]
            if 0 < box[0] < WIDTH and 0 < box[1] < HEIGHT:
                detections.append(line(frame + 1, -1, box, f"{score:.3f},{kind}"))
    (folder / "gt.txt").write_text("".join(truth))
    (folder / "det.txt").write_text("".join(detections))
    size = f"imWidth={WIDTH:g}\nimHeight={HEIGHT:g}\n"
    (folder / "seqinfo.ini").write_text(f"[Sequence]\nname=square\nframeRate={RATE}\nseqLength={FRAMES}\n{size}")


def line(frame: int, number: int, box: np.ndarray, rest: str) -> str:
    """Return a line of such a file."""
    (x, y), (width, height) = box[:2], box[2:]
    return f"{frame},{number},{x - width / 2:.1f},{y - height / 2:.1f},{width:.1f},{height:.1f},{rest}\n"


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
