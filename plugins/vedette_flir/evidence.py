"""Whether a target is where it is taken to be: the log-likelihood ratios of what one frame shows there.

Their weights are those of logistic regressions of held against lost frames, of `ir_clips` and the odd clips of
`ir_clips_more`, with losses planted in them: a frame's features in places where the target was, and in those where it was
not. Steps and limits beside them were chosen on the same clips, and so were the constant of `held_ratio` (8.1 by regression)
and the last three numbers of `found_ratio`.
"""

from __future__ import annotations

import numpy as np

from vedette import Array, Mask
from vedette_flir.patches import contrast

LOST = 0.5
"""Existence below which a target is sought in the whole frame."""

RING = (0.9, 3.0)
"""What is around a target: from so many times its size to so many."""

LEAST = 12
"""Pixels of half a ring from which on it says what is around."""

CORRELATED = 3.0
"""Successive frames that say as much as one, as they show the same mismatch."""

CUT = 7.0
"""What a change of scene says against a target's being where it was, in logarithms."""

COMMON = 8.0
"""Contrast over the spread around that may be asked of a target in another scene, at most."""

DIM = 4.0
"""Contrast over the spread around below which a box that was marked may not show its target. By hand, on starts in
`ir_clips` and the odd clips, and on drawn targets that leave trees: boxes of 3.8 at most were left rightly, one of 6.4 not.
"""

UNLIKE = 0.05
"""Mean of 1 less the likeness of a target in a frame to what it was."""

LAG, STILL = 8, 0.25
"""Frames over which a track that moved by less than so many px stands still. Of held targets that move at all at most .01 do
within .15 px, and .08 of one that hovers; of tracks that had taken a thing that stands in the scene .9 to 1.
"""

STANDING = 8.0
"""What it says against a target that it came to stand as it became e times less like what it was, in logarithms. With 4 less
is told (.73 of lost frames for .90), 12 tells no more; chosen on all clips but one, it tells .91 on those left out.
"""

NEWNESS, NEW, STOPPED = (30.0, 0.45), (15.0, 0.7), 0.85
"""What it says against a target, in logarithms, for each 1 by which its newness in the scene is below so much; what it says
for one for each by which it is above; and the newness from which on what came to stand is the target, which stopped. By
hand: of 4,626 held frames of `ir_clips` and the odd clips .002 are below .48, of 424 of tracks that had taken a spot planted
there .99 below .32; of 43,700 held frames of changed clips .95 are above .8, of 1,880 of planted losses .014.
"""

RESIZED = 4.5
"""How much less likely a place of its own scene is for each e by which it is larger or smaller than the target, in
logarithms. By hand, on a drone that passes a mast, after which dashes of a graticule were taken for it; 5.5 does as well.
"""

PULL = 1.5
"""Log-odds by which a lost target is rather where it is expected than in another place."""


def clearness(image: Array, at: Array, cells: int, size: Array) -> float:
    """Return the contrast of a hot target above the ring around it over the ring's spread.

    `image` (h, w), `at` (2,) the row and column of the first of the target's `cells`, `size` (2,) its width and height in
    cells.
    """
    j, i = int(at[0]), int(at[1])
    middle = np.array([i + 0.5 * (cells - 1), j + 0.5 * (cells - 1)])
    level, spread = ring_spread(image, middle, np.maximum(size, 1.0))
    return (contrast(image[j : j + cells, i : i + cells], size) - level) / spread


def ring_spread(image: Array, centre: Array, size: Array) -> tuple[float, float]:
    """Return median and spread of an image (h, w) in the ring around a target; the spread is at least a count.

    `centre` and `size` (2,) are x, y and width, height in px. The spread is by the quartiles, so that a treeline on one side
    changes it little.
    """
    part, _, _, ring = _ring(image, centre, size)
    return _level_and_spread(part[ring])


def half_ring_spread(image: Array, centre: Array, size: Array) -> tuple[float, float]:
    """Return median and spread of the calmest half of the ring around a target: above, below, left or right of it.

    A target near a treeline, a cloud or the end of a bright sky stands out from that half.
    """
    part, rows, columns, ring = _ring(image, centre, size)
    j, i = (int(np.searchsorted(each, 0.0, side="right")) for each in (rows, columns))
    halves = (part[at][ring[at]] for at in (np.s_[j:], np.s_[:j], np.s_[:, i:], np.s_[:, :i]))
    found = [_level_and_spread(around) for around in halves if around.size >= LEAST]
    return min(found, key=lambda each: each[1]) if found else (0.0, np.inf)


def _ring(image: Array, centre: Array, size: Array) -> tuple[Array, Array, Array, Mask]:
    """Return the part of an image that holds the ring around a target, its rows and columns in sizes, and the ring in it."""
    extent = int(np.ceil(RING[1] * np.max(size))) + 1
    first = np.maximum(centre.astype(np.intp) - extent, 0)
    part = image[first[1] : int(centre[1]) + extent + 2, first[0] : int(centre[0]) + extent + 2]
    columns, rows = ((np.arange(part.shape[1 - k]) + first[k] - centre[k]) / size[k] for k in (0, 1))
    off = rows[:, None] ** 2 + columns**2
    return part, rows, columns, (off > RING[0] ** 2) & (off < RING[1] ** 2)


def _level_and_spread(around: Array) -> tuple[float, float]:
    if around.size <= 3:
        return 0.0, 1.0
    ordered = np.sort(around)
    low, level, high = (_quantile(ordered, share) for share in (0.25, 0.5, 0.75))
    return level, (high - low) / 1.349 + 1.0


def _quantile(ordered: Array, share: float) -> float:
    below, part = divmod(share * (len(ordered) - 1), 1.0)  # numpy's percentile takes ten times as long for so few
    low, high = float(ordered[int(below)]), float(ordered[min(int(below) + 1, len(ordered) - 1)])
    return low + part * (high - low)


def rival(likeness: Array, j: int, i: int, size: Array) -> float:
    """Return the greatest likeness of another place, farther from row j and column i than the `size` (2,) in cells."""
    x, y = (int(np.ceil(max(side, 3.0))) for side in size)
    parts = (likeness[: max(j - y, 0)], likeness[j + y + 1 :], likeness[:, : max(i - x, 0)], likeness[:, i + x + 1 :])
    return max(float(part.max(initial=0.0)) for part in parts)


def held_ratio(likeness: float, margin: float, clear: float) -> float:
    """Return the log-likelihood ratio that a target that was held is still there.

    `likeness`: of the place to the target, with its contrast; `margin`: by how much it is more like it than others around;
    `clear`: its contrast over the spread around. A place like all around it, as of a box that shows nothing, is none: by
    hand; that limits one of 7,140 held frames.
    """
    return min(10.2 * likeness + 2.5 * margin - 7.2, 20.0 * max(margin, 0.0) + clear - 2.0)


def scene_ratio(new: float, changed: float, *, dull: bool) -> float:
    """Return the log-likelihood ratio that a target is there, so `new` in its part of the scene; nothing if that is NaN.

    What is `dull` may be what is left of a target that fades: that it is new says nothing for it.
    """
    if not np.isfinite(new):
        return 0.0
    return min(NEWNESS[0] * (new + changed - NEWNESS[1]), 0.0) + NEW[0] * max(new - changed - NEW[1], 0.0) * (not dull)


def standing_ratio(first: float, usual: float, new: float) -> float:
    """Return the log-likelihood ratio that a target is there which has come to stand.

    Where a target vanishes before a branch or a mast, its track comes to stand, and the likeness to the `first` template
    falls below the `usual` one; a target that stops looks as it did, or is `new` there: NaN if that is not known.
    """
    if new > STOPPED:
        return 0.0
    return -STANDING * float(np.clip(np.log(max(1.0 - first, 1e-3) / max(1.0 - usual, UNLIKE)), 0.0, 3.0))


def found_ratio(
    likeness: float, margin: float, clear: float, again: float, bright: float, large: float, *, same_scene: bool = False
) -> float:
    """Return the log-odds that a place of a whole frame is that of a target that was lost.

    `likeness` to the templates, `margin` over other places around; `clear`: of the spot there, 0 without any; `again`: its
    contrast over the spread around, over the usual one: less than half of that speaks against it; `bright`, `large`: its
    brightness and size over those of the target as it was. Fainter speaks against it, and so does another size, the more
    in the `same_scene` as it was last held in.
    """
    return (
        3.3 * likeness
        + 3.5 * margin
        + 1.2 * float(np.log(max(clear, 3.0) / 3.0))
        + 2.5 * float(np.clip(np.log(max(2.0 * again, 1e-3)), -2.0, 0.0))
        + 1.6 * min(float(np.log(bright)), 0.0)
        - (RESIZED if same_scene else 0.5) * abs(float(np.log(large)))
        - 4.9
    )


def presence_ratio(ratio: float, existence: float, *, cut: bool, anew: bool) -> float:
    """Return the log-ratio by which a frame changes the odds of a target of `existence`.

    What is found `anew` in the whole frame has the odds that this gives it, whatever was believed before.
    """
    if anew:
        return ratio - log_odds(existence)
    return ratio / CORRELATED - CUT * cut


def learned(ratio: float, existence: float, place: float) -> float:
    """Return the share of a frame's appearance that is learned: how likely it is the target's, and at this place."""
    return float(1.0 / (1.0 + np.exp(-min(log_odds(existence), 2.0) - ratio)) / (1.0 + np.exp(-place)))


def log_odds(existence: float) -> float:
    e = float(np.clip(existence, 1e-9, 1.0 - 1e-9))
    return float(np.log(e / (1.0 - e)))
