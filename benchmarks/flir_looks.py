"""Recorded clips whose target looks otherwise as time goes on: it turns, yaws, beats its wings, comes nearer, warms."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from benchmarks.flir_cameras import Change, Changed, eight
from vedette import Array


def own(frame: Array, box: Array) -> Array:
    """Return a target's own light in a frame, above its grey opening: of the region that holds the brightest of its box."""
    half = np.ceil(0.6 * box[2:]).astype(int) + 1
    low = np.maximum(np.rint(box[:2]).astype(int) - half, 0)
    inside = np.s_[low[1] : low[1] + 2 * half[1] + 1, low[0] : low[0] + 2 * half[0] + 1]
    smooth = cv2.GaussianBlur(frame, (0, 0), 0.7)
    opened = cv2.morphologyEx(smooth, cv2.MORPH_OPEN, np.ones((2 * int(np.max(half)) + 1,) * 2, np.uint8))
    above, mask = np.zeros_like(frame), np.zeros(frame.shape, np.uint8)
    above[inside] = (smooth - opened)[inside]
    if above.max() < 5.0 * np.median(np.abs(frame - smooth)) / 0.6745:
        return np.zeros_like(frame)  # it cannot be told from the noise around
    mask[above > 0.3 * above.max()] = 1
    labels = cv2.connectedComponents(mask)[1]
    region = (labels == labels.ravel()[np.argmax(above)]).astype(np.uint8)
    soft = cv2.GaussianBlur(cv2.dilate(region, np.ones((3, 3), np.uint8)).astype(float), (0, 0), 0.7)
    return soft * np.maximum(frame - opened, 0.0)


def looks(shape: Callable[[int], Array], bright: Callable[[int], float], size: Callable[[int], Array]) -> Change:
    """Return what draws a target's own light through `shape` (2, 2) and so many times as bright in frame k.

    Its box is as many times as large as `size` (2,) says.
    """

    def change(frames: Array, boxes: dict[int, Array], rng: np.random.Generator) -> Changed:
        out, placed, first = list(frames), {}, min(boxes)
        for k, box in boxes.items():
            frame, A = frames[k].astype(float), shape(k - first)
            light, M = own(frame, box), np.column_stack([A, box[:2] - A @ box[:2]])
            moved = cv2.warpAffine(light, M, frame.shape[::-1], flags=cv2.INTER_LINEAR)
            out[k] = frame - light + bright(k - first) * moved
            placed[k] = np.concatenate([box[:2], box[2:] * size(k - first)])
        return Changed(eight(out), placed)

    return change


def _one(k: int) -> float:
    return 1.0


def _turn(k: int, rate: float) -> Array:
    c, s = np.cos(np.radians(rate * k)), np.sin(np.radians(rate * k))
    return np.array([[c, -s], [s, c]])


def turns(rate: float) -> Change:
    """Return a target that turns in the picture by `rate` degrees a frame."""
    return looks(lambda k: _turn(k, rate), _one, lambda k: np.ones(2))


def stretched(across: Callable[[int], float], down: Callable[[int], float], bright: Callable[[int], float] = _one) -> Change:
    """Return a target that is so many times as wide, high and bright."""

    def size(k: int) -> Array:
        return np.array([across(k), down(k)])

    return looks(lambda k: np.diag(size(k)), bright, size)


def wave(period: float, low: float, high: float) -> Callable[[int], float]:
    """Return what goes from `high` to `low` and back in `period` frames."""
    return lambda k: 0.5 * (high + low) + 0.5 * (high - low) * float(np.cos(2.0 * np.pi * k / period))


def ramp(rate: float, last: float) -> Callable[[int], float]:
    """Return what changes by the factor e^rate a frame, from 1 to `last`."""
    return lambda k: float(np.clip(np.exp(rate * k), min(last, 1.0), max(last, 1.0)))


LOOKS: dict[str, Change] = {
    "turns 2": turns(2.0),
    "turns 6": turns(6.0),
    "yaws": stretched(wave(90.0, 0.4, 1.0), _one),
    "yaws fast": stretched(wave(30.0, 0.4, 1.0), _one),
    "beats": stretched(_one, wave(6.0, 0.5, 1.0), wave(6.0, 0.7, 1.0)),
    "nearer": stretched(ramp(0.01, 2.5), ramp(0.01, 2.5)),
    "nearer fast": stretched(ramp(0.03, 3.0), ramp(0.03, 3.0)),
    "farther": stretched(ramp(-0.01, 0.5), ramp(-0.01, 0.5)),
    "warms": stretched(_one, _one, wave(180.0, 2.0, 1.0)),
    "cools": stretched(_one, _one, wave(180.0, 0.4, 1.0)),
    "flickers": stretched(_one, _one, wave(4.0, 0.5, 1.3)),
}
