"""A camera that sees a target in a box, and measures the centroid of what stands out there."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Frame, Mask, fields
from vedette_flir.camera import cut
from vedette_flir.sensors.apparent_position import ApparentPosition


@final
@frozen(kw_only=True)
class BoxCentroid(ApparentPosition):
    """The centroid tracker, over the pixels that differ from the border's median by over half the largest difference.

    J = I / sigma^2, g = J (centroid - at). With contrast c and border spread s, the ratio to the background is
    llr = (c / s)^2 / 2 - 8, which is 0 at 4 standard deviations, less the centroid's own (centroid - at)^2 / (2 sigma^2).
    Blackman, Popoli, Design and Analysis of Modern Tracking Systems, 1999, section 10.

    >>> pixels = np.full((20, 24), 100.0)
    >>> pixels[8, 10:12] = 140.0, 130.0
    >>> box, camera = np.array([[10.0, 8.5, 6.0, 5.0]]), BoxCentroid(sigma=2.0, least=8.0)
    >>> off = np.array([30.0 / 70.0, -0.5])
    >>> for frame in (Frame(pixels), Frame(200.0 - pixels)):
    ...     J, g, llr = camera.information(box, frame, box)
    ...     np.allclose(J[0], np.eye(2) / 4), np.allclose(g[0], off / 4), np.allclose(llr[0], 4.5 - off @ off / 8)
    (True, True, True)
    (True, True, True)
    """

    kind: ClassVar[str] = "box_centroid"

    sigma: float = fields.quantity("px", "standard deviation of a centroid", default=1.0, above=0)
    margin: float = fields.quantity("1", "side of the window over that of the box", default=1.3, at_least=1)
    least: float = fields.quantity("count", "spread of the border's pixels, at least", default=1.0, above=0)

    def appearance(self) -> dict[str, str]:
        """Return the axes of the box."""
        return {"width": "px", "height": "px"}

    def noise(self, x: Array) -> Array:
        """Return R (2, 2)."""
        return self.sigma**2 * np.eye(2)

    def information(self, x: Array, frame: Frame, at: Array) -> tuple[Array, Array, Array]:
        """Return J (*b, t, 2, 2) in 1/px^2, g (*b, t, 2) in 1/px, llr (*b, t)."""
        width, height = self.looks(x)
        size = max(5, int(np.ceil(self.margin * max(np.max(width, initial=1.0), np.max(height, initial=1.0)))) + 4)
        spot = self.measure(x)
        window = cut(frame, spot, size)
        dx, dy = window.offsets(spot)
        half = 0.5 * self.margin * np.stack([width, height])[..., None]
        excess = np.maximum((np.abs(dx) - half[0])[..., None, :], (np.abs(dy) - half[1])[..., :, None])
        inside, core = window.seen & (excess <= 0), excess <= -2
        border = np.where(inside & ~core, window.values, np.nan).reshape(*width.shape, -1)
        some: Mask = np.any(np.isfinite(border), axis=-1)
        border = np.where(some[..., None], border, 0.0)
        level = np.nanmedian(border, axis=-1)
        spread = np.maximum(1.48 * np.nanmedian(np.abs(border - level[..., None]), axis=-1), self.least)
        apart = np.where(inside, np.abs(window.values - level[..., None, None]), 0.0)
        most = np.max(apart, axis=(-1, -2))
        weight = np.where(apart > 0.5 * most[..., None, None], apart, 0.0)
        total = np.sum(weight, axis=(-1, -2))
        sure = some & (total > 0)
        share = weight / np.where(sure, total, 1.0)[..., None, None]
        off = np.stack(
            [np.sum(share * dx[..., None, :], axis=(-1, -2)), np.sum(share * dy[..., :, None], axis=(-1, -2))], axis=-1
        )
        J = np.where(sure, 1.0, 0.0)[..., None, None] * np.eye(2) / self.sigma**2
        g = np.where(sure[..., None], (spot + off - self.measure(at)) / self.sigma**2, 0.0)
        llr = np.where(
            sure, np.minimum(0.5 * (most / spread) ** 2 - 8.0, 50.0) - 0.5 * np.sum(g * g, axis=-1) * self.sigma**2, 0.0
        )
        return J, g, llr
