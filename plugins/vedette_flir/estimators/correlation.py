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

    >>> from vedette import Frame, Gaussian
    >>> from vedette_flir.motion.constant_axes import Carrying
    >>> from vedette_flir.motion.image_velocity import ImageVelocity
    >>> from vedette_flir.sensors.box_centroid import BoxCentroid
    >>> motion, rng = Carrying(ImageVelocity(), {"width": "px", "height": "px"}), np.random.default_rng(1)
    >>> tracker = CorrelationFilter(motion, sigma=2.0, smoothing=0.25, limit=0.5, independent=12.0, cells=33)
    >>> scene = rng.normal(100.0, 5.0, (90, 100))
    >>> scene[40:51, 30:41] += rng.normal(0.0, 40.0, (11, 11))  # then it moves by 4 and -3, among noise
    >>> noisy, camera = np.roll(scene, (-3, 4), (0, 1)) + rng.normal(0.0, 20.0, (90, 100)), BoxCentroid()
    >>> prior = Gaussian(np.array([[35.0, 45.0, 0.0, 0.0, 11.0, 11.0]]), np.diag([12.0, 12.0, 9.0, 9.0, 0.0, 0.0])[None])
    >>> belief, sure = tracker.start(prior, tracker.state, None), np.eye(2)[1:]
    >>> belief = tracker.update(belief, tracker.evaluate(belief, camera, Frame(scene), 1.0), sure)  # 12, of 4: now 3
    >>> seen = tracker.evaluate(belief, camera, Frame(noisy), 1.0)
    >>> before, now = scene[40:51, 30:41], noisy[37:48, 34:45]
    >>> rho = np.corrcoef(before.ravel(), now.ravel())[0, 1]
    >>> np.allclose(seen.loglik[0, 1], 0.5 * 12.0 * np.log((1.0 - 0.5**2) / (1.0 - rho**2)), atol=1e-4)
    True
    >>> after = tracker.update(belief, seen, sure)
    >>> np.allclose(after.position.mean[0, :2], np.array([35.0, 45.0]) + 3.0 / 7.0 * np.array([4.0, -3.0]), atol=0.1)
    True
    >>> np.allclose(after.appearance.patch[0, 11:22, 11:22], 0.75 * before + 0.25 * now)  # a quarter of it is renewed
    True
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
