"""Scenes of recorded infrared clips without their target, and what a target of another clip flies before in them."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import cv2
import numpy as np
from attrs import define

from vedette import Array

ROOM = 60.0
"""Px, besides two sizes, by which a target goes past what stands in its way, at least."""


@define(eq=False)
class Draft:
    """Scenes (k, h, w) without a target, where their first pixel is in the first (k, 2); lights (k, h, w) and boxes of the
    target; the level before which it was, and its brightness over that, in count; in which frame it is back, 0 for none.
    """

    scenes: Array
    at: Array
    lights: Array
    boxes: dict[int, Array]
    level: float
    bright: float
    rng: np.random.Generator
    back: int = 0

    def way(self) -> tuple[Array, float]:
        """Return the middle of a target's way in the scene and its direction; one that hardly goes is sent to the middle."""
        known, size = np.array(sorted(self.boxes)), self.scenes.shape[:0:-1]
        first, last = (self.boxes[k][:2] + self.at[k] for k in known[[0, -1]])
        room = ROOM + 2.0 * float(self.boxes[known[0]][2:].max())
        if np.hypot(*(last - first)) < room:
            off = 0.5 * np.array(size) - self.boxes[known[-1]][:2]
            slip = room / len(self.scenes) * off / max(float(np.hypot(*off)), 1.0)
            for k in known:
                M = np.column_stack([np.eye(2), k * slip])
                self.lights[k] = np.maximum(cv2.warpAffine(self.lights[k], M, size, flags=cv2.INTER_CUBIC), 0.0)
                self.boxes[k] = self.boxes[k] + [*(k * slip), 0.0, 0.0]
        path = np.array([self.boxes[k][:2] for k in known]) + self.at[known]
        along = (path[-1] - path[0]) / max(float(np.hypot(*(path[-1] - path[0]))), 1.0)
        done = (path - path[0]) @ along
        return path[np.argmax(done > 0.5 * done[-1])], float(np.arctan2(along[1], along[0]))

    def seen(self) -> Iterator[tuple[Array, Array]]:
        """Yield how far each pixel (h, w) of each frame is from the middle of the target's way, along it and across."""
        middle, angle = self.way()
        y, x = np.indices(self.scenes.shape[1:]).astype(np.float32)
        c, s = np.cos(angle), np.sin(angle)
        for place in self.at:
            dx, dy = x + np.float32(place[0] - middle[0]), y + np.float32(place[1] - middle[1])
            yield c * dx + s * dy, c * dy - s * dx

    def before(self, what: Callable[[Array, Array], tuple[Array, Array]]) -> None:
        """Draw before the scenes what has, at px along and across a target's way from its middle, a level and a cover."""
        for k, (along, across) in enumerate(self.seen()):
            level, cover = what(along, across)
            self.scenes[k] += cover * (level - self.scenes[k])

    def drawn(self) -> Array:
        """Return the frames (k, h, w)."""
        for scene, light in zip(self.scenes, self.lights, strict=True):
            cover = np.minimum(light / max(0.4 * float(light.max()), 1.0), 1.0)
            scene += cover * (self.level + light - scene)
        return self.scenes


def _texture(rng: np.random.Generator, finest: float) -> Callable[[Array, Array], Array]:
    """Return a rough surface of mean 0 and variance 1 over two coordinates in px."""
    image = sum(s * cv2.GaussianBlur(rng.normal(size=(512, 512)), (0, 0), s * finest) for s in (1.0, 2.0, 4.0))
    image = ((image - image.mean()) / image.std()).astype(np.float32)

    def at(u: Array, v: Array) -> Array:
        x, y = ((each % 512.0).astype(np.float32) for each in (u, v))
        return np.asarray(cv2.remap(image, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP))

    return at


def _edge(inside: Array, soft: float) -> Array:
    """Return a cover from 0 to 1 across an edge `soft` px wide."""
    return np.asarray(1.0 / (1.0 + np.exp(-np.clip(4.0 * inside / soft, -50.0, 50.0))))


def trees(it: Draft) -> None:
    rough, crown, heat = _texture(it.rng, 1.5), _texture(it.rng, 4.0), it.rng.uniform(0.3, 1.0)
    it.before(lambda u, v: (it.level + it.bright * (heat + 0.3 * rough(u, v)), _edge(u + 8.0 * crown(0.0 * u, v), 2.0)))


def cloud(it: Draft) -> None:
    rough, size, heat = _texture(it.rng, 6.0), it.rng.uniform(15.0, 40.0), it.rng.uniform(0.3, 1.2)
    it.before(lambda u, v: (it.level + it.bright * heat, _edge(size - np.hypot(u, 0.6 * v) + 12.0 * rough(u, v), 20.0)))


def ground(it: Draft) -> None:
    rough, heat = _texture(it.rng, 3.0), it.rng.uniform(1.3, 1.8)
    it.before(lambda u, v: (it.level + it.bright * (heat + 0.1 * rough(u, v)), _edge(u + 2.0 * rough(0.0 * u, v), 2.0)))


def houses(it: Draft) -> None:
    pitch, heat = it.rng.uniform(8.0, 20.0, 2), it.rng.uniform(0.7, 1.3)

    def what(u: Array, v: Array) -> tuple[Array, Array]:
        lit = np.minimum(_edge(u % pitch[0] - 0.6 * pitch[0], 1.5), _edge(v % pitch[1] - 0.5 * pitch[1], 1.5))
        return it.level + it.bright * (0.2 + heat * lit), _edge(u, 1.5)

    it.before(what)


def hides(it: Draft) -> None:
    rough, known, before = _texture(it.rng, 1.5), sorted(it.boxes), it.seen()
    for k, (u, v) in enumerate(before):
        if k == 0:
            went = it.boxes[known[-1]][:2] + it.at[known[-1]] - it.boxes[known[0]][:2] - it.at[known[0]]
            half = 10.0 * float(np.hypot(*went)) / len(known) + 0.5 * float(it.boxes[known[0]][2:].max())
        cover, total = _edge(half - np.abs(u), 2.0), float(it.lights[k].sum())
        it.scenes[k] += cover * (it.level + it.bright * (0.6 + 0.2 * rough(u, v)) - it.scenes[k])
        it.lights[k] *= 1.0 - cover
        if k in it.boxes and it.lights[k].sum() < 0.4 * total:
            del it.boxes[k]
    gone = [k for k in known if k not in it.boxes]
    it.back = min((k for k in it.boxes if gone and k > gone[-1]), default=0)


def glare(it: Draft) -> None:
    off = it.rng.choice([-1.0, 1.0]) * it.rng.uniform(10.0, 25.0)
    for k, (u, v) in enumerate(it.seen()):
        far = np.hypot(u, v - off)
        light = 255.0 * _edge(8.0 - far, 2.0) + 120.0 * np.exp(-far / 15.0)
        it.scenes[k], it.lights[k] = it.scenes[k] + light, it.lights[k] + light * (it.lights[k] > 0)


def twin(it: Draft) -> None:
    turn, known = it.rng.uniform(0.0, 2.0 * np.pi), sorted(it.boxes)
    by = it.rng.uniform(0.5, 2.0) * np.array([np.cos(turn), np.sin(turn)])
    for k in known:
        M = np.column_stack([np.eye(2), (k - known[len(known) // 2]) * by])
        it.scenes[k] += cv2.warpAffine(it.lights[k], M, it.scenes.shape[:0:-1])


SCENERY: dict[str, Callable[[Draft], None]] = {
    each.__name__: each for each in (trees, cloud, ground, houses, hides, glare, twin)
}
