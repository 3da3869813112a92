"""A camera that sees one circular hot spot."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, fields
from vedette_flir.sensors.image_model import FittedImage, Picture
from vedette_flir.spots import circular, disc

WIDTHS = (0.4, 6.0, 0.5)
"""In px; a learnt spread stays between the first two, and changes by at most the third per frame."""


@final
@frozen(kw_only=True)
class GaussianSpot(FittedImage):
    """z_ij = background + amplitude * mean over pixel ij of e^(-r^2 / 2 spread^2) + noise.

    Amplitude, spread and background are axes of the state, which this sensor may learn: a gain is the part of a
    Gauss-Newton step of least squares, over what is learnt, that each frame takes.
    Maybeck, Mercier, A Target Tracker Using Spatially Distributed Infrared Measurements, IEEE T-AC 25, 1980.

    >>> from vedette import Frame
    >>> from vedette_flir.camera import Camera
    >>> spot = GaussianSpot(camera=Camera(2.0, window=16, saturation=58.0), gain_amplitude=0.25, gain_background=0.5)
    >>> x, fine = np.array([[107.6, 57.3, 40.0, 2.5, 10.0]]), (np.arange(320) + 0.5) / 20 - 0.5  # 20 points a pixel
    >>> def image(px, py):
    ...     across, down = (np.exp(-((fine - p) ** 2) / (2 * 2.5**2)).reshape(16, 20).mean(axis=1) for p in (px, py))
    ...     return 40.0 * np.outer(down, across)
    >>> z, used = 10.0 + image(7.9, 7.2), np.ones((16, 16), dtype=bool)
    >>> z[3, 4], z[8, 7], used[3, 4], used[8, 7] = np.nan, 58.0, False, False  # dead, saturated
    >>> J, g, llr = spot.information(x, Frame(z, np.array([100.0, 50.0])), x)
    >>> h, D = image(7.6, 7.3), [image(7.601, 7.3) - image(7.599, 7.3), image(7.6, 7.301) - image(7.6, 7.299)]
    >>> D, h, rest = np.array(D)[:, used] / 0.002, h[used], z[used] - 10.0
    >>> np.allclose(J[0], D @ D.T / 4, rtol=1e-3), np.allclose(g[0], D @ (rest - h) / 4, rtol=1e-3)
    (True, True)
    >>> np.allclose(llr[0], np.sum(h * (rest - h / 2)) / 4, rtol=1e-3)
    True
    >>> np.allclose(spot.noise(x), np.eye(2) * 2 * 4 / (np.pi * 40**2))
    True
    >>> brighter = Frame(14.0 + 50.0 / 40.0 * image(7.6, 7.3), np.array([100.0, 50.0]))  # a quarter of 10, half of 4
    >>> spot = GaussianSpot(camera=Camera(2.0, window=16), gain_amplitude=0.25, gain_background=0.5)
    >>> spot.learn(x, brighter).round(3).tolist()
    [[107.6, 57.3, 42.5, 2.5, 12.0]]
    """

    kind: ClassVar[str] = "gaussian_spot"

    gain_amplitude: float = fields.probability("part of a step that the amplitude takes each frame", default=0.0)
    gain_spread: float = fields.probability("part of a step that the spread takes each frame", default=0.0)
    gain_background: float = fields.probability("part of a step that the background takes each frame", default=0.0)

    def gains(self) -> Array:
        """Return the gains (3,)."""
        return np.array([self.gain_amplitude, self.gain_spread, self.gain_background])

    def bounds(self) -> Array:
        """Return the bounds (3, 3)."""
        free = (-np.inf, np.inf, np.inf)
        return np.array([free, WIDTHS, free])

    def noise(self, x: Array) -> Array:
        """Return R in px^2, (*b, n) -> (*b, 2, 2): that of one frame, from the information in the whole spot."""
        amplitude, spread, _ = self.looks(x)
        return self.camera.spot_variance(amplitude, np.clip(spread, *WIDTHS[:2]))[..., None, None] * np.eye(2)

    def image(self, looks: tuple[Array, ...], x: Array, y: Array) -> Array:
        """Return amplitude * spot."""
        return looks[0][..., None, None] * disc(x, y, looks[1])

    def picture(self, looks: tuple[Array, ...], x: Array, y: Array) -> Picture:
        """Return amplitude * spot."""
        amplitude, spread, _ = looks
        spot, slopes, wider = circular(x, y, spread)
        strength = amplitude[..., None, None]
        return Picture(
            strength * spot,
            strength[..., None] * slopes,
            np.stack([spot, strength * wider, np.ones_like(spot)], axis=-3),
        )
