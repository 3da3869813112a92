"""How templates and boxes grow with their targets."""

from __future__ import annotations

import numpy as np
from attrs import evolve

from vedette import Array
from vedette_flir.estimators.template_appearance import TemplateAppearance
from vedette_flir.estimators.template_search import Matcher
from vedette_flir.sizes import FOLLOWED, REDRAWN, grown, grown_beside, redrawn, spread_of


def resized(
    by: Matcher, appearance: TemplateAppearance, pixels: Array, place: Array, box: Array, shown: Array, part: float
) -> TemplateAppearance:
    """Return the appearance with the growth that a frame speaks for, and templates as large as the target.

    box: its sides (2,) in px as it was given; shown: the contrast at its place; part: of the way that growth by spread
    follows each frame.
    """
    growth, first, scale = (float(each) for each in (appearance.growth, appearance.first_spread, appearance.scale))
    size = float(np.max(appearance.size))
    if size > by.small:
        beside = by.larger(appearance, shown)
        growth = grown_beside(growth, scale, *beside)
        ahead = growth - scale
    else:
        if (spread := spread_of(pixels, place, box * np.exp(growth), float(np.sign(appearance.amplitude)))) > 0:
            first = first or spread * float(np.exp(-growth / FOLLOWED))
            growth = grown(growth, spread, first, part)
        ahead = max(growth, 0.0) - scale  # the template of a small target would shrink onto its core
        beside = by.larger(appearance, shown) if abs(ahead) > REDRAWN[0] else (0.0, 0.0)
    known = by.scaled(appearance, redrawn(size, ahead, *beside))
    return evolve(known, first_spread=np.asarray(first), growth=np.asarray(growth))
