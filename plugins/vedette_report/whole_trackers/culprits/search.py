"""As few noises as explain innovations and errors, each with how far it must be turned."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from attrs import evolve, frozen

from vedette import Array, Gaussian, Tracker, VedetteError
from vedette_report.whole_trackers.culprits.moments import Fit
from vedette_report.whole_trackers.culprits.worlds import Knob, knobs_of, turned
from vedette_report.whole_trackers.runs import play
from vedette_report.whole_trackers.world import World

MOST = 4
"""More noises than this are not said to be wrong at once."""
STEPS = 3
"""Of Newton's, where the tracker is not linear."""
FARTHEST = 1e4
"""No factor is larger."""


@frozen(eq=False)
class Culprits:
    """The knobs that explain the moments, how far the world's had to be turned, and one standard error."""

    knobs: list[Knob]
    turns: Array
    errors: Array
    explained: bool


def culprits(tracker: Tracker, world: World, prior: Gaussian, times: Array, runs: int, seed: int) -> Culprits:
    """Return as few knobs as explain innovations and errors: those that bring each world's moments to what is right.

    The moments are linear in the world's noises: how they grow with each is seen in worlds that have more of it, drawn with
    the same numbers. One knob after the other is added, always the one that leaves least; a world with the knobs so turned
    says whether what is left is chance, and how they must be turned further where the tracker is not linear.
    After Mehra, On the Identification of Variances and Adaptive Kalman Filtering, IEEE Trans. Automatic Control 15, 1970.
    """
    calm = turned(World(tracker.estimator, tracker.sensors, prior), [], np.zeros(0)).sensors
    tracker, knobs = evolve(tracker, sensors=dict(calm)), knobs_of(world)

    def seen(chosen: Sequence[Knob], turns: Array) -> Fit:
        return Fit.of(play(tracker, prior, times, runs, np.random.default_rng(seed), turned(world, chosen, turns)))

    def slopes(chosen: Sequence[Knob], turns: Array, here: Fit) -> Array:
        columns = []
        for i, knob in enumerate(chosen):
            further = np.array(turns)
            step = knob.step if len(knob.axes) == 2 else 1.0 + turns[i]
            try:
                there = seen(chosen, further + step * (np.arange(len(chosen)) == i))
            except ValueError:  # a correlation beyond 1
                step = -step
                there = seen(chosen, further + step * (np.arange(len(chosen)) == i))
            columns.append((there.mean - here.mean) / step)
        return np.stack(columns, axis=-1)

    here = seen([], np.zeros(0))
    best, chosen = Culprits([], np.zeros(0), np.zeros(0), here.small()), list[int]()
    if best.explained:
        return best
    D = slopes(knobs, np.zeros(len(knobs)), here)
    for _ in range(min(len(knobs), MOST)):
        ranked = sorted((k for k in range(len(knobs)) if k not in chosen), key=lambda k: here.solved(D[:, [*chosen, k]])[0])
        for k in ranked[: 2 if not chosen else 1]:
            some = [knobs[i] for i in [*chosen, k]]
            _, turns, errors = here.solved(D[:, [*chosen, k]])
            tried = _refined(some, turns, errors, seen, slopes)
            if tried is not None and (tried.explained or not best.knobs or len(tried.knobs) > len(best.knobs)):
                best = tried
            if best.explained:
                return best
        chosen.append(ranked[0])
    return best


def _refined(chosen: list[Knob], turns: Array, errors: Array, seen: Any, slopes: Any) -> Culprits | None:
    """Return how the chosen knobs must be turned, by a few steps of Newton's; None if there is no such world."""
    plain = np.array([len(knob.axes) != 2 for knob in chosen])
    try:
        for step in range(STEPS):
            turns = np.where(plain, np.maximum(turns, 1.0 / FARTHEST - 1.0), np.clip(turns, -1.99, 1.99))
            there = seen(chosen, turns)
            if there.small() or step == STEPS - 1:
                break
            _, change, errors = there.solved(slopes(chosen, turns, there))
            low = (1.0 + turns) / 30.0 - 1.0
            turns = np.where(plain, np.maximum(turns + change, low), turns + change)
    except (VedetteError, ValueError, np.linalg.LinAlgError):
        return None
    return Culprits(chosen, turns, errors, there.small())
