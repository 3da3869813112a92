"""The whole frame of a while ago, in which a target was held: what stood elsewhere then, and stands there now, is not it."""

from __future__ import annotations

from functools import cached_property
from itertools import product

import numpy as np
from attrs import evolve, frozen

from vedette import Array
from vedette_flir.estimators.seen_before import CLEAR, SCENE, new_in, shown
from vedette_flir.estimators.template_appearance import TemplateAppearance
from vedette_flir.estimators.template_search import Look, Matcher
from vedette_flir.patches import HALO, blurred, clearest, peak
from vedette_flir.sources.images import one_thread

CELLS = 160
"""Cells of the longer side of what is kept of a frame, at most."""

AGE, YOUNG = 30, 8
"""Frames after which a newer one takes its place, and from which on it is asked: in them a target leaves its own place. By
hand.
"""

FEWEST = 1.0
"""Cells of a target's longer side from which on what is kept shows it. By hand, on drawn frames of 1,280 px."""

NEWEST = 3
"""Places that are looked at for what is new there. By hand."""

ERRS = (-0.7, 0.0, 0.7)
"""Cells by which the place of a part of the scene may err, where it has few edges: a target is new for each. By hand."""

TURNED = 0.001
"""Likeness that a turn by two cells costs, so that of places alike, as of a row of posts, the nearest is taken. By hand."""

SURELY = 0.9
"""Existence from which on a target is held in a frame that is kept. By hand."""


def nothing_kept(tracks: tuple[int, ...]) -> tuple[Array, ...]:
    """Return what is kept of targets before their first frame: the fields of an appearance from `earlier` on."""
    return np.zeros((*tracks, 2, CELLS, CELLS), dtype=np.float32), np.full((*tracks, 2, 3), np.nan)


def kept_frame(pixels: Array, appearance: TemplateAppearance, place: Array, *, held: bool) -> TemplateAppearance:
    """Return the appearance a frame later, with this one if it is time for one and the target is `held` in it at a place."""
    frames, at = appearance.earlier, appearance.earlier_at + [0.0, 0.0, 1.0]
    first, second = at[:, 2]
    if held and not (first < AGE / 2 or (first < AGE and second >= 0.0)):
        small, now = _reduced(pixels)[0], np.zeros_like(frames[0])
        now[: small.shape[0], : small.shape[1]] = small
        newest = np.array([*place, 0.0])
        if first < AGE:
            frames, at = np.stack([frames[0], now]), np.stack([at[0], newest])
        elif second >= 0.0:
            frames, at = np.stack([frames[1], now]), np.stack([at[1], newest])
        else:
            frames, at = np.stack([now, now]), np.stack([newest, at[1]])
    return evolve(appearance, earlier=frames, earlier_at=at)


@frozen(eq=False)
class Elsewhere:
    """A frame, in which a target is expected at a place (2,), beside the earlier one that its appearance remembers."""

    appearance: TemplateAppearance
    pixels: Array
    where: Array

    def new(self, by: Matcher, look: Look) -> tuple[float, float]:
        """Return how new what a look found is in its part of the scene, and by which part of its brightness that changed.

        As `remembered` says them; NaN where the earlier frame is too young, does not show that part, or shows the target.
        """
        *it, age = self.appearance.earlier_at[0]
        if not age >= YOUNG:
            return np.nan, np.inf
        then, now, scale, turned = self._registered
        place, size = (look.place + 0.5) / scale - 0.5, look.known.size / scale
        if np.max(size) < FEWEST:
            return np.nan, np.inf
        seen, parts = SCENE.around(now, place, size), []
        for gone in np.unique([np.zeros(2), turned], axis=0):  # once, where the camera stands
            before = SCENE.around(then, place - gone, size)
            slopes = SCENE.slopes(before, size)
            known = np.asarray(np.isfinite(slopes).all(axis=0))
            parts.append((before, gone, shown(before, slopes, known, seen, np.zeros(2), size)))
        before, gone, part = min(parts, key=lambda each: each[-1].rest)
        changed = part.rest / abs(float(look.known.amplitude))
        was, own = look.place + scale * (part.off - gone), SCENE.own * self.appearance.grown + HALO * scale
        if changed >= CLEAR or np.all(np.abs(was - np.array(it)) < own):
            return np.nan, np.inf
        step, found = scale * SCENE.step(size), evolve(part, at=scale * part.at, off=scale * part.off)
        errs = tuple(step * np.array(err) for err in product(ERRS, ERRS))
        return new_in(by, look, before, found, step, errs, apart=True), changed

    def places(self, known: TemplateAppearance) -> list[Array]:
        """Return where what was not there in the earlier frame is clearest in this one, of the polarity of a target."""
        if not self.appearance.earlier_at[0, 2] >= YOUNG:
            return []
        then, now, scale, turned = self._registered
        with one_thread() as cv2:
            turn = np.array([[1.0, 0.0, turned[0]], [0.0, 1.0, turned[1]]])
            there = cv2.warpAffine(then, turn, now.shape[::-1], borderValue=np.nan)
        slope = np.hypot(*np.gradient(blurred(now)))
        wide = float(np.mean(known.size)) / scale
        at = clearest(now - there, ERRS[-1] * slope, wide, float(np.sign(known.amplitude)))
        return [scale * (place + 0.5) - 0.5 for place in at[:NEWEST]]

    @cached_property
    def _registered(self) -> tuple[Array, Array, float, Array]:
        """Return the earlier frame and this one, the px of a cell, and how many cells (2,) most of the scene went since."""
        now, scale = _reduced(self.pixels)
        then = self.appearance.earlier[0][: now.shape[0], : now.shape[1]]
        with one_thread() as cv2:
            before, seen = (cv2.pyrDown(_without_outliers(each)) for each in (then, now))
            down, right = (side // 4 for side in before.shape)
            template = before[down : before.shape[0] - down, right : before.shape[1] - right]
            likeness = cv2.matchTemplate(seen, template, cv2.TM_CCOEFF_NORMED)
        y, x = np.ogrid[: likeness.shape[0], : likeness.shape[1]]
        row, column, fine = peak(likeness - TURNED * np.hypot(x - right, y - down))
        return then, now, scale, 2.0 * (np.array([column - right, row - down]) + fine)


def _reduced(pixels: Array) -> tuple[Array, float]:
    """Return a frame in at most `CELLS` cells a side, and the px of a cell."""
    scale = max(1.0, max(pixels.shape) / CELLS)
    height, width = (max(round(side / scale), 1) for side in pixels.shape)
    image = np.ascontiguousarray(pixels, dtype=np.float32)
    with one_thread() as cv2:
        return (image if scale == 1.0 else cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)), scale


def _without_outliers(image: Array) -> Array:
    """Return an image with what stands out clipped: a target, or what is like one, would be laid upon another.

    Beyond 1.5 times the range of the middle half (Tukey, Exploratory Data Analysis, 1977).
    """
    low, high = np.quantile(image, (0.25, 0.75))
    fence = 1.5 * (high - low)
    return np.clip(image, np.float32(low - fence), np.float32(high + fence))
