"""How a camera has turned, from frame to frame, so that positions stay where they are in the scene."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, final

import numpy as np
from attrs import define, field
from numpy.typing import NDArray

from vedette import Array, Mask
from vedette_flir.patches import bend
from vedette_flir.sources.images import one_thread, opencv

REACH = 0.25
"""Largest shift of an edge of the frame that is believed, as a part of each side: beyond it two frames have too little in
common.
"""

NEAR = 0.5
"""Part of REACH up to which a turn is measured against the same frame, so that the errors of slow turns do not add up."""

BLUR = 1.5
"""Pixels over which frames are smoothed: noise makes shifts too small, and a camera's fixed pattern none."""

BLOCKS, STRONG = 8, 0.05
"""Blocks along each side, one corner of each is followed; how strong it is at least, over the eighth strongest."""

AGREE, UNEVEN, MORE, FEWEST, SHARE, SPREAD = 1.0, 0.1, 1.2, 5, 0.3, 0.52
"""Pixels within which corners agree, and the part of their shift, as what is near shifts more; how many times as many must
agree on a roll or a zoom as on a shift: else errors would roll the camera, little by little; how many must at least, and
which share of all; the part of a side over which they are spread, so that they are no target's. By hand.
"""

STANDS, TURNS, UNLIKE, CLEAR = 0.5, 2.0, 3.0, 9.0
"""Pixels by which a corner moves at most that stands in the frame; by how many a scene must turn for pixels to tell; by
how much a pixel must be more like one of the two, over the mean by which they are unlike the better one, to vote, and to
count as written. By hand.
"""

HALO, WINDOW, OWN = 10, 21, 0.6
"""Pixels around what is written in which no corner is followed: half of its window; its side in px; the standard deviation
in px of where a corner is found again, by the frame's noise, up to which it counts: along a slope nothing tells.
"""

FLOW: Any = {"winSize": (WINDOW, WINDOW), "maxLevel": 2, "flags": 4, "criteria": (3, 10, 0.03)}
"""Window, levels, that a first guess is used, and when to stop: OpenCV's."""


@final
@define
class Registration:
    """Where the first pixel of each frame lies, in px of the first frame: `take` frame after frame.

    Corners spread over a frame before it, one of each block, are found again (Lucas, Kanade, An iterative image registration
    technique, IJCAI 1981; Shi, Tomasi, Good features to track, CVPR 1994); the camera has turned as most of them say that
    agree, so that a target is outvoted: on a shift or, where far more do, on a roll and zoom, too (RANSAC: Fischler, Bolles,
    CACM 24, 1981). These leave the frame's middle where it is, whose place counts. What is written into the frames, text or
    a cross-hair, stands in them however the camera turns: where corners stand and others agree on a turn, faint ones too,
    pixels tell which is the scene (`written`). Where too few agree, as over plain sky or after a cut, the camera counts as
    standing still. `agreed`: the share of corners that did, last time; where they are a codec's, few do.
    """

    agreed: float = 0.0
    _past: NDArray[np.uint8] | None = None
    _levels: tuple[float, float] = (0.0, 1.0)
    _points: NDArray[np.float32] = field(factory=lambda: np.zeros((0, 2), np.float32))
    _at: Array = field(factory=lambda: np.eye(3))  # from pixels of the frame that is followed to those of the first
    _turn: Array = field(factory=lambda: np.eye(3))  # from pixels of the frame that is followed to those of the last
    _strong: int = 0
    _text: Mask = field(factory=lambda: np.zeros((1, 1), dtype=bool))
    _written: Mask = field(factory=lambda: np.zeros((1, 1), dtype=bool))

    def take(self, pixels: NDArray[Any]) -> Array:
        """Return the place of the first pixel (2,) of the next frame (h, w), x and y in px."""
        middle = 0.5 * (np.array(pixels.shape[::-1]) - 1.0)
        if np.isfinite(pixels).all():  # else it could not be read
            with one_thread():
                self._register(pixels.astype(np.float32))
        return np.asarray(applied(self._at @ np.linalg.inv(self._turn), middle) - middle)

    def _register(self, grey: NDArray[np.float32]) -> None:
        image = opencv().GaussianBlur(grey, (0, 0), BLUR)
        if self._past is not None and self._past.shape != image.shape:
            raise ValueError(f"frame: {image.shape} px, but the frames before have {self._past.shape}")
        turn = self._turned(image)
        if turn is not None:
            self._turn = turn
        if turn is None or shift(turn, image.shape) > NEAR * REACH:
            if turn is not None and self._past is not None and self._text.any():
                self._text &= ~written(self._past, self._shown(image), turn)[1]
                self._written = around(self._text)
            self._follow(image, bend(grey) / 6.0)

    def _follow(self, image: NDArray[np.float32], noise: float) -> None:
        """Follow the corners of a frame, the last, from now on."""
        low, high = np.percentile(image[::4, ::4], (1, 99))  # smoothed: by noise a slope's level would move
        self._levels = float(low), max(float(high - low), 1e-9)
        self._past, self._at, self._turn = self._shown(image), self._at @ np.linalg.inv(self._turn), np.eye(3)
        self._text, self._written = (mask | np.zeros(image.shape, dtype=bool) for mask in (self._text, self._written))
        strong, faint = corners(self._past, self._written, noise * 255.0 / self._levels[1])
        self._points, self._strong = np.concatenate([strong, faint]), len(strong)

    def _shown(self, image: NDArray[np.float32]) -> NDArray[np.uint8]:
        """Return a frame in 8 bits, stretched as the one that is followed: the sky stays as it was as land comes into it."""
        low, span = self._levels
        return np.asarray(np.clip((image - low) * (255.0 / span), 0.0, 255.0).astype(np.uint8))

    def _turned(self, image: NDArray[np.float32]) -> Array | None:
        """Return how the picture has turned (3, 3) since the frame that is followed; None if too few corners agree."""
        self.agreed, past = 0.0, self._past
        if past is None or self._strong < FEWEST:
            return None
        now = self._shown(image)
        guess = applied(self._turn, self._points).astype(np.float32)
        found, good, _ = opencv().calcOpticalFlowPyrLK(past, now, self._points, guess, **FLOW)
        good, side = good.ravel() > 0, np.array(now.shape[::-1])
        stands = good & (np.max(np.abs(found - self._points), axis=1) < STANDS)
        others = similarity(self._points, found, good & ~stands, side) if stands.sum() >= FEWEST else None
        if others is not None:
            stays, goes = written(past, now, others[0])
            self._text = self._text & ~goes | stays
            self._written = around(self._text)
            free = ~self._written[tuple(self._points.astype(int).T[::-1])]
            if stays.any():
                self._points, found, good, self._strong = self._points[free], found[free], good[free], int(free.sum())
        first = np.arange(len(good)) < self._strong
        told = similarity(self._points, found, good & first, side, self._strong)
        if told is None:
            return None
        turn, agree = told
        self.agreed = float(agree.sum() / self._strong)
        if turn[0, 0] == 1.0:  # a shift
            turn[:2, 2] = refined(past, now, self._points[agree], np.rint(turn[:2, 2]).astype(int), self._written)
        return turn if shift(turn, now.shape) <= REACH else None


def similarity(
    points: NDArray[np.float32], found: NDArray[np.float32], of: Mask, side: Array, count: int | None = None
) -> tuple[Array, Mask] | None:
    """Return how `points` (k, 2) of a frame were shifted, rolled and zoomed to where they are found, as a matrix (3, 3), and
    which agree; None if they are too few, of so many, or too near each other.
    """
    chosen = np.flatnonzero(of)
    if len(chosen) < FEWEST:
        return None
    here, there = points[chosen].astype(float), found[chosen].astype(float)
    moved = there - here
    within = AGREE + UNEVEN * np.max(np.abs(moved), axis=1)
    near = np.max(np.abs(moved[:, None] - moved), axis=-1) < within[:, None]
    agree, turn = near[np.argmax(near.sum(axis=1))], np.eye(3)
    turn[:2, 2] = np.median(moved[agree], axis=0)
    fit, _ = opencv().estimateAffinePartial2D(here, there, ransacReprojThreshold=AGREE)
    if fit is not None:
        rolled = np.vstack([fit, [0.0, 0.0, 1.0]])
        more = np.max(np.abs(there - applied(rolled, here)), axis=1) < within
        if more.sum() >= max(agree.sum() + FEWEST, MORE * agree.sum()):
            agree, turn = more, rolled
    wide = float(np.max(np.ptp(here[agree], axis=0) / side))
    if agree.sum() < max(FEWEST, SHARE * (count or len(chosen))) or wide < SPREAD:
        return None
    return turn, np.isin(np.arange(len(points)), chosen[agree])


def applied(turn: Array, places: Array) -> Array:
    """Return where a matrix (3, 3) brings places (..., 2)."""
    return np.asarray(places @ turn[:2, :2].T + turn[:2, 2])


def shift(turn: Array, shape: tuple[int, ...]) -> float:
    """Return how far a matrix (3, 3) brings an edge of a frame (h, w), at most, as a part of the side."""
    side = np.array(shape[::-1])
    edges = np.array([[0, 0], [0, 1], [1, 0], [1, 1]]) * side
    return float(np.max(np.abs(applied(turn, edges) - edges) / side))


def written(past: NDArray[np.uint8], now: NDArray[np.uint8], turn: Array) -> tuple[Mask, Mask]:
    """Return where something is written into frames (h, w) of which corners stand, and others turn (3, 3), and where nothing
    is.

    What is written is like itself, and unlike what the turn brings to its place and away from it. Neither is told if more
    of the frame stands than turns.
    """
    none, side, cv2 = np.zeros(now.shape, dtype=bool), now.shape[::-1], opencv()
    if shift(turn, now.shape) * min(side) < TURNS:
        return none, none
    to, fro = (
        cv2.warpAffine(image, matrix[:2], side, flags=cv2.INTER_NEAREST, borderMode=1)
        for image, matrix in ((now, np.linalg.inv(turn)), (past, turn))
    )
    still = cv2.absdiff(now, past).astype(np.float32)
    turned = np.minimum(cv2.absdiff(to, past), cv2.absdiff(now, fro)).astype(np.float32)
    unlike = float(np.minimum(still, turned).mean())
    if (turned - still > UNLIKE * unlike).sum() > (still - turned > UNLIKE * unlike).sum():
        return none, none
    return turned - still > CLEAR * unlike, still - turned > CLEAR * unlike


def around(text: Mask) -> Mask:
    """Return the pixels (h, w) near what is written, in which no corner is followed."""
    return np.asarray(opencv().dilate(text.astype(np.uint8), np.ones((2 * HALO + 1, 2 * HALO + 1), np.uint8)) > 0)


def refined(
    past: NDArray[np.uint8], now: NDArray[np.uint8], points: NDArray[np.float32], whole: NDArray[np.int_], apart: Mask
) -> Array:
    """Return by how much a picture has moved (2,) around `points` (k, 2), given that to a pixel or so.

    now(x + whole) = past(x - d) = past(x) - d . slope(x): d by least squares over squares around the points that both show,
    but where something is written (`apart`).
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
    scene = (~(apart[rows, columns] | apart[rows + whole[1], columns + whole[0]])).astype(np.float32)
    change, slope = (_level(each, scene) for each in (change, slope.reshape(2, *change.shape)))
    d, *_ = np.linalg.lstsq(
        slope.reshape(2, -1) @ slope.reshape(2, -1).T, -slope.reshape(2, -1) @ change.ravel(), rcond=1e-6
    )
    return np.asarray(whole + np.clip(d, -1.5, 1.5), dtype=float)


def corners(image: NDArray[np.uint8], apart: Mask, noise: float) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the strongest corner of each block of an image (h, w), if it is strong: (k, 2), x and y in px; and faint ones.

    Where `apart` there is none. Strong is what is so beside the eighth strongest; the faint ones are those of the image
    without all that is strong. Of both images' `noise`, and a count by rounding, a place has the variance 2 noise^2 over the
    sum of squared slopes along its weaker axis.
    """
    cv2 = opencv()
    strength = cv2.cornerMinEigenVal(image, WINDOW)  # the mean of squared slopes, by OpenCV's scale of 4 / 255^2
    least = 2.0 * (noise**2 + 1.0) / (OWN * WINDOW) ** 2 * 4.0 / 255.0**2
    strength[apart | (strength < least)] = 0.0
    strong, least = _strongest(strength)
    return strong, _strongest(np.where(around(strength > least), 0.0, strength))[0]


def _strongest(strength: NDArray[Any]) -> tuple[NDArray[np.float32], float]:
    rows, columns = (np.unique(np.linspace(0, side, BLOCKS + 1).astype(int)) for side in strength.shape)
    found = []
    for top, bottom in pairwise(rows):
        for left, right in pairwise(columns):
            j, i = np.unravel_index(np.argmax(strength[top:bottom, left:right]), (bottom - top, right - left))
            found.append((left + i, top + j, strength[top + j, left + i]))
    table = np.array(found, dtype=np.float32)
    least = STRONG * float(np.sort(table[:, 2])[-8:][0])
    return table[(table[:, 2] > least) & (table[:, 2] > 0), :2], least


def _level(image: NDArray[np.float32], known: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return squares (..., m, n) less the mean of what is known, else 0: a camera's level changes as a slope would."""
    count = np.maximum(known.sum(axis=(-2, -1), keepdims=True), 1.0)
    return np.asarray((image - (image * known).sum(axis=(-2, -1), keepdims=True) / count) * known)
