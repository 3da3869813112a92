"""The whole frame of a while ago, in which a target was held: what stood elsewhere then, and stands there now, is not it."""

from __future__ import annotations

from functools import cached_property
from itertools import product

import numpy as np
from attrs import evolve, frozen

from vedette import Array
from vedette_flir.estimators.seen_before import CLEAR, SCENE, ShownAgain, new_in, shown
from vedette_flir.estimators.template_appearance import TemplateAppearance
from vedette_flir.estimators.template_search import Look, Matcher
from vedette_flir.estimators.two_frames import laid_over
from vedette_flir.patches import HALO, blurred, clearest
from vedette_flir.registration import applied
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

AS_WELL = 1.05
"""What an earlier frame as it was leaves unexplained of a part, over what it does as the camera has turned, up to which both
may be right: a target is new for each. By hand, on a boat on a calm sea.
"""

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


Laid = tuple[tuple[Array, Array], ...]
"""An earlier frame as it is laid over a later one, and the matrix (3, 3) from cells of that back to those of its own."""


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
        if not self.appearance.earlier_at[0, 2] >= YOUNG:
            return np.nan, np.inf
        now, laid, scale = self._registered
        place, size = (look.place + 0.5) / scale - 0.5, look.known.size / scale
        if np.max(size) < FEWEST:
            return np.nan, np.inf
        seen, parts = SCENE.around(now, place, size), []
        for then, back in laid:
            before = SCENE.around(then, place, size)
            slopes = SCENE.slopes(before, size)
            known = np.asarray(np.isfinite(slopes).all(axis=0))
            parts.append((before, back, shown(before, slopes, known, seen, np.zeros(2), size)))
        least = min(part.rest for *_, part in parts)
        told = [self._new(by, look, *each, place, scale) for each in parts if each[-1].rest <= AS_WELL * least]
        return min(told, key=lambda each: (np.nan_to_num(each[0], nan=-np.inf), each[1]))

    def _new(
        self, by: Matcher, look: Look, before: Array, back: Array, part: ShownAgain, place: Array, scale: float
    ) -> tuple[float, float]:
        """Return the same by one laying of the earlier frame, whose `part` around the place is `before`."""
        changed = part.rest / abs(float(look.known.amplitude))
        was = scale * (applied(back, place + part.off) + 0.5) - 0.5
        *it, _ = self.appearance.earlier_at[0]
        if changed >= CLEAR or np.all(np.abs(was - np.array(it)) < SCENE.own * self.appearance.grown + HALO * scale):
            return np.nan, np.inf
        step, found = scale * SCENE.step(look.known.size / scale), evolve(part, at=scale * part.at, off=scale * part.off)
        errs = tuple(step * np.array(err) for err in product(ERRS, ERRS))
        return new_in(by, look, before, found, step, errs, apart=True), changed

    def places(self, known: TemplateAppearance) -> list[Array]:
        """Return where what was not there in the earlier frame is clearest in this one, of the polarity of a target."""
        if not self.appearance.earlier_at[0, 2] >= YOUNG:
            return []
        now, (*_, (there, _)), scale = self._registered
        slope = np.hypot(*np.gradient(blurred(now)))
        wide = float(np.mean(known.size)) / scale
        at = clearest(now - there, ERRS[-1] * slope, wide, float(np.sign(known.amplitude)))
        return [scale * (place + 0.5) - 0.5 for place in at[:NEWEST]]

    @cached_property
    def _registered(self) -> tuple[Array, Laid, float]:
        """Return this frame, the earlier one, also as it was if that differs from as it is laid, and the px of a cell."""
        now, scale = _reduced(self.pixels)
        then = self.appearance.earlier[0][: now.shape[0], : now.shape[1]]
        turn, (height, width) = laid_over(then, now), now.shape
        corners = [np.array(corner, dtype=float) for corner in product((0, width), (0, height))]
        stands = all(np.all(np.abs(applied(turn, corner) - corner) < ERRS[-1]) for corner in corners)
        return now, (*(() if stands else ((then, np.eye(3)),)), (_turned(then, turn), np.linalg.inv(turn))), scale


def _turned(image: Array, turn: Array) -> Array:
    """Return an image (h, w) as a turn by a matrix (3, 3) shows it; NaN where that is beyond it."""
    side = image.shape[::-1]
    with one_thread() as cv2:
        shown_there = cv2.warpAffine(image, turn[:2], side, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        inside = cv2.warpAffine(np.ones_like(image), turn[:2], side, flags=cv2.INTER_NEAREST)
    return np.where(inside > 0.0, shown_there, np.nan)


def _reduced(pixels: Array) -> tuple[Array, float]:
    """Return a frame in at most `CELLS` cells a side, and the px of a cell."""
    scale = max(1.0, max(pixels.shape) / CELLS)
    height, width = (max(round(side / scale), 1) for side in pixels.shape)
    image = np.ascontiguousarray(pixels, dtype=np.float32)
    with one_thread() as cv2:
        return (image if scale == 1.0 else cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)), scale
