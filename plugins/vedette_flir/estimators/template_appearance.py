"""What a template filter knows of how its targets look, where they were, and what was around them."""

from __future__ import annotations

from attrs import frozen

from vedette import Array
from vedette_flir.estimators.matches import Appearance


@frozen(eq=False)
class TemplateAppearance(Appearance):
    """Patches (*b, t, p, p) as fractions of the signed amplitude (*b, t) in count; the target's offset from the box's
    centre and its size (*b, t, 2) in px; how far it stands out as a rule, by its contrast over the spread of what is around
    it, and its likeness to the first template (*b, t); the outline of the last frame
    (*b, t, 16, 16) and its recent changes (*b, t) in count; what was around it where it was first found (*b, t, 32, 32) in
    count, NaN outside the image, and where in that image (*b, t, 2); the spread that it had first (*b, t) in px, 0 before it
    is known, and the logarithm of its growth (*b, t); while it is lost, a place where it may be, and where that was first
    (*b, t, 2), NaN without one, what was around it then (*b, t, 32, 32), and how many frames ago that was (*b, t); what was
    around it when it was elsewhere, and a newer one (*b, t, 2, 48, 48), NaN outside the image, how far it went in the scene
    since each (*b, t, 2, 2) in px, NaN without one, and goes in a frame (*b, t, 2); where it was in the last frame
    (*b, t, 2) in px, and in the scene in the last frames (*b, t, LAG, 2), as far as it went since the older one, the oldest
    first, NaN where that is not known; how many px it drifts in the scene in as many frames, NaN if not known, and how far
    it went in them as a rule (*b, t).
    """

    patch: Array
    first_patch: Array
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
    rate: Array
    last: Array
    path: Array
    drift: Array
    speed: Array
