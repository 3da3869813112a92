"""What leaves a marked place in which nothing has moved yet: the box held scenery, and that is the target."""

from __future__ import annotations

import numpy as np
from attrs import evolve, frozen

from vedette import Array
from vedette_flir.estimators.seen_before import SCENE, ShownAgain, shown
from vedette_flir.estimators.template_appearance import TemplateAppearance
from vedette_flir.evidence import DIM
from vedette_flir.newcomers import PLACE
from vedette_flir.patches import clearest, sample

THINGS, CLEAREST = 3, 6
"""Things that are followed, and places in a frame where they may be: the clearest of what is new. These and the constants
below are by hand, on the drawn targets of `python -m benchmarks.flir_departing 5 12 19 26`.
"""

OFTEN, MISSED, FAR = 5, 3, 3.0
"""Frames that show it at least, frames in a row that may not, and px by which it may be off from where it was expected."""

WENT, NEAR, OUT, SLOWEST = 0.5, 2.5, 0.75, 0.2
"""Over the box: how far it has gone at least (and `FAR` px); how near the middle it is seen first, as trees may hide it till
then; how far apart it is from what stays in the box. And how fast it is at least, in px a frame.
"""


@frozen(eq=False)
class Left:
    """A thing that left a marked box: where it is (2,), in px, and whether it is told only now."""

    place: Array
    now: bool


@frozen(eq=False)
class Thing:
    """What is new: where it was `first` and `last` (2,), in px from the middle of the box, so many frames (`age`) between;
    `missed`: frames since in which it was not seen; `often`: those in which it was.
    """

    first: Array
    last: Array
    age: float
    missed: float
    often: float

    def came_out(self, box: Array, since: float) -> bool:
        """Return whether it goes along a line that comes out of the box, in which it was `since` so many frames."""
        way = self.last - self.first
        length = float(np.hypot(*way))
        if self.missed or length < max(FAR, WENT * float(box.max()), SLOWEST * self.age):
            return False
        back = float(self.first @ way) / length**2  # of the way, from its first place to the nearest to the box's middle
        within = np.all(np.abs(self.first - back * way) < OUT * box)
        return bool(within and -MISSED < back * self.age < since - self.age + MISSED)


def nothing_leaves(tracks: tuple[int, ...]) -> tuple[Array, ...]:
    """Return what is remembered of targets that were not marked: the fields of an appearance from `marked` on."""
    none, pair = np.full(tracks, np.nan), np.zeros((*tracks, 2))
    return np.zeros((*tracks, SCENE.cells, SCENE.cells)), pair, none, np.full((*tracks, THINGS, 7), np.nan)


def marked(pixels: Array, place: Array, box: Array) -> tuple[Array, ...]:
    """Return these fields of a target that was marked in a frame, in a box (2,) in px."""
    return SCENE.around(pixels, place, box), place, np.zeros(()), np.full((THINGS, 7), np.nan)


def watched(appearance: TemplateAppearance, known: TemplateAppearance) -> TemplateAppearance:
    """Return an appearance with what is `known` of these fields."""
    return evolve(appearance, marked=known.marked, marked_at=known.marked_at, since=known.since, things=known.things)


def leaving(
    appearance: TemplateAppearance, pixels: Array, place: Array, where: Array, box: Array
) -> tuple[TemplateAppearance, Left | None]:
    """Return the appearance that remembers what leaves the box that was marked, and what has left; None where nothing has.

    Only of a box in which nothing stands out as a rule, while the target, found at a `place`, is in it (expected: `where`).
    A thing is new before what was around the box as it was marked, and goes along a line that comes out of it, in which it
    was since then: what crosses was outside of it first. From then on it is followed by what is new; as that ends, the box
    is marked anew around it.
    """
    since = float(appearance.since)
    if np.isnan(since):
        return appearance, None
    if not np.isinf(since) and appearance.usual > DIM:
        return evolve(appearance, since=np.full((), np.nan)), None
    slopes = SCENE.slopes(appearance.marked, box)
    known = np.asarray(np.isfinite(slopes).all(axis=0) & SCENE.others(np.zeros(2), box))
    around = SCENE.around(pixels, appearance.marked_at, box)
    part = shown(appearance.marked, slopes, known, around, np.zeros(2), box)
    at: Array = appearance.marked_at - part.off  # where the middle of the box is now
    if np.isfinite(part.rest):
        seen = _new_things(_change(appearance, part, SCENE.step(box)), slopes, box) + part.off
        appearance = evolve(appearance, things=_followed(appearance.things, seen, box), marked_at=at)
    often = [thing for thing in _things(appearance.things) if thing.often >= OFTEN]
    if np.isinf(since):
        for thing in often:
            if np.all(np.abs(at + thing.last - where) < np.maximum(box, FAR)):
                return appearance, None if thing.missed else Left(at + thing.last, now=False)
        new, at, from_now, nothing = marked(pixels, place, box)  # what it is before now may be scenery, too
        return evolve(appearance, marked=new, marked_at=at, since=from_now, things=nothing), None
    for thing in often:
        apart = np.any(np.abs(at + thing.last - place) >= OUT * box)
        if part.sure and apart and thing.came_out(box, since):
            return evolve(appearance, since=np.full((), np.inf)), Left(at + thing.last, now=True)
    gone = np.any(np.abs(place - at) > OUT * box)
    return evolve(appearance, since=np.asarray(np.nan if gone else since + 1.0)), None


def _change(appearance: TemplateAppearance, part: ShownAgain, step: float) -> Array:
    """Return what a part of a frame shows (48, 48) less what it showed as it was marked; NaN where that is not known."""
    return part.now - sample(appearance.marked, 0.5 * (SCENE.cells - 1) + part.off / step, 1.0, SCENE.cells)


def _new_things(change: Array, slopes: Array, box: Array) -> Array:
    """Return the places (k, 2) of what is clearest of what is new, in px from the middle of the grid.

    The change (48, 48) is compared with what an error of a place by `PLACE` px makes of a slope.
    """
    step, middle = SCENE.step(box), 0.5 * (SCENE.cells - 1)
    errs = PLACE * np.nan_to_num(np.hypot(slopes[0], slopes[1]))
    return step * (clearest(change, errs, float(box.mean()) / step)[:CLEAREST] - middle)


def _things(rows: Array) -> list[Thing]:
    return [Thing(row[:2], row[2:4], *row[4:]) for row in rows if np.isfinite(row[0])]


def _followed(rows: Array, seen: Array, box: Array) -> Array:
    """Return things (THINGS, 7) a frame later, found again among the places that are `seen` (k, 2); and new ones."""
    free, after, reach = list(seen), [], max(FAR, 0.25 * float(box.max()))
    for it in sorted(_things(rows), key=lambda thing: -thing.often):
        expected = it.last + (it.last - it.first) / max(it.age, 1.0) * (it.missed + 1.0)
        off = [float(np.hypot(*(place - expected))) for place in free]
        if off and min(off) < reach:
            place = free.pop(int(np.argmin(off)))
            after.append([*it.first, *place, it.age + it.missed + 1.0, 0.0, it.often + 1.0])
        elif it.missed < MISSED:
            after.append([*it.first, *it.last, it.age, it.missed + 1.0, it.often])
    after += [[*place, *place, 0.0, 0.0, 1.0] for place in free if np.all(np.abs(place) < NEAR * box)]
    return np.array((after + [[np.nan] * 7] * THINGS)[:THINGS])
