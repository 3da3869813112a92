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
