"""Recorded clips as another camera shows them: one that turns, zooms, or follows its target; or whose target hovers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
from attrs import frozen

from benchmarks.flir_losses import cleaned
from vedette import Array


@frozen(eq=False)
class Changed:
    """Frames (k, h, w), true boxes by frame, pixels for one as recorded, frames a second."""

    frames: Array
    boxes: dict[int, Array]
    scale: float = 1.0
    rate: float = 30.0


Change = Callable[[Array, dict[int, Array], np.random.Generator], Changed]


def eight(frames: Any) -> Array:
    """Return frames of eight bits."""
    return np.clip(np.rint(np.asarray(frames)), 0, 255).astype(np.uint8)


def turned(most: float, shake: float) -> Change:
    """Return a camera that turns by up to `most` px a frame, and shakes; beyond the picture's edge it is mirrored."""

    def change(frames: Array, boxes: dict[int, Array], rng: np.random.Generator) -> Changed:
        at, step, out, placed = np.zeros(2), rng.uniform(-1.0, 1.0, 2), [], {}
        size = np.array(frames.shape[:0:-1])
        for k, frame in enumerate(frames):
            box = boxes.get(k)
            step = np.clip(step + rng.normal(0.0, 0.1, 2), -most, most)
            if box is not None:
                room = 0.5 * box[2:] + 12.0
                step = np.where((box[:2] + at < room) & (step < 0) | (box[:2] + at > size - room) & (step > 0), -step, step)
            step = np.where(np.abs(at) > 60.0, -np.sign(at) * np.abs(step), step)
            at = at + step
            off = at + rng.normal(0.0, shake, 2)
            M, rest = np.column_stack([np.eye(2), off]), frame.astype(float)
            moved = cv2.warpAffine(rest, M, tuple(size), flags=cv2.INTER_CUBIC)
            inside = cv2.warpAffine(np.ones_like(rest), M, tuple(size)) > 0.999
            beyond = cleaned(rest, box, rng) if box is not None else rest
            beyond = cv2.warpAffine(beyond, M, tuple(size), flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT_101)
            out.append(np.where(inside, moved, beyond))
            if box is not None and np.all((box[:2] + off > 0) & (box[:2] + off < size - 1)):
                placed[k] = box + [*off, 0.0, 0.0]
        return Changed(eight(out), placed)

    return change


def zooms(rate: float, most: float) -> Change:
    """Return a camera that zooms in by the factor e^rate a frame up to `most`, out to none, and in again."""

    def change(frames: Array, boxes: dict[int, Array], rng: np.random.Generator) -> Changed:
        middle, period, out, placed = 0.5 * (np.array(frames.shape[:0:-1]) - 1.0), 2.0 * np.log(most), [], {}
        for k, frame in enumerate(frames):
            by = np.exp(0.5 * period - abs(0.5 * period - (rate * k) % period))
            M = np.column_stack([by * np.eye(2), (1.0 - by) * middle])
            out.append(cv2.warpAffine(frame.astype(float), M, frame.shape[::-1], flags=cv2.INTER_CUBIC))
            if k in boxes and np.all(np.abs(at := by * (boxes[k][:2] - middle)) < middle):
                placed[k] = np.array([*(middle + at), *(by * boxes[k][2:])])
        return Changed(eight(out), placed)

    return change


def still(hovers: bool) -> Change:
    """Return a target that stands in the frames as it looked in flight: its camera follows it, or it hovers in the scene."""

    def change(frames: Array, boxes: dict[int, Array], rng: np.random.Generator) -> Changed:
        known, y, x = np.array(sorted(boxes)), *np.indices(frames.shape[1:])
        part = np.clip((np.arange(len(frames)) - known[0]) / np.ptp(known), 0.0, 1.0)
        fit = np.polyfit(part[known], np.array([boxes[k][:2] for k in known]), min(6, len(known) // 15))
        path = np.vander(part, len(fit)) @ fit
        out, placed, near = [], {}, np.ones(1)
        for k, frame in enumerate(frames):
            off = np.rint(path[known[0]] - path[k])
            M = np.column_stack([np.eye(2), off])
            moved = cv2.warpAffine(frame.astype(float), M, frame.shape[::-1], borderMode=cv2.BORDER_REFLECT_101)
            if k in boxes:
                placed[k] = boxes[k] + [*off, 0.0, 0.0]
                if hovers:
                    cx, cy, w, h = placed[k]
                    near = np.exp(-(((x - cx) / (0.9 * w)) ** 6) - ((y - cy) / (0.9 * h)) ** 6)
            out.append(near * moved + (1.0 - near) * frames[known[0]])
        return Changed(eight(out), placed)

    return change
