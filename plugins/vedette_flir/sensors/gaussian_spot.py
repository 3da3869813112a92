"""A camera that sees one circular hot spot."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Frame, fields
from vedette_flir.camera import Camera
from vedette_flir.sensors.apparent import ApparentPosition
from vedette_flir.spots import circular

WIDTHS = (0.4, 6.0)
"""px; a spread that is learnt stays between these."""


@final
@frozen(kw_only=True)
class GaussianSpot(ApparentPosition):
    """z_ij = background + amplitude * mean over pixel ij of e^(-r^2 / 2 spread^2) + noise.

    Amplitude, spread and background are axes of the state, which this sensor may learn: a gain is the part of a
    Gauss-Newton step of least squares, over what is learnt, that each frame takes.
    Maybeck, Mercier, A Target Tracker Using Spatially Distributed Infrared Measurements, IEEE T-AC 25, 1980.
    """

    kind: ClassVar[str] = "gaussian_spot"

    camera: Camera = fields.part("pixels and their noise", default=Camera())
    gain_amplitude: float = fields.probability("part of a step that the amplitude takes each frame", default=0.0)
    gain_spread: float = fields.probability("part of a step that the spread takes each frame", default=0.0)
    gain_background: float = fields.probability("part of a step that the background takes each frame", default=0.0)

    def noise(self, x: Array) -> Array:
        """(*b, n) -> (*b, 2, 2), in px^2: that of one frame, from the information in a whole spot"""
        amplitude, spread, _ = self.looks(x)
        variance = 2.0 / np.pi * self.camera.sigma**2 / np.maximum(amplitude**2, 1e-12) * np.ones_like(spread)
        return variance[..., None, None] * np.eye(2)

    def render(self, x: Array, shape: tuple[int, int]) -> Array:
        """What a frame of `shape` (height, width) shows without noise and background: (*b, n) -> (*b, h, w)"""
        amplitude, spread, _ = self.looks(x)
        spot = self.measure(x)
        size = max(shape)
        steps = np.arange(size)
        image, _, _ = circular(steps - spot[..., 0, None], steps - spot[..., 1, None], spread)
        return (amplitude[..., None, None] * image)[..., : shape[0], : shape[1]]

    def information(self, x: Array, frame: Frame, at: Array) -> tuple[Array, Array, Array]:
        """J (*b, t, 2, 2) in 1/px^2, g (*b, t, 2) in 1/px, llr (*b, t)"""
        amplitude, spread, background = self.looks(at)
        window = self.camera.cut(frame, self.measure(x))
        image, slopes, _ = circular(*window.offsets(self.measure(at)), spread)
        image, slopes = amplitude[..., None, None] * image, amplitude[..., None, None, None] * slopes
        return self.camera.information(window, image, slopes, background)

    def learn(self, x: Array, frame: Frame) -> Array:
        """Amplitude, spread and background a part of the way to what fits the frame best; (*b, t, n) -> (*b, t, n)"""
        gains = np.array([self.gain_amplitude, self.gain_spread, self.gain_background])
        if not gains.any():
            return x
        amplitude, spread, background = self.looks(x)
        window = self.camera.cut(frame, self.measure(x))
        image, _, wider = circular(*window.offsets(self.measure(x)), spread)
        fit = amplitude[..., None, None] * image + background[..., None, None]
        rest = np.where(window.seen, window.values - fit, 0.0)
        basis = (
            np.stack([image, amplitude[..., None, None] * wider, np.ones_like(image)], axis=-3)
            * window.seen[..., None, :, :]
        )
        basis = (basis * (gains > 0)[:, None, None]).reshape(*image.shape[:-2], 3, -1)
        normal = basis @ np.swapaxes(basis, -1, -2)
        ridge = 1e-9 * (1.0 + np.trace(normal, axis1=-2, axis2=-1))[..., None, None] * np.eye(3)
        score = basis @ rest.reshape(*rest.shape[:-2], -1, 1)
        step = gains * np.linalg.solve(normal + ridge, score)[..., 0]
        step[..., 1] = np.clip(step[..., 1], -0.5, 0.5)
        learnt = x.copy()
        learnt[..., -3:] += step
        learnt[..., -2] = np.clip(learnt[..., -2], *WIDTHS)
        return learnt
