"""Where a target is that was lost: the likeliest place of a whole frame."""

from __future__ import annotations

import numpy as np

from vedette import Array, Mask
from vedette_flir.estimators.earlier import Elsewhere
from vedette_flir.estimators.template_appearance import TemplateAppearance
from vedette_flir.estimators.template_search import NEAR, Look, Matcher
from vedette_flir.evidence import NEW, found_ratio, scene_ratio
from vedette_flir.spots_in_frame import spots

SIDES, LEAST, MOST = (7, 15, 31, 61), 4.0, 6
"""Spots of the whole frame that are looked at: sides in px, least contrast over the spread around, how many of each."""

SCALES, SAME = (0.3, 3.0), (0.8, 1.25)
"""Limits of the scale at which a target is found again, and scales that count as 1."""

NEWER, NEARBY = 2.25, 3.0
"""What it says at most for a place that it is new in its scene, in logarithms: half of that of a held target; and that only
within so many sizes of where the target was expected, as other targets are new, too. By hand.
"""


def sought(
    by: Matcher,
    pixels: Array,
    known: TemplateAppearance,
    here: Look,
    expected: float,
    elsewhere: Elsewhere,
    *,
    same_scene: bool,
) -> tuple[Look, float]:
    """Return the place of the whole frame that is likeliest the target's, and the log-odds that it is.

    Looked at are where the target is expected (`here`), spots that stand out, at the scale of their size, and places that
    are like the template, each at its own brightness: a camera that shows another scene sets its gain anew. The target is
    in one of these places, or in none; `expected`: the log-odds of `here` against any other place before the frame is seen.
    What speaks against `here` speaks against all that is found there again. What was not seen before is as likely one of
    the things like it that were.
    `same_scene`: it is the one in which the target was last held.
    """
    usual = float(known.usual)
    sign = float(np.sign(known.amplitude))
    seen, found = spots(pixels, sign, SIDES, LEAST, MOST), [here]
    scales = np.clip(np.sqrt(np.prod(seen.size + 1.0, axis=1) / np.prod(known.size)), *SCALES)
    others = [*by.places(pixels, known), *elsewhere.places(known)]
    for place, scale in [*zip(seen.place, scales, strict=True), *((place, 1.0) for place in others)]:
        sized = known if SAME[0] < scale < SAME[1] else by.scaled(known, float(scale))
        found.append(by.look(pixels, place, NEAR, by.lit(sized, pixels, place)))

    def ratio(look: Look, again: float) -> float:
        near = np.all(np.abs(seen.place - look.place) < np.maximum(0.5 * look.known.size, 2.0), axis=1)
        bright, large = abs(float(look.known.amplitude / known.amplitude)), float(look.known.size[0] / known.size[0])
        clear = float(seen.clear[near].max(initial=0.0))
        return found_ratio(look.likeness, look.margin, clear, again, bright, large, same_scene=same_scene)

    plain = np.array([ratio(look, look.clear / usual) for look in found])
    odds, known_there = plain.copy(), np.zeros(len(found), dtype=bool)
    for i, look in enumerate(found[1:], start=1):
        if ratio(look, 1.0) > -NEWER:
            new, changed = elsewhere.new(by, look)
            near = np.all(np.abs(look.place - elsewhere.where) < NEARBY * known.size)
            if new - changed > NEW[1]:  # it need not stand out from what was there before
                odds[i] = ratio(look, 1.0)
            odds[i] += min(scene_ratio(new, changed, dull=False), NEWER * near)
            known_there[i] = np.isfinite(new)
    apart = np.array([_apart(found, look) for look in found])
    scenery = np.where(known_there, np.exp(plain) - np.exp(np.minimum(odds, plain)), 0.0)
    odds[1:] -= np.where(known_there, 0.0, np.log1p(apart @ scenery))[1:]
    odds += np.where(apart[0], 0.0, min(expected, 0.0))  # `here` is the first
    odds[0] += max(expected, 0.0)
    best = int(np.argmax(odds))
    return found[best], float(odds[best] - np.logaddexp.reduce([0.0, *odds[apart[best]]]))


def _apart(found: list[Look], one: Look) -> Mask:
    """Return which of the looks are at places apart from that of one of them."""
    return np.array([np.any(np.abs(look.place - one.place) >= np.maximum(one.known.size, 3.0)) for look in found])
