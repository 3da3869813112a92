"""What was seen before where a target is now: a part of the scene was there already, a target was not."""

from __future__ import annotations

import numpy as np
from attrs import evolve, frozen

from vedette import Array, Mask
from vedette_flir.estimators.surroundings import FEWEST, SURE, WIDE, Grid, by_slopes
from vedette_flir.estimators.template_appearance import TemplateAppearance
from vedette_flir.estimators.template_search import Look, Matcher
from vedette_flir.evidence import LAG, NEWNESS
from vedette_flir.patches import HALO, alike, mask_of, median, sample

SCENE = Grid(48, 6.0, 12.0, 1.0)
"""The grid over what is remembered around a target."""

RENEWED = 1.9
"""How far a target goes, over the distance at which it has left its own place, until what is remembered is renewed: within
the grid, and so that it has nearly left the newer place, too.
"""

CLEAR = 0.3
"""Part of the target's amplitude by which the scene around may differ from what it was, and is known again. By hand."""

FAINT = 0.25
"""Part of its brightness that a target adds at least to what is behind it, where that is bright, too. By hand."""

ITSELF = 0.8, 0.6
"""Likeness to a target of what is behind it, and behind and beside one that is apart, beyond which it hides nothing, as that
would change little, and adds its whole brightness: what is left of a spot of the scene, as places err, is like a faint one.
By hand, on drawn spots and `ir_clips`.
"""

SEEN = 0.5
"""Part of a place, by the weight of its cells, that both frames must show: at the edge of a frame, the part within it."""

BETTER = 0.8
"""How much nearer what is seen must be to what was seen for a camera that did not stand still. By hand."""

STEADY = 0.3
"""Part of the way that the speed in the scene follows in a frame. By hand."""

MOVING, AHEAD = 0.12, 0.6
"""Speed in the scene, in px a frame, beyond which a target may follow another, and likeness of the other to it, at least. By
hand, on drawn pairs.
"""


@frozen(eq=False)
class ShownAgain:
    """A part of a frame (48, 48) that shows again what was seen before: how far a target's place is from the middle of it,
    and from the middle of what was seen (2,), in px; the standard deviation, in count, of their difference away from the
    target; whether both axes tell where it is.
    """

    now: Array
    at: Array
    off: Array
    rest: float
    sure: bool


def nothing_seen(tracks: tuple[int, ...]) -> tuple[Array, ...]:
    """Return what is remembered of targets before their first frame: the fields of an appearance from `before` on."""
    pair, none = np.zeros((*tracks, 2)), np.zeros(tracks)
    before, went = np.zeros((*tracks, 2, SCENE.cells, SCENE.cells)), np.full((*tracks, 2, 2), np.nan)
    return before, went, went, none, pair, pair, np.full((*tracks, LAG, 2), np.nan), none + np.nan, none, none + 1.0, none


def unremembered(appearance: TemplateAppearance) -> TemplateAppearance:
    """Return the appearance of a target that is found elsewhere, around which nothing was seen before."""
    return evolve(appearance, went=np.full((2, 2), np.nan), path=np.full((LAG, 2), np.nan), least=np.zeros(()))


def remembered(
    by: Matcher, appearance: TemplateAppearance, pixels: Array, look: Look, held: bool
) -> tuple[TemplateAppearance, float, float]:
    """Return the appearance that remembers what is around the place of a look, how new the target is there, and by which
    part of its brightness the scene around has changed: infinite where nothing was seen.

    New is the likeness to the target, as it is known or as it looked of late, of this frame less what it showed of that part
    of the scene before the target came: 1 for a target, however slow it is, and 0 for a part of the scene; NaN where that is
    not known. Where it is `held`, what is remembered is renewed as it goes on, or is not known again.
    """
    before, went, sizes, rate = appearance.before, appearance.went, appearance.seen_size, appearance.rate
    place = look.place
    own = SCENE.own * appearance.grown + HALO
    at, far, new, changed, known = np.full(2, np.nan), 0.0, np.nan, np.inf, False
    if np.isfinite(went[0]).all():
        part = _again(before[0], pixels, place, (went[0] + place - appearance.last, went[0] + rate), sizes[0])
        changed = part.rest / abs(float(look.known.amplitude))
        known = changed < CLEAR
        if known:
            far, gone = float(np.hypot(*(part.off / own))), part.off - went[0]
            rate, went, at = rate + STEADY * (gone - rate), went + gone, part.off if part.sure else at
            new = new_in(by, look, before[0], part, SCENE.step(sizes[0])) if far >= 1.0 else np.nan
            moves = np.hypot(*rate) > MOVING and not look.negative
            if new < NEWNESS[1] and moves and _follows(by, appearance, pixels, place + part.off):
                new = np.nan  # who flies ahead of it was there before
        else:
            went = went + rate
    path = np.concatenate([appearance.path[1:], at[None]])
    if held and np.isnan(went[1]).any() and (far >= 1.0 or not known):
        before = np.stack([before[0], SCENE.around(pixels, place, appearance.grown)])
        went, sizes = np.stack([went[0], np.zeros(2)]), np.stack([sizes[0], appearance.grown])
    if held and (far >= RENEWED or not known):
        path = path + went[1] - went[0] if known else np.concatenate([np.full((LAG - 1, 2), np.nan), went[1:]])
        before, went = before[[1, 1]], np.stack([went[1], np.full(2, np.nan)])
        sizes, rate = sizes[[1, 1]], known * rate
    return evolve(appearance, before=before, went=went, seen_size=sizes, rate=rate, last=place, path=path), new, changed


def _again(before: Array, pixels: Array, place: Array, ways: tuple[Array, Array], size: Array) -> ShownAgain:
    """Return the part of a frame that shows what was seen `before` again, around a target at a place.

    The target has gone `ways[0]` (2,) in the scene if the camera has stood still since the last frame, and `ways[1]` if the
    target is as fast in the scene as it was, however the camera turns. Slopes tell how far it went if that is near enough.
    """
    slopes = SCENE.slopes(before, size)
    known = np.isfinite(slopes).all(axis=0) & SCENE.others(np.zeros(2), size)
    still = shown(before, slopes, known, SCENE.around(pixels, place - ways[0], size), ways[0], size)
    if np.max(np.abs(ways[1] - ways[0])) < SCENE.step(size):
        return still
    turned = shown(before, slopes, known, SCENE.around(pixels, place - ways[1], size), ways[1], size)
    return turned if turned.rest < BETTER * still.rest else still


def shown(before: Array, slopes: Array, known: Mask, now: Array, at: Array, size: Array) -> ShownAgain:
    """Return a part of a frame, in which a target is `at` (2,) px from the middle, beside what was seen before."""
    change, step = now - before, SCENE.step(size)
    seen = known & np.isfinite(change) & SCENE.others(at, size)
    if seen.sum() < FEWEST:
        return ShownAgain(now, at, at, np.inf, False)
    more = by_slopes(slopes[:, seen], change[seen], step)
    told = np.isfinite(more.deviation)
    if np.any(told & (np.abs(more.along) >= WIDE * step)):
        return ShownAgain(now, at, at, np.inf, False)
    off = at + more.axes @ np.where(told, more.along, 0.0)
    return ShownAgain(now, at, off, float(np.sqrt(more.rest)), bool(np.all(more.deviation < SURE)))


def new_in(
    by: Matcher,
    look: Look,
    before: Array,
    part: ShownAgain,
    step: float,
    errs: tuple[Array, ...] = (),
    *,
    apart: bool = False,
) -> float:
    """Return the likeness to the target of what a part of a frame shows at its place, less what was seen there before.

    A target adds its contrast to what is behind it, or hides that, as a drone does a mast that is brighter than it: if it is
    `apart` from where it was expected, not a thing like itself. The least for all `errs` (2,), in px, of the earlier place.
    """
    appearance, most = look.known, np.inf if look.negative else 1.0
    cells, middle = int(np.ceil(by.margin * float(np.max(appearance.size)) / step + 2.0)), 0.5 * (SCENE.cells - 1)
    far, at = middle - 0.5 * cells, part.at / step
    if np.max(np.abs(at)) > far:
        return np.nan
    now, whole = sample(part.now, middle + at, 1.0, cells), mask_of((appearance.size + 2.0) / step, cells)
    fine, amplitude = by.grid(appearance.size)[0], float(appearance.amplitude)
    centre, level = np.full(2, 0.5 * (by.cells - 1)), median(before[np.isfinite(before)])
    patches = [sample(known, centre, step / fine, cells) for known in (appearance.patch, by.latest(appearance))]
    square = mask_of(np.full(2, float(cells)), cells)

    def new(off: Array) -> float:
        then = off / step
        if np.max(np.abs(then)) > far:
            return np.nan
        behind = sample(before, middle + then, 1.0, cells)
        change = now - behind
        seen = np.isfinite(change)
        mask = whole * seen
        if mask.sum() < SEEN * whole.sum():
            return np.nan
        change, behind = np.where(seen, change, 0.0), np.where(seen, behind, 0.0)
        over, beside, likeness = behind - level, square * seen if apart else mask, []
        changed = _spread(change, mask)
        for patch in patches:
            adds = patch * amplitude
            itself = alike(over, adds, beside) > ITSELF[apart]
            for expected in [adds] if itself else [adds, adds - np.minimum(patch, 1.0) * over]:
                scale = np.clip(changed / max(_spread(expected, mask), 1e-9), 1.0 if itself else FAINT, most)
                likeness.append(alike(change, scale * expected, mask))
        found = max(likeness)
        against = found + part.rest / abs(amplitude) < NEWNESS[1]
        return found if seen.all() or against else np.nan  # what is shown of a part of a place tells only that it was there

    return float(np.fmin.reduce([new(part.off + err) for err in errs or (np.zeros(2),)]))


def _follows(by: Matcher, appearance: TemplateAppearance, pixels: Array, ahead: Array) -> bool:
    """Return whether a thing like the target, however bright, is within its size of a place ahead of it (2,)."""
    at = np.clip(ahead, 0.0, np.array(pixels.shape[::-1]) - 1.0)
    near = int(np.ceil(np.max(by.grid(appearance.size)[1])))
    return by.look(pixels, at, near, by.lit(appearance, pixels, at)).likeness > AHEAD


def _spread(image: Array, mask: Array) -> float:
    """Return the standard deviation of an image, weighted by a mask."""
    mean = np.sum(mask * image) / mask.sum()
    return float(np.sqrt(np.sum(mask * (image - mean) ** 2) / mask.sum()))
