"""Whether a thing that nobody marked is a target: it moves before its scene, and nothing around it is like it."""

from __future__ import annotations

import numpy as np

from vedette import Array

PLACE, TURN = 0.3, 0.1
"""Standard deviations of where a part of the scene is found: in px, and as a part of how far the camera has turned since, as
it rolls, zooms, and turns past what is near.
"""

CHANCE = 0.005
"""Probability that a part of the scene that stands counts as moving."""

AROUND, ALIKE = 5.0, 2
"""How far around a thing others are looked for that are like it, over its size; how many: targets fly in pairs, too."""

UNKNOWN = 3.0
"""What a frame says at most, in logarithms, against a thing until it is known whether it moves: a black one ends none."""

UNMOVED = 0.15
"""What it says in a frame against a thing that was never taken for a target that it still is where it was first seen, in
logarithms.
"""

SURE = 0.83
"""Probability from which on a new thing is held for a target. Chosen on clips: .9 finds three targets of 36 less in time."""


SPEED = 0.8
"""Log-odds by which a thing that is e times as fast is rather a target."""


def moves(off: float, turned: float) -> bool:
    """Return whether a thing `off` px from where it was first seen moves, the camera having turned by so many px since.

    Places of what stands are normal around it: they are farther off than d with probability exp(-d^2 / 2 sigma^2).
    """
    return off**2 > -2.0 * float(np.log(CHANCE)) * (PLACE**2 + (TURN * turned) ** 2)


def written(off: Array, turned: Array) -> bool:
    """Return whether a thing that went `off` (2,) px in the frames is written into them: along the way that the camera has
    `turned` (2,) px since it was first seen it stays. A line drawn dark over bright, and bright over dark, grows across it.
    """
    way = float(np.hypot(*turned))
    return not moves(abs(float(off @ turned)) / way if moves(way, 0.0) else float(np.hypot(*off)), 0.0)


def leaps(off: Array, S: Array) -> bool:
    """Return whether a thing that is found so far from where it was expected, with covariance S, is another thing.

    The covariance says how far to search, some 5 px: new targets of the clips were at most 3 px off. Not asked of what was
    seen once, whose speed is not known.
    """
    return float(off @ np.linalg.solve(S, off)) > 1.0


def newcomer_odds(alone: float, speed: float) -> float:
    """Return the log-odds that a thing that moves is a target: glitter, clouds and leaves are slow, and among their like.

    `alone`: its likeness to what it was less that of the second best other place within `AROUND`; `speed` in px a frame. By
    logistic regression on 43 targets and 14 other things that moved, in `ir_clips` and the odd clips of `ir_clips_more`.
    """
    return 9.6 * alone + SPEED * float(np.log(max(speed, 0.02))) - 1.9
