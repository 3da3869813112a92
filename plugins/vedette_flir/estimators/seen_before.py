"""What was seen before where a target is now: a part of the scene was there already, a target was not."""

from __future__ import annotations

import numpy as np
from attrs import evolve, frozen

from vedette import Array, Mask
from vedette_flir.estimators.template_appearance import TemplateAppearance
from vedette_flir.estimators.template_search import Matcher
from vedette_flir.evidence import LAG
from vedette_flir.patches import blurred, mask_of, sample, similarity

CELLS = 48
"""Side of the grid over what is remembered around a target."""

REACH, ROOM = 6.0, 12.0
"""Side of what is remembered over the target's size, and px beyond that."""

OWN, HALO = 1.0, 2.0
"""Distance within which a pixel is the target's own, over its size, and px beyond that: cameras and codecs draw a halo."""

RENEWED = 1.9
"""How far a target goes, over the distance at which it has left its own place, until what is remembered is renewed."""

FEWEST, ALIKE, NOISE = 200, 4.0, 0.42
"""Cells that must be seen then and now; neighbouring cells that err alike; the variance of a slope of smoothed white noise
over the noise's, a cell apart.
"""

SURE, WIDE = 0.35, 2.0
"""Standard deviation in px up to which a place in the scene is told, and cells up to which slopes tell it."""

CLEAR = 0.3
"""Part of the target's amplitude by which the scene around may differ from what it was, so that it is known again."""

FAINT = 0.25
"""Part of its brightness that a target adds at least to what is behind it, where that is bright, too."""

BETTER = 0.8
"""How much nearer what is seen must be to what was seen for a camera that did not stand still."""

STEADY = 0.3
"""Part of the way that the speed in the scene follows in a frame."""


@frozen(eq=False)
class Part:
    """A part of a frame (48, 48) that shows again what was seen before: how far from the middle a target is in it, and was
    in what was seen (2,), in px; by how much they differ around it, in count; whether both axes tell where it is.
    """

    now: Array
    at: Array
    off: Array
    rest: float
    sure: bool


def nothing_seen(tracks: tuple[int, ...]) -> tuple[Array, ...]:
    """Return what is remembered of targets before their first frame: the fields of an appearance from `before` on."""
    pair, none = np.zeros((*tracks, 2)), np.zeros(tracks)
    before, went = np.zeros((*tracks, 2, CELLS, CELLS)), np.full((*tracks, 2, 2), np.nan)
    return before, went, pair, pair, np.full((*tracks, LAG, 2), np.nan), none + np.nan, none


def unremembered(appearance: TemplateAppearance) -> TemplateAppearance:
    """Return the appearance of a target that is found elsewhere, around which nothing was seen before."""
    return evolve(appearance, went=np.full((2, 2), np.nan), path=np.full((LAG, 2), np.nan))


def remembered(
    by: Matcher, appearance: TemplateAppearance, pixels: Array, place: Array, held: bool
) -> tuple[TemplateAppearance, float]:
    """Return the appearance that remembers what is around a `place` (2,) of this frame, and how new the target is there.

    That is the likeness to the target of this frame less what it showed of that part of the scene before the target came: 1
    for a target, however slow it is, and 0 for a part of the scene; NaN where that is not known. Where it is `held`, what is
    remembered is renewed as it goes on, or is not known again.
    """
    before, went, rate, step = appearance.before, appearance.went, appearance.rate, _step(appearance.size)
    own = OWN * appearance.size + HALO
    at, far, new, known = np.full(2, np.nan), 0.0, np.nan, False
    if np.isfinite(went[0]).all():
        part = _again(before[0], pixels, place, (went[0] + place - appearance.last, went[0] + rate), appearance.size, step)
        known = part.rest < CLEAR * abs(float(appearance.amplitude))
        if known:
            far, gone = float(np.hypot(*(part.off / own))), part.off - went[0]
            rate, went, at = rate + STEADY * (gone - rate), went + gone, part.off if part.sure else at
            new = _new(by, appearance, before[0], part, step) if far >= 1.0 else np.nan
    path, second = np.concatenate([appearance.path[1:], at[None]]), bool(np.isfinite(went[1]).all())
    if held and far >= 1.0 and not second:
        before, went = np.stack([before[0], around(pixels, place, step)]), np.stack([went[0], np.zeros(2)])
    elif held and (not known or far >= RENEWED):
        if not second:
            before, went = np.stack([before[0], around(pixels, place, step)]), np.stack([went[0], np.zeros(2)])
            rate = known * rate
        path = path + went[1] - (went[0] if known else np.nan)
        path[-1] = path[-1] if known else went[1]
        before, went = before[[1, 1]], np.stack([went[1], np.full(2, np.nan)])
    return evolve(appearance, before=before, went=went, rate=rate, last=place, path=path), new


def around(pixels: Array, place: Array, step: float) -> Array:
    """Return what is around a place (2,) of a frame (h, w): (48, 48), NaN outside the frame."""
    along = step * (np.arange(CELLS) - 0.5 * (CELLS - 1))
    down, across = (_within(place[k] + along, pixels.shape[1 - k]) for k in (1, 0))
    return np.where(down[:, None] & across, blurred(sample(pixels, place, step, CELLS)), np.nan)


def _again(before: Array, pixels: Array, place: Array, ways: tuple[Array, Array], size: Array, step: float) -> Part:
    """Return the part of a frame that shows what was seen `before` again, around a target at a place.

    The target has gone `ways[0]` (2,) in the scene if the camera has stood still since the last frame, and `ways[1]` if the
    target is as fast in the scene as it was, however the camera turns. Slopes tell how far it went if that is near enough
    (Lucas, Kanade, An iterative image registration technique, IJCAI 1981).
    """
    slopes = 0.5 * np.stack([before[1:-1, 2:] - before[1:-1, :-2], before[2:, 1:-1] - before[:-2, 1:-1]])
    free = np.isfinite(slopes.sum(axis=0)) & ~_own(np.zeros(2), size, step)
    still = _shown(before, slopes, free, around(pixels, place - ways[0], step), ways[0], size, step)
    if np.max(np.abs(ways[1] - ways[0])) < step:
        return still
    turned = _shown(before, slopes, free, around(pixels, place - ways[1], step), ways[1], size, step)
    return turned if turned.rest < BETTER * still.rest else still


def _shown(before: Array, slopes: Array, free: Mask, now: Array, at: Array, size: Array, step: float) -> Part:
    """Return a part of a frame, in which a target is `at` (2,) px from the middle, beside what was seen before."""
    change = (now - before)[1:-1, 1:-1]
    seen = free & np.isfinite(change) & ~_own(at, size, step)
    if (count := int(seen.sum())) < FEWEST:
        return Part(now, at, at, np.inf, False)
    G, r = slopes[:, seen], change[seen] - np.mean(change[seen])
    G = G - G.mean(axis=1, keepdims=True)  # a camera's level changes as a slope would
    energy, axes = np.linalg.eigh(G @ G.T)
    more = axes.T @ (G @ r) / np.maximum(energy, 1e-9)
    signal = energy - 0.5 * count * NOISE * float(np.var(r - (axes @ more) @ G))
    sure = (signal > 0.5 * energy) & (np.abs(more) < WIDE)
    more = np.where(sure, more * energy / np.maximum(signal, 1e-9), 0.0)
    rest = float(np.var(r - (axes @ more) @ G))
    sure &= step**2 * ALIKE * rest < SURE**2 * signal
    return Part(now, at, at + step * (axes @ more), float(np.sqrt(rest)), bool(sure.all()))


def _new(by: Matcher, appearance: TemplateAppearance, before: Array, part: Part, step: float) -> float:
    """Return the likeness to the target of what a part of a frame shows at its place, less what was seen there before."""
    cells, middle = int(np.ceil(1.6 * float(np.max(appearance.size)) / step + 2.0)), 0.5 * (CELLS - 1)
    now, then = part.at / step, part.off / step
    if np.max(np.abs([now, then])) + 0.5 * cells > middle:
        return np.nan
    change = sample(part.now, middle + now, 1.0, cells) - sample(before, middle + then, 1.0, cells)
    if not np.isfinite(change).all():
        return np.nan
    fine = by.grid(appearance.size)[0]
    patch = sample(appearance.patch, np.full(2, 0.5 * (by.cells - 1)), step / fine, cells) * float(appearance.amplitude)
    mask = mask_of((appearance.size + 2.0) / step, cells)
    scale = np.clip(_spread(change, mask) / max(_spread(patch, mask), 1e-9), FAINT, 1.0)
    return float(similarity(change, scale * patch, mask)[0, 0])


def _spread(image: Array, mask: Array) -> float:
    """Return the standard deviation of an image, weighted by a mask."""
    mean = np.sum(mask * image) / mask.sum()
    return float(np.sqrt(np.sum(mask * (image - mean) ** 2) / mask.sum()))


def _step(size: Array) -> float:
    """Return the px of a cell."""
    return max(1.0, (REACH * float(np.max(size)) + ROOM) / CELLS)


def _own(off: Array, size: Array, step: float) -> Mask:
    """Return the cells but for those at the edge, (46, 46), that belong to a target `off` (2,) px from the middle."""
    along, reach = step * (np.arange(1, CELLS - 1) - 0.5 * (CELLS - 1)), OWN * size + HALO
    own: Mask = ((along - off[1])[:, None] / reach[1]) ** 2 + ((along - off[0]) / reach[0]) ** 2 < 1.0
    return own


def _within(at: Array, side: int) -> Mask:
    inside: Mask = (at >= 0.0) & (at <= side - 1.0)
    return inside
