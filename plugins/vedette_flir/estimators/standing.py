"""Whether a held target has come to stand, in the frames or in the scene, whatever the camera does."""

from __future__ import annotations

import numpy as np
from attrs import evolve

from vedette_flir.estimators.template_appearance import TemplateAppearance
from vedette_flir.evidence import STILL

SETTLING, SLOW = 0.25, 0.02
"""Parts of the way that the drift before the surroundings goes in a frame, as places err, and what it is as a rule."""

PART = 0.25
"""Part of what it is as a rule that is standing, beyond what places err. By hand on drawn birds and `ir_clips`: .3 does as
well, by .2 one of two birds is told less.
"""


def stood(
    appearance: TemplateAppearance, travelled: float, existence: float, likeness: float
) -> tuple[TemplateAppearance, bool]:
    """Return the appearance with the drift of a target in the scene, and whether it stands there.

    Over `LAG` frames it `travelled` so many px in the frames, NaN if that is not known. One that hovers went no farther as a
    rule, and one that a camera follows stands in the frames while what is around it passes. A track that has taken a wisp of
    cloud goes where the cloud goes, however the camera turns. What it does as a rule is learned with the weight `existence`:
    0 where the look is unlike it. The least `likeness` is forgotten as the target moves.
    """
    least = np.minimum(appearance.least, likeness)
    if not np.isfinite(travelled):
        return evolve(appearance, drift=np.asarray(np.nan), least=least), False
    drift, usual = float(appearance.drift), float(appearance.speed)
    in_scene = float(np.hypot(*(appearance.path[-1] - appearance.path[0])))
    known = bool(np.isfinite(in_scene))
    if known:
        travelled = in_scene
        drift = travelled if np.isnan(drift) else drift + SETTLING * (travelled - drift)
    speed = usual + existence * SLOW * (travelled - usual) if usual > 0 else travelled
    stands = (travelled < STILL and goes(appearance)) or (known and drift + STILL < PART * usual)
    least = least if stands else least + SLOW * (1.0 - least)
    return evolve(appearance, drift=np.asarray(drift), speed=np.asarray(speed), least=np.asarray(least)), stands


def goes(appearance: TemplateAppearance) -> bool:
    """Return whether a target as a rule goes as far as tells it from one that stands."""
    return PART * float(appearance.speed) > STILL
