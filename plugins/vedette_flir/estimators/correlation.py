"""The correlation tracker, for comparison."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, fields
from vedette_flir.estimators.appearance import AppearanceFilter
from vedette_flir.estimators.matches import MOST, Appearance, Match, match_ratio
from vedette_flir.patches import peak, sample
from vedette_flir.sources.images import opencv


@frozen(eq=False)
class BoxPatch(Appearance):
    """The template cut from the box: patch (*b, t, p, p) in count, and how many columns and rows it covers (*b, t, 2)."""

    patch: Array
    size: Array


@final
@frozen
class CorrelationFilter(AppearanceFilter[BoxPatch]):
    """OpenCV's matchTemplate (TM_CCOEFF_NORMED) of the whole box, and a Kalman filter behind it: a baseline.

    The template is the first frame's box. Each frame replaces a part of it: 0 keeps the first, 1 takes the last frame. The
    search reaches 3.5 standard deviations and 2 px; the log-likelihood ratio is that of the template filter.
    Lewis, Fast Normalized Cross-Correlation, Vision Interface, 1995.
    """

    kind: ClassVar[str] = "correlation_filter"

    smoothing: float = fields.probability("part of the template that each frame renews", default=0.0)
    limit: float = fields.probability("correlation below which a match is none", default=0.35, above=0, below=1)
    independent: float = fields.quantity("1", "independent pixels of a template", default=20.0, above=0)
    cells: int = fields.integer("side of the grid; a larger box is taken coarser", default=96, at_least=8, at_most=256)
    search: int = fields.integer("cells searched to each side, at most", default=40, at_least=3, at_most=128)

    def unseen(self, tracks: tuple[int, ...]) -> BoxPatch:
        """Return no template."""
        return BoxPatch(np.zeros(tracks), np.zeros((*tracks, self.cells, self.cells)), np.ones((*tracks, 2)))

    def first(self, pixels: Array, where: Array, box: Array) -> Match[BoxPatch]:
        """Cut the box as the template."""
        step = self._step(box)
        size = np.clip(np.rint(box / step), 3, self.cells)
        return Match(np.zeros(2), MOST, BoxPatch(np.ones(()), sample(pixels, where, step, self.cells), size))

    def find(
        self, pixels: Array, where: Array, box: Array, S: Array, existence: float, appearance: BoxPatch, past: Array
    ) -> Match[BoxPatch]:
        """Find the best correlation, its peak refined by a parabola."""
        cv2, step, p = opencv(), self._step(box), self.cells
        centre = np.clip(where, 0.0, np.array(pixels.shape[::-1]) - 1.0)
        reach = int(np.clip(np.ceil((3.5 * np.sqrt(np.max(np.diagonal(S))) + 2.0) / step), 3, self.search))
        image = sample(pixels, centre, step, p + 2 * reach)
        (left, width), (top, height) = (((p - int(n)) // 2, int(n)) for n in appearance.size)
        patch = appearance.patch[top : top + height, left : left + width]
        part = image[top : top + height + 2 * reach, left : left + width + 2 * reach]
        rho = cv2.matchTemplate(part.astype(np.float32), patch.astype(np.float32), cv2.TM_CCOEFF_NORMED)
        # A template or place without contrast has no correlation; OpenCV returns 1 there, or NaN.
        rho = np.where(np.isfinite(rho) & (np.abs(rho) <= 1.001), rho, 0.0) * float(np.ptp(patch) > 0)
        j, i, fine = peak(rho)
        match = max(float(rho[j, i]), 0.0) if np.ptp(part[j : j + height, i : i + width]) > 0 else 0.0
        renewed = appearance.patch + self.smoothing * (image[j : j + p, i : i + p] - appearance.patch)
        ratio = match_ratio(match, self.limit, self.independent)
        return Match(
            centre + step * (np.array([i, j]) - reach + fine) - where,
            ratio,
            BoxPatch(appearance.known, renewed, appearance.size),
        )

    def _step(self, box: Array) -> float:
        """Return the size of a cell in px."""
        return max(1.0, float(np.max(box)) / self.cells)
