"""Whether a held target has come to stand, in the frames or in the scene, whatever the camera does."""

from __future__ import annotations

import numpy as np
from attrs import evolve

from vedette import Array
from vedette_flir.estimators.surroundings import around, gone
from vedette_flir.estimators.template_search import TemplateAppearance
from vedette_flir.evidence import STILL

SETTLING, SLOW = 0.25, 0.02
"""Parts of the way that the drift before the surroundings goes in a frame, as places err, and what it is as a rule."""

PART = 0.25
"""Part of what it is as a rule that is standing, beyond what places err. By hand on drawn birds and `ir_clips`: .3 does as
well, by .2 one of two birds is told less.
"""


def stood(
    appearance: TemplateAppearance, pixels: Array, place: Array, before: Array, travelled: float, existence: float
) -> tuple[TemplateAppearance, bool]:
    """Return the appearance with the drift of a target that is at `place`, and was `before` (2,), and whether it stands.

    Over `LAG` frames it `travelled` so many px in the frames, NaN if that is not known. One that hovers went no farther as a
    rule, and one that a camera follows stands in the frames while what is around it passes. A track that has taken a wisp of
    cloud goes where the cloud goes, however the camera turns.
    """
    if not np.isfinite(travelled):
        return evolve(appearance, drift=np.asarray(np.nan)), False
    went, drift, usual = travelled, float(appearance.drift), float(appearance.speed)
    if travelled < STILL:
        went = float(np.hypot(*gone(appearance.trail[0], pixels, place, before, appearance.size)))
    off = gone(appearance.trail[0], pixels, place, before, appearance.size, along=True)
    if known := bool(np.isfinite(off).all()):
        travelled = float(np.hypot(*off))
        drift = travelled if np.isnan(drift) else drift + SETTLING * (travelled - drift)
    speed = usual + existence * SLOW * (travelled - usual) if usual > 0 else travelled
    stands = went < STILL < PART * usual or (known and drift + STILL < PART * usual)
    return evolve(appearance, drift=np.asarray(drift), speed=np.asarray(speed)), stands


def passed(appearance: TemplateAppearance, pixels: Array | None, place: Array) -> TemplateAppearance:
    """Return the appearance with what is around a place of this frame, where `pixels` show it, as the last of its trail."""
    seen = np.full(appearance.trail.shape[1:], np.nan) if pixels is None else around(pixels, place, appearance.size)
    return evolve(appearance, trail=np.concatenate([appearance.trail[1:], seen[None]]))
