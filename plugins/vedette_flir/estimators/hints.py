"""Places of a target in another scene that are likely, but not enough: one that then moves before that scene is likelier."""

from __future__ import annotations

import numpy as np
from attrs import evolve

from vedette import Array
from vedette_flir.estimators.earlier import Elsewhere
from vedette_flir.estimators.judged import Judged
from vedette_flir.estimators.surroundings import BESIDE, gone
from vedette_flir.estimators.template_appearance import TemplateAppearance
from vedette_flir.estimators.template_search import Look, Matcher
from vedette_flir.estimators.whole_frame import sought
from vedette_flir.evidence import LAG, PULL, log_odds
from vedette_flir.newcomers import SPEED, moves

ROUGH = 3.0
"""How much less exact the place of a doubtful match is than that of what stands. By hand."""

MOVING = 1.0
"""Log-odds by which a place that moves by a pixel a frame is rather a target's: most of what is like one stands. By hand; a
slower one is less, as in `newcomer_odds`.
"""


def found_elsewhere(
    by: Matcher, pixels: Array, it: Judged, existence: float, there: Elsewhere, *, cut: bool
) -> tuple[Look, float, TemplateAppearance]:
    """Look for a target in the whole frame: its likeliest place, the log-odds of that, and what is remembered of it."""
    expected = 0.0 if cut else max(log_odds(existence), PULL) + it.standing
    same = not cut and bool(np.isnan(it.appearance.hint_at).any())
    other, odds = sought(by, pixels, it.appearance, it.look, expected, there, same_scene=same)
    appearance, likelier = hinted(it.appearance, pixels, other, cut=cut)
    return other, odds + likelier * (other is not it.look), appearance


def hinted(appearance: TemplateAppearance, pixels: Array, look: Look, *, cut: bool) -> tuple[TemplateAppearance, float]:
    """Return the appearance that remembers a likely place, and by how much that is likelier for what it did since,
    once it was there for half of `LAG` frames.

    Only after a `cut`: a target that fades or hides is where it was, and what moves elsewhere is another. It is the same
    thing as in the frame before if it is within its size of where that was then.
    """
    if not cut and np.isnan(appearance.hint_at).any():
        return appearance, 0.0
    size, age = np.maximum(look.known.size, 3.0), float(appearance.hint_age) + 1.0
    first = appearance.hint_from
    if cut or not np.all(np.abs(look.place - appearance.hint_at) < size):
        first, age = look.place, 0.0
        appearance = evolve(appearance, hint_from=first, hint_around=BESIDE.around(pixels, first, size))
    appearance = evolve(appearance, hint_at=look.place, hint_age=np.asarray(age))
    off = gone(appearance.hint_around, pixels, look.place, first, size)
    least = min(float(np.hypot(*off)), float(np.hypot(*(look.place - first))))
    if age < LAG / 2 or not moves(least / ROUGH, 0.0):
        return appearance, 0.0
    return appearance, max(MOVING + SPEED * float(np.log(least / age)), 0.0)


def forgotten(appearance: TemplateAppearance) -> TemplateAppearance:
    """Return the appearance without a likely place."""
    return evolve(appearance, hint_at=np.full(2, np.nan))
