"""What a frame says of a thing that nobody marked: until it moves before its scene, nothing says that it is a target."""

from __future__ import annotations

import numpy as np

from vedette import Array
from vedette_flir.estimators.judged import Judged
from vedette_flir.estimators.surroundings import gone
from vedette_flir.estimators.template_search import Matcher
from vedette_flir.evidence import LAG, LOST, STANDING
from vedette_flir.newcomers import UNKNOWN, UNMOVED, moves, newcomer_odds, written


def unmarked(by: Matcher, pixels: Array, it: Judged, existence: float, past: Array) -> tuple[float, float | None]:
    """Return the log-likelihood ratio that such a thing is where it was looked for, and the log-odds that it is a target at
    all: None where a frame does not tell them.

    `past` (2, 2): where it was found first, and where it was `LAG` frames ago: NaN if it is not known so long.
    """
    look, appearance = it.look, it.appearance
    left, travelled = (float(np.hypot(*off)) for off in look.place - appearance.offset - past)
    if not np.isfinite(travelled):
        return float(np.clip(it.ratio, -UNKNOWN, 0.0)), None  # whether it moves is not known yet
    if existence > LOST:
        return it.ratio - STANDING * (not moves(left, 0.0)), None
    origin = past[0] + appearance.offset
    off = float(np.hypot(*gone(appearance.around, pixels, look.place, origin, appearance.size)))
    turned = origin - appearance.seen_at
    stays = written(look.place - appearance.seen_at, turned)
    if stays or not moves(min(left, off), float(np.hypot(*turned))):
        return min(it.ratio, -UNMOVED), None
    if existence < LOST:
        return it.ratio, None
    return it.ratio, newcomer_odds(by.alone(pixels, look), float(np.fmin(travelled, appearance.drift)) / LAG)
