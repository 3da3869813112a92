"""How a camera has turned, from frame to frame, so that positions stay where they are in the scene."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, final

import numpy as np
from attrs import define, field
from numpy.typing import NDArray

from vedette import Array
from vedette_flir.sources.images import one_thread, opencv

REACH = 0.25
"""Largest shift that is believed, as a part of each side: beyond it two frames have too little in common."""

NEAR = 0.5
"""Part of REACH up to which a shift is measured against the same frame, so that the errors of slow turns do not add up."""

BLUR = 1.5
"""Pixels over which frames are smoothed: noise makes shifts too small, and a camera's fixed pattern none."""

BLOCKS, STRONG = 8, 0.05
"""Blocks along each side, one corner of each is followed; how strong it is at least, over the eighth strongest."""

AGREE, UNEVEN, FEWEST, SHARE, SPREAD = 1.0, 0.1, 5, 0.3, 0.4
"""Pixels within which corners agree, and the part of their shift, which roll and zoom make uneven; how many must, and which
share of all; the part of a side over which they are spread, so that they are no target's. By hand.
"""

FLOW: Any = {"winSize": (21, 21), "maxLevel": 2, "flags": 4, "criteria": (3, 10, 0.03)}
"""Window, levels, that a first guess is used, and when to stop: OpenCV's."""


@final
@define
class Registration:
    """Where the first pixel of each frame lies, in px of the first frame: `take` frame after frame.

    Corners spread over a frame before it, one of each block, are found again (Lucas, Kanade, An iterative image registration
    technique, IJCAI 1981; Shi, Tomasi, Good features to track, CVPR 1994); the camera has turned as most of them say that
    agree, so that a target is outvoted. Where too few agree, as over plain sky or after a cut, the camera counts
    as standing still. `agreed`: the share of corners that did, last time; where they are noise's, few do.
    """

    agreed: float = 0.0
    _corner: Array = field(factory=lambda: np.zeros(2))
    _past: NDArray[np.uint8] | None = None
    _points: NDArray[np.float32] = field(factory=lambda: np.zeros((0, 2), np.float32))
    _at: Array = field(factory=lambda: np.zeros(2))

    def take(self, pixels: NDArray[Any]) -> Array:
        """Return the place of the first pixel (2,) of the next frame (h, w), x and y in px."""
        if not np.isfinite(pixels).all():  # a frame that could not be read
            return self._corner
        with one_thread():
            now = _smooth(pixels)
            moved = None if self._past is None else self._moved(self._past, now)
            if moved is not None:
                self._corner = self._at - moved
            if moved is None or np.max(np.abs(moved) / np.array(now.shape[::-1])) > NEAR * REACH:
                self._past, self._points, self._at = now, corners(now), self._corner
        return self._corner

    def _moved(self, past: NDArray[np.uint8], now: NDArray[np.uint8]) -> Array | None:
        """Return by how much the picture has moved (2,) since the frame before; None if too few corners agree."""
        self.agreed = 0.0
        if len(self._points) < FEWEST:
            return None
        guess = self._points + (self._at - self._corner).astype(np.float32)
        cv2 = opencv()
        found, good, _ = cv2.calcOpticalFlowPyrLK(past, now, self._points, guess, **FLOW)
        shifts = (found - self._points)[good.ravel() > 0].astype(float)
        points = self._points[good.ravel() > 0]
        if len(shifts) < FEWEST:
            return None
        near = np.max(np.abs(shifts[:, None] - shifts), axis=-1) < AGREE + UNEVEN * np.max(np.abs(shifts), axis=1)[:, None]
        agree = near[np.argmax(near.sum(axis=1))]
        self.agreed = float(agree.sum() / len(self._points))
        part = np.ptp(points[agree], axis=0) / np.array(now.shape[::-1])
        moved = refined(past, now, points[agree], np.rint(np.median(shifts[agree], axis=0)).astype(int))
        enough = agree.sum() >= FEWEST and self.agreed >= SHARE and part.max() >= SPREAD
        return moved if enough and np.max(np.abs(moved) / np.array(now.shape[::-1])) <= REACH else None


def refined(past: NDArray[np.uint8], now: NDArray[np.uint8], points: NDArray[np.float32], whole: NDArray[np.int_]) -> Array:
    """Return by how much a picture has moved (2,) around `points` (k, 2), given that to a pixel or so.

    now(x + whole) = past(x - d) = past(x) - d . slope(x): d by least squares over squares around the points that both show.
    """
    side = max(min(past.shape) // (2 * BLOCKS), 3)
    high = np.array(past.shape[::-1]) - side - 2
    middle = np.clip(points.astype(int), side + 1, high)
    middle = middle[np.all((middle + whole > side) & (middle + whole <= high), axis=1)]
    if not len(middle):
        return whole.astype(float)
    along = np.arange(-side, side + 1, 2)  # as smoothed, every second pixel says it all
    rows, columns = middle[:, 1, None, None] + along[:, None], middle[:, 0, None, None] + along
    after = now[rows + whole[1], columns + whole[0]].astype(np.float32)
    slope = np.zeros((2, after.size), np.float32)
    for axis, (y, x) in enumerate(((0, 1), (1, 0))):
        for image, (down, right) in ((past, (0, 0)), (now, whole[::-1])):
            step = image[rows + down + y, columns + right + x].astype(np.float32)
            slope[axis] += 0.25 * (step - image[rows + down - y, columns + right - x]).ravel()
    change = after - past[rows, columns]
    change, slope = change - change.mean(axis=(1, 2), keepdims=True), slope.reshape(2, *change.shape)
    slope = (slope - slope.mean(axis=(2, 3), keepdims=True)).reshape(2, -1)  # a camera's level changes as a slope would
    d, *_ = np.linalg.lstsq(slope @ slope.T, -slope @ change.ravel(), rcond=1e-6)
    return np.asarray(whole + np.clip(d, -1.5, 1.5), dtype=float)


def corners(image: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return the strongest corner of each block of an image (h, w), if it is strong: (k, 2), x and y in px."""
    cv2 = opencv()
    strength = cv2.cornerMinEigenVal(image, 7)
    rows, columns = (np.linspace(0, side, BLOCKS + 1).astype(int) for side in image.shape)
    found = []
    for top, bottom in pairwise(rows):
        for left, right in pairwise(columns):
            j, i = np.unravel_index(np.argmax(strength[top:bottom, left:right]), (bottom - top, right - left))
            found.append((left + i, top + j, strength[top + j, left + i]))
    table = np.array(found, dtype=np.float32)
    least = STRONG * np.sort(table[:, 2])[-8]
    return table[(table[:, 2] > least) & (table[:, 2] > 0), :2]


def _smooth(pixels: NDArray[Any]) -> NDArray[np.uint8]:
    """Return a frame (h, w) smoothed, and stretched to 8 bits."""
    image = opencv().GaussianBlur(pixels.astype(np.float32), (0, 0), BLUR)
    low, high = np.percentile(image[::4, ::4], (1, 99))  # smoothed: by noise a slope's level would move as a camera turns
    return np.asarray(np.clip((image - low) * (255.0 / max(high - low, 1e-9)), 0.0, 255.0).astype(np.uint8))
