"""Where a target was found in a frame, and what speaks for it."""

from __future__ import annotations

from typing import Generic, TypeVar

import numpy as np
from attrs import evolve, frozen

from vedette import Array

MOST = 60.0
"""Greatest log-likelihood ratio of a match."""

WEAK = 40.0
"""How fast that falls as a match falls below the limit. Faster, and two smeared frames are misses that widen the search."""


@frozen(eq=False)
class Appearance:
    """The appearance of targets; `known` (*b, t) is 0 before their first frame, then 1. Every array leads with (*b, t)."""

    known: Array


L = TypeVar("L", bound=Appearance)
"""What is known of how targets look."""


@frozen(eq=False)
class Match(Generic[L]):
    """Where one target was found: the residual (2,) in px, log-likelihood ratios, and its appearance there.

    place     that the target is at this place, given that it is in view: it weighs the position
    presence  that the target is in view: it weighs existence; None: the same
    elsewhere whether the place is none that the motion leads to, so that the target starts anew there
    learned   which part of its appearance there is taken; None: as likely as the frame shows the target
    likeness  to the target as it is known, 1 at most
    odds      log-odds that it is a target at all, by what it showed so far; they weigh existence in place of `presence`
    hidden    its appearance if the frame shows nothing of it; None: as before
    """

    residual: Array
    place: float
    appearance: L
    presence: float | None = None
    elsewhere: bool = False
    learned: float | None = None
    likeness: float = 1.0
    odds: float | None = None
    hidden: L | None = None


def unseen(match: Match[L], before: L) -> Match[L]:
    """Return a match that says nothing: two targets are in one place, and neither can be told from the other."""
    hidden = before if match.hidden is None else match.hidden
    return evolve(match, place=-MOST, presence=0.0, odds=None, elsewhere=False, learned=1.0, appearance=hidden)


def known_pixels(pixels: Array) -> Array:
    """Return the frame with the median where a pixel is unknown; 0 where all are."""
    if not np.issubdtype(pixels.dtype, np.floating) or not np.isnan(pixels).any():
        return pixels
    known = ~np.isnan(pixels)
    return np.where(known, pixels, np.median(pixels[known]) if known.any() else 0.0)


def match_ratio(match: float, limit: float, independent: float) -> float:
    """Return (n / 2) log[(1 - limit^2) / (1 - match^2)], n cells, at most 60; below the limit 40 (match / limit - 1)."""
    if match < limit:
        return WEAK * (match / limit - 1.0)
    ratio = 0.5 * independent * float(np.log((1.0 - limit**2) / max(1.0 - match**2, 1e-12)))
    return min(ratio, MOST)
