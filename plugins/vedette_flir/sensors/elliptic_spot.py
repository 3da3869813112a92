"""A camera that sees one elongated hot spot."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, fields
from vedette_flir.sensors.gaussian_spot import WIDTHS
from vedette_flir.sensors.image_model import FittedImage, Picture
from vedette_flir.spots import bivariate, elliptic, oval

CORRELATIONS = (-0.9, 0.9, 0.1)
"""A learnt correlation stays between the first two, and changes by at most the third per frame."""


@final
@frozen(kw_only=True)
class EllipticSpot(FittedImage):
    """z_ij = background + amplitude * mean over pixel ij of e^(-Z/2) + noise, Z = (u^2 - 2 r u v + v^2) / (1 - r^2).

    u = dx / spread_x, v = dy / spread_y, r = correlation: an ellipse at any angle. The paper prints (1 - r)^2, with which a
    mirrored target would have other widths. Amplitude, spreads, correlation and background are axes of the state,
    which this sensor may learn, as the circular spot does.
    Maybeck, Rogers, Adaptive Tracking of Multiple Hot-Spot Target IR Images, IEEE T-AC 28, 1983.

    >>> from vedette import Frame
    >>> from vedette_flir.camera import Camera
    >>> spot = EllipticSpot(camera=Camera(2.0, window=16, correlated=0.4, length=3.0), gain_shape=0.5)
    >>> x, fine = np.array([[7.6, 7.3, 40.0, 2.5, 1.6, 0.4, 10.0]]), (np.arange(320) + 0.5) / 20 - 0.5  # 20 points a pixel
    >>> def image(px, py, sx=2.5, sy=1.6, r=0.4):
    ...     u, v = (fine - px) / sx, ((fine - py) / sy)[:, None]
    ...     Z = (u**2 - 2 * r * u * v + v**2) / (1 - r**2)
    ...     return 40.0 * np.exp(-Z / 2).reshape(16, 20, 16, 20).mean(axis=(1, 3)).ravel()
    >>> z, h = 10.0 + image(7.9, 7.2), image(7.6, 7.3)
    >>> J, g, llr = spot.information(x, Frame(z.reshape(16, 16)), x)
    >>> D = np.array([image(7.601, 7.3) - image(7.599, 7.3), image(7.6, 7.301) - image(7.6, 7.299)]) / 0.002
    >>> row, column = np.divmod(np.arange(256), 16)
    >>> apart = np.hypot(row[:, None] - row, column[:, None] - column)
    >>> R = 4.0 * (0.6 * np.eye(256) + 0.4 * np.exp(-apart / 3.0))
    >>> np.allclose(J[0], D @ np.linalg.solve(R, D.T), rtol=1e-3)
    True
    >>> np.allclose(g[0], D @ np.linalg.solve(R, z - 10 - h), rtol=1e-3)
    True
    >>> np.allclose(llr[0], h @ np.linalg.solve(R, z - 10 - h / 2), rtol=1e-3)
    True
    >>> C = np.array([[2.5**2, 0.4 * 2.5 * 1.6], [0.4 * 2.5 * 1.6, 1.6**2]])
    >>> area = np.sqrt(np.linalg.det(C))
    >>> density = 0.6 + 0.4 * 2 * np.pi * 9 / (1 + 2 * 9 / area) ** 1.5
    >>> np.allclose(spot.noise(x), 2 * 4 * density / (np.pi * 40**2) / area * C)
    True
    >>> wider = image(7.6, 7.3, 2.54, 1.6 - 0.02, 0.42)  # half of these changes is learnt
    >>> spot.learn(x, Frame(10.0 + wider.reshape(16, 16))).round(3).tolist()
    [[7.6, 7.3, 40.0, 2.52, 1.59, 0.41, 10.0]]
    """

    kind: ClassVar[str] = "elliptic_spot"

    gain_amplitude: float = fields.probability("part of a step that the amplitude takes each frame", default=0.0)
    gain_shape: float = fields.probability("part of a step that spreads and correlation take each frame", default=0.0)
    gain_background: float = fields.probability("part of a step that the background takes each frame", default=0.0)

    def appearance(self) -> dict[str, str]:
        """Return the axes of amplitude, ellipse and background."""
        return {"amplitude": "count", "spread_x": "px", "spread_y": "px", "correlation": "1", "background": "count"}

    def gains(self) -> Array:
        """Return the gains (5,)."""
        return np.array([self.gain_amplitude, *[self.gain_shape] * 3, self.gain_background])

    def bounds(self) -> Array:
        """Return the bounds (5, 3)."""
        free = (-np.inf, np.inf, np.inf)
        return np.array([free, WIDTHS, WIDTHS, CORRELATIONS, free])

    def noise(self, x: Array) -> Array:
        """Return R in px^2, (*b, n) -> (*b, 2, 2): that of a round spot of spread |C|^(1/4), times C / sqrt|C|."""
        amplitude, across, down, correlation, _ = self.looks(x)
        C = bivariate(np.clip(across, *WIDTHS[:2]), np.clip(down, *WIDTHS[:2]), np.clip(correlation, *CORRELATIONS[:2]))
        area = np.sqrt(np.linalg.det(C))
        R: Array = (self.camera.spot_variance(amplitude, np.sqrt(area)) / area)[..., None, None] * C
        return R

    def image(self, looks: tuple[Array, ...], x: Array, y: Array) -> Array:
        """Return amplitude * spot."""
        return np.asarray(looks[0][..., None, None] * oval(x, y, bivariate(*looks[1:4])))

    def picture(self, looks: tuple[Array, ...], x: Array, y: Array) -> Picture:
        """Return amplitude * spot."""
        amplitude, sx, sy, r, _ = (look[..., None, None] for look in looks)
        spot, slopes, bends = elliptic(x, y, bivariate(*looks[1:4]))
        xx, xy, yy = (bends[..., k, :, :] for k in range(3))
        basis = [
            spot,
            amplitude * (sx * xx + r * sy * xy),
            amplitude * (sy * yy + r * sx * xy),
            amplitude * sx * sy * xy,
            np.ones_like(spot),
        ]
        return Picture(amplitude * spot, amplitude[..., None] * slopes, np.stack(basis, axis=-3))
