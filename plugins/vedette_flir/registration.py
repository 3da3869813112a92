"""How a camera has turned, from frame to frame, so that positions stay where they are in the scene."""

from __future__ import annotations

from typing import Any, final

import numpy as np
from attrs import define, field
from numpy.typing import NDArray

from vedette import Array
from vedette_flir.sources.images import opencv

REACH = 0.25
"""Largest shift that is believed, as a part of each side: beyond it two frames have too little in common."""

LIKE = 0.35
"""Least height of the correlation's peak, of 1, at which two frames show one scene. Chosen on `ir_clips` and the odd
clips of `ir_clips_more`: their frames have .61 to 1 in the median, and cuts at most .30.
"""

NEAR = 0.5
"""Part of REACH up to which a shift is measured against the same frame, so that the errors of slow turns do not add up."""

BLUR = 1.5
"""Pixels over which frames are smoothed before their slopes are taken: noise in a slope makes shifts too small."""


@final
@define
class Registration:
    """Where the first pixel of each frame lies, in px of the first frame: `take` frame after frame.

    A frame is compared with one before it: to the pixel by the phase of their spectra, then by least squares, along the
    slopes of the picture. Where the two show nothing in common, as over plain sky or after a cut, the camera counts as
    standing still. Kuglin, Hines, The phase correlation image alignment method, IEEE Conf. on Cybernetics and Society, 1975;
    Lucas, Kanade, An iterative image registration technique, IJCAI 1981.
    """

    _corner: Array = field(factory=lambda: np.zeros(2))
    _past: NDArray[np.float32] | None = None
    _at: Array = field(factory=lambda: np.zeros(2))
    _window: Any = None

    def take(self, pixels: NDArray[Any]) -> Array:
        """Return the place of the first pixel (2,) of the next frame (h, w), x and y in px."""
        cv2, now = opencv(), pixels.astype(np.float32)
        if not np.isfinite(now).all():  # a frame that could not be read
            return self._corner
        low, high = (np.float32(part) for part in np.percentile(now[::4, ::4], (25, 75)))
        now = np.clip(now, 2.0 * low - high, 2.0 * high - low)  # what is hot moves by itself
        if self._past is None:
            self._past, self._window = now, cv2.createHanningWindow(now.shape[::-1], cv2.CV_32F)
            return self._corner
        moved, like = cv2.phaseCorrelate(self._past.copy(), now.copy(), self._window)  # it windows its arguments in place
        part = np.max(np.abs(moved) / np.array(now.shape[::-1]))
        same = like >= LIKE and part <= REACH
        if same:
            self._corner = self._at - refined(self._past, now, np.rint(moved).astype(int))
        if not same or part > NEAR * REACH:
            self._past, self._at = now, self._corner
        return self._corner


def refined(past: NDArray[np.float32], now: NDArray[np.float32], whole: NDArray[np.int_]) -> Array:
    """Return by how much a picture has moved, given that to the pixel: (h, w), (h, w), (2,) -> (2,).

    now(x + whole) = past(x - d) = past(x) - d . slope(x): d by least squares over what both frames show.
    """
    height, width = past.shape
    x, y = (int(part) for part in whole)
    before = past[max(0, -y) : height - max(0, y), max(0, -x) : width - max(0, x)]
    after = now[max(0, y) : height - max(0, -y), max(0, x) : width - max(0, -x)]
    cv2 = opencv()
    before, after = (cv2.GaussianBlur(np.ascontiguousarray(part), (0, 0), BLUR) for part in (before, after))
    middle = 0.5 * (before + after)
    slopes = [cv2.Sobel(middle, cv2.CV_32F, *axis, ksize=3, scale=0.125).ravel() for axis in ((1, 0), (0, 1))]
    slope = np.stack(slopes)
    d, *_ = np.linalg.lstsq(slope @ slope.T, -slope @ (after - before).ravel(), rcond=1e-6)
    return np.asarray(whole + np.clip(d, -1.0, 1.0), dtype=float)
