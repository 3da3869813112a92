"""What a frame says of a target at a place: as it is known, or in the negative."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from attrs import evolve, frozen

from vedette import Array
from vedette_flir.estimators.earlier import Elsewhere
from vedette_flir.estimators.seen_before import CLEAR, remembered
from vedette_flir.estimators.standing import goes, stood
from vedette_flir.estimators.template_appearance import TemplateAppearance
from vedette_flir.estimators.template_search import BESIDE, NEAR, Look, Matcher
from vedette_flir.estimators.whole_frame import LEAST
from vedette_flir.evidence import LOST, held_ratio, log_odds, scene_ratio, standing_ratio
from vedette_flir.patches import mask_of

LIKELY, REVERSED = 0.5, 0.05
"""Probability from which on a frame is taken to show the negative, and that a target turns into it in a frame. By hand."""

APART, ALIKE = 0.5, 0.6
"""How far from where it was expected a place is asked for in the earlier frame, over the target's size, and from which
likeness on: less is no match. By hand.
"""

PLAIN = 0.5
"""Part of its usual contrast over what is around by which a target in the negative stands out at least. By hand, on
`ir_clips`: with .35 a dim bird is taken for a dark gap among trees.
"""

SAME, ALONE, BRIGHT = 0.9, 0.3, 0.7
"""Likeness to the last frames, margin over others around, and part of its usual contrast over what is around, beyond which
what stands is the target, which stopped: what takes its place is duller or among its like. By hand, on a possum that stops
and turns, and planted losses: of held frames that stand .34 are so, of lost ones .04.
"""

SCENERY, UNSEEN = 3.0, 4.0
"""What was seen before says against scenery at least, in logarithms; and what it says at most against a target that scenery,
apart from where it is expected, is more like it: it may be there unseen. By hand, on drawn spots and masts.
"""


@frozen(eq=False)
class Judged:
    """The log-likelihood ratio that a target is at the place of a look, and its appearance, which remembers the frame.

    standing  what the ratio holds of what was seen there before, and of how the target came there
    of_late   likeness to the target as it looked in the last frames, as likely as it was there then
    known     whether the scene around is known, and what was there before, or it is near where one that moves was expected
    is_scenery  whether it is known as scenery, more than half a size from where the target was expected: none of it is there
    negative  the probability that the frame shows the target in the negative
    """

    look: Look
    appearance: TemplateAppearance
    ratio: float
    standing: float
    of_late: float
    known: bool
    is_scenery: bool
    negative: float = 0.0


def judged(
    by: Matcher,
    close: Matcher,
    appearance: TemplateAppearance,
    pixels: Array,
    look: Look,
    existence: float,
    past: Array,
    where: Array,
    elsewhere: Elsewhere,
) -> Judged:
    """Judge a look at a target that was at `past` (2,) some frames ago and is expected at `where` (2,).

    `close` tells its likeness to the last frames.
    """
    travelled = float(np.hypot(*(look.place - appearance.offset - past)))
    appearance, newness, changed = remembered(by, appearance, pixels, look, existence >= LOST)
    off = float(np.max(np.abs(look.place - where) / appearance.size))
    anew = appearance.least == 0.0  # it was found, and has not moved since
    asked = existence < LOST or ((off > APART or anew) and not np.isfinite(newness))
    if asked and look.likeness > ALIKE:
        told = elsewhere.new(by, look)
        newness, changed = told if np.isfinite(told[0]) and not told[0] >= newness else (newness, changed)
    appearance, stands = stood(appearance, travelled, existence * (look.likeness > ALIKE), look.likeness)
    usual_first, least = float(appearance.usual_first), float(appearance.least)
    first = 0.0 if look.negative else look.first
    scene = scene_ratio(newness, changed, dull=look.dull)
    of_late = existence * close.of_late(look)
    same = min(of_late / SAME, least / ALIKE, look.margin / ALONE, look.clear / (BRIGHT * float(appearance.usual))) > 1.0
    standing = scene + (stands and not same) * standing_ratio(first, usual_first, newness - changed)
    bare = 0.0 if look.dull or not np.isfinite(newness) else newness - changed  # likeness without the scene behind it
    ratio = held_ratio(max(look.likeness, of_late, bare), look.margin, look.clear) + standing
    is_scenery = off > APART and scene < -SCENERY
    if is_scenery:
        ratio = max(ratio, -UNSEEN)
    return Judged(
        look,
        appearance,
        ratio,
        standing,
        of_late,
        changed < CLEAR and (bool(np.isfinite(newness)) or (off < BESIDE and goes(appearance))),
        is_scenery,
    )


def in_negative(
    by: Matcher, pixels: Array, known: TemplateAppearance, seek: Callable[..., Look], at: Array, near: int
) -> Look:
    """Look for a target's outline in the negative, as strong as it is seen there.

    A drone that is brighter than the sky is darker than a cloud. What is hot in it tells nothing then.
    """
    outline, one = mask_of(by.grid(known.size)[1], by.cells), np.ones(())
    dark = {"amplitude": -known.amplitude, "patch": outline, "first_patch": outline, "latest": outline}
    negative = evolve(known, negative=one, **dark)
    place = seek(at, near, negative).place
    return seek(place, NEAR, by.lit(negative, pixels, place))


def likelier_of(plain: Judged, negative: Judged, before: float) -> Judged:
    """Return what is likelier, if the frame `before` showed the negative with this probability.

    A target turns into it before a scene that is known, if what was seen there before does not speak against it: any dark
    spot would do otherwise. And it stands out.
    """
    turns = negative.known and negative.standing >= 0.0
    dim = negative.look.clear < max(PLAIN * float(plain.appearance.usual), LEAST)
    if dim or not (turns or before > LIKELY):
        return plain
    odds = log_odds(REVERSED + (1.0 - 2.0 * REVERSED) * before) + negative.ratio - plain.ratio
    share = float(1.0 / (1.0 + np.exp(-odds)))
    return evolve(negative if share > LIKELY else plain, negative=share)
