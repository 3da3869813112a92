"""What a template filter knows of how its targets look, where they were, and what was around them."""

from __future__ import annotations

import numpy as np
from attrs import evolve, frozen

from vedette import Array
from vedette_flir.estimators.matches import Appearance
from vedette_flir.evidence import COMMON
from vedette_flir.scene_changes import FADING, change, is_cut, outline


@frozen(eq=False)
class TemplateAppearance(Appearance):
    """What is known of targets. Every array leads with (*b, t); images are in count, NaN outside the frame, places in px.

    patch, first_patch    (p, p)  contrast around it over its amplitude: smoothed, and in the first frame
    latest                (p, p)  the same as it looked in the last frames
    amplitude             ()      its brightness over what is around it, below 0 for a dark target, in count
    offset, size          (2,)    of the target from its box's centre, and its own, in px
    usual, usual_first    ()      as a rule: its contrast over the spread around it, and its likeness to the first patch
    scene, recent         (16, 16), ()  the outline of the last frame, and how much that changed of late, in count
    around, seen_at       (32, 32), (2,)  what was around it where it was first found, and where in that frame
    first_spread, growth  ()      its spread at first in px, 0 before it is known, and the logarithm of its growth
    hint_at, hint_from    (2,)    a place where it may be while it is lost, and where that was first; NaN without one
    hint_around, hint_age (32, 32), ()  what was around that then, and how many frames ago
    before, went          (2, 48, 48), (2, 2)  what was around it, and later, and how far it went in the scene since each
    seen_size, scale      (2, 2), ()  how large it was then, in px; the logarithm of how much larger it was found again
    rate, last            (2,)    how far it goes there in a frame, in px, and where it was in the last frame
    path                  (LAG, 2)  how far it had gone since the first of `before`, the oldest frame first; NaN if not known
    drift, speed          ()      how far it goes in the scene in `LAG` frames, in px: of late, NaN if not known; as a rule
    least                 ()      its least likeness since it moved, 0 where it was found elsewhere
    negative              ()      the probability that the last frame showed it in the negative
    earlier, earlier_at   (2, 160, 160), (2, 3)  earlier frames, coarser; where it was in them, and how many frames ago
    marked, marked_at     (48, 48), (2,)  what was around it where it was marked, and where that is in the last frame
    since, things         (), (3, 7)  for how many frames it stands there, infinite once it left, NaN if it went; what is new
    """

    patch: Array
    first_patch: Array
    latest: Array
    amplitude: Array
    offset: Array
    size: Array
    usual: Array
    usual_first: Array
    scene: Array
    recent: Array
    around: Array
    seen_at: Array
    first_spread: Array
    growth: Array
    hint_at: Array
    hint_from: Array
    hint_around: Array
    hint_age: Array
    before: Array
    went: Array
    seen_size: Array
    scale: Array
    rate: Array
    last: Array
    path: Array
    drift: Array
    speed: Array
    least: Array
    negative: Array
    earlier: Array
    earlier_at: Array
    marked: Array
    marked_at: Array
    since: Array
    things: Array

    @property
    def patches(self) -> Array:
        """Return the smoothed and the first template of one target (2, p, p)."""
        return np.stack([self.patch, self.first_patch])

    @property
    def grown(self) -> Array:
        """Return its size (*b, t, 2) as it has grown since it was found, in px."""
        return self.size * np.exp(self.growth - self.scale)[..., None]


def with_scene(appearance: TemplateAppearance, pixels: Array, part: float) -> tuple[TemplateAppearance, bool]:
    """Return the appearance with the outline of this frame, and whether that shows another scene: a change over so great a
    `part` of its spread.
    """
    scene, recent = outline(pixels), float(appearance.recent)
    changed, cut = change(appearance.scene, scene), is_cut(appearance.scene, scene, recent, part)
    recent = changed if recent == np.inf else max(changed, FADING * recent)
    usual = np.minimum(appearance.usual, COMMON) if cut else appearance.usual
    earlier_at = np.where(cut, np.nan, appearance.earlier_at)
    return evolve(appearance, scene=scene, recent=np.asarray(recent), usual=usual, earlier_at=earlier_at), cut
