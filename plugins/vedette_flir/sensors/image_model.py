"""The common part of cameras with a model of the target's image: the information pair, and learning its appearance."""

from __future__ import annotations

from abc import abstractmethod

import numpy as np
from attrs import frozen

from vedette import Array, Frame, fields
from vedette_flir.camera import Camera
from vedette_flir.sensors.apparent_position import ApparentPosition


@frozen(eq=False)
class Picture:
    """A target without its background: image (*b, w, w), its derivatives to where it appears (*b, 2, w, w) and, above the
    background, to each of its looks, the background last (*b, q, w, w).
    """

    image: Array
    slopes: Array
    looks: Array


@frozen(kw_only=True)
class FittedImage(ApparentPosition):
    """A camera that expects h = background + picture. The background is the last axis of the appearance."""

    camera: Camera = fields.part("pixels and their noise", default=Camera())

    @abstractmethod
    def picture(self, looks: tuple[Array, ...], x: Array, y: Array) -> Picture:
        """Return the target with `looks` (*b) each, in pixels with columns and rows at x, y (*b, w) from its position."""

    def image(self, looks: tuple[Array, ...], x: Array, y: Array) -> Array:
        """Return the image of `picture` alone; a sensor may have a shorter way to it."""
        return self.picture(looks, x, y).image

    @abstractmethod
    def gains(self) -> Array:
        """Return the fraction of a step that each axis of the appearance takes, (q,)."""

    def bounds(self) -> Array:
        """Return least and greatest value of each axis of the appearance, and its greatest step in a frame, (q, 3)."""
        return np.array([[-np.inf, np.inf, np.inf]] * len(self.appearance()))

    def render(self, x: Array, shape: tuple[int, int]) -> Array:
        """Return a frame of `shape` (height, width) without noise and background: (*b, n) -> (*b, h, w)."""
        spot, steps = self.measure(x), np.arange(max(shape))
        image = self.image(self.looks(x), steps - spot[..., 0, None], steps - spot[..., 1, None])
        return image[..., : shape[0], : shape[1]]

    def draw_frame(self, x: Array, shape: tuple[int, int], rng: np.random.Generator) -> Array:
        """Return frames of `shape` with background and noise: (*b, n) -> (*b, h, w)."""
        level = self.looks(x)[-1][..., None, None]
        return self.render(x, shape) + level + self.camera.draw_noise((*x.shape[:-1], *shape), rng)

    def information(self, x: Array, frame: Frame, at: Array) -> tuple[Array, Array, Array]:
        """Return J (*b, t, 2, 2) in 1/px^2, g (*b, t, 2) in 1/px, llr (*b, t)."""
        window = self.camera.cut(frame, self.measure(x))
        made = self.picture(self.looks(at), *window.offsets(self.measure(at)))
        return self.camera.information(window, made.image, made.slopes, self.looks(at)[-1])

    def learn(self, x: Array, frame: Frame) -> Array:
        """Move the appearance part of the way to the best fit to the frame: (*b, t, n) -> (*b, t, n).

        A Gauss-Newton step of least squares over the axes with a gain, clipped to their bounds.
        """
        gains = self.gains()
        if not gains.any():
            return x
        window = self.camera.cut(frame, self.measure(x))
        made = self.picture(self.looks(x), *window.offsets(self.measure(x)))
        rest = np.where(window.seen, window.values - made.image - self.looks(x)[-1][..., None, None], 0.0)
        basis = made.looks * window.seen[..., None, :, :] * (gains > 0)[:, None, None]
        basis = basis.reshape(*basis.shape[:-2], -1)
        normal = basis @ np.swapaxes(basis, -1, -2)
        ridge = 1e-9 * (1.0 + np.trace(normal, axis1=-2, axis2=-1))[..., None, None] * np.eye(len(gains))
        score = basis @ rest.reshape(*rest.shape[:-2], -1, 1)
        low, high, most = self.bounds().T
        step = np.clip(gains * np.linalg.solve(normal + ridge, score)[..., 0], -most, most)
        learnt, before = x.copy(), x[..., -len(gains) :]
        learnt[..., -len(gains) :] = np.where(gains > 0, np.clip(before + step, low, high), before)
        return learnt
