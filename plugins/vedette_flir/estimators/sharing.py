"""Targets near each other in a frame: each pixel is claimed once, and places are shared out by motion and likeness."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Generic

import numpy as np
from attrs import evolve, frozen

from vedette import Array, Mask
from vedette_flir.estimators.matches import L, Match, unseen
from vedette_flir.evidence import UNLIKE

REACH = 2.0
"""Targets nearer than this many times the larger box are near: one is taken out of the frame before the other is sought."""

LEVELS = 8.0
"""Log-odds of motion from which likeness is not asked."""


@frozen(eq=False)
class Expected(Generic[L]):
    """Where one target is expected: place (2,) and box (2,) in px, covariance (2, 2) of that place as calm as the target has
    been, whether it is `held`: sought near its place, not in the whole frame, and its appearance so far.
    """

    where: Array
    box: Array
    cov: Array
    held: bool
    appearance: L


Find = Callable[[int, Array, Array], Match[L]]
"""Finds a target, by its number, in an image (h, w) where it is expected (2,)."""

Without = Callable[[Array, Array, L], Array]
"""Takes a target at a place (2,) out of an image (h, w)."""


@frozen(eq=False)
class Sharing(Generic[L]):
    """Finds all targets of one frame together.

    1. A target is sought in the frame less those near it where they are expected, if not in one place with its own.
    2. Of two that are found in one place (within half the smaller box) the one nearer to its expected place claims it; the
    other is sought in the frame less the first. If that finds nothing, and both were expected in one place, neither is
    updated: both coast. If they were expected apart, the first keeps the place.
    3. Two places a, b found for two targets near each other, expected at p, q, are theirs this way rather than the other by
    the log-odds 2 (a - b)' C^-1 (p - q) + (s - s') / u: C the sum of their covariances, s the sum of their likenesses, s'
    that with the places exchanged; 1 less a likeness is taken as exponential of mean u. The likelier way is taken; its
    probability is the targets' link from the frame before to this one.
    4. Lost targets, and those that would start anew elsewhere, are sought last, in the frame less all others.
    With three targets or more the pairs are judged one after the other.
    """

    image: Array
    who: Sequence[Expected[L]]
    find: Find[L]
    without: Without[L]

    def found(self) -> tuple[list[Match[L]], Array]:
        """Return what was found of each target, and the probability of its link (t,), NaN where it coasts unseen."""
        count, link = len(self.who), np.ones(len(self.who))
        if not count:
            return [], link
        matches: dict[int, Match[L]] = {}
        held = [i for i in range(count) if self.who[i].held]
        places, box = np.array([each.where for each in self.who]), np.array([each.box for each in self.who])
        reach = REACH * box.max(axis=1)
        near = np.max(np.abs(places[:, None] - places), axis=-1) < np.maximum(reach[:, None], reach)

        def same(i: int) -> Mask:
            return in_one_place(places[i], box[i], places, box)

        for i in held:
            beside = [j for j in np.flatnonzero(near[i] & ~same(i)).tolist() if self.who[j].held]
            matches[i] = self._find(i, {j: self._at(j) for j in beside})
        late = [i for i in range(count) if i not in matches or matches[i].elsewhere]
        settled = [i for i in held if i not in late]
        for i in settled:
            places[i] = self._place(i, matches[i])
        for n, i in enumerate(settled):
            later = np.array(settled[n + 1 :], dtype=np.intp)
            while (meets := near[i, later] | same(i)[later]).any():
                first = int(np.argmax(meets))
                j, later = int(later[first]), later[first + 1 :]
                self._share(i, j, matches, link)
                places[i], places[j] = self._place(i, matches[i]), self._place(j, matches[j])
        alone = {i: matches.pop(i) for i in late if i in matches}
        for i in late:
            taken = {j: self._place(j, match) for j, match in matches.items() if match.place > 0}
            match = alone[i] if i in alone and not taken else self._find(i, taken)
            one_place = any(self._same(i, self._place(i, match), j, at) for j, at in taken.items())
            matches[i] = unseen(match, self.who[i].appearance) if one_place else match
        return [matches[i] for i in range(count)], link

    def _share(self, i: int, j: int, matches: dict[int, Match[L]], link: Array) -> None:
        places = {k: self._place(k, matches[k]) for k in (i, j)}
        if self._same(i, places[i], j, places[j]):
            first, second = sorted((i, j), key=lambda k: (self._off(k, places[k]), k))
            other = self._find(second, {first: places[first]})
            apart = not self._same(first, places[first], second, self._place(second, other))
            if not (apart and other.place > 0):
                if self._same(i, self._at(i), j, self._at(j)):
                    for k in (i, j):
                        matches[k] = unseen(matches[k], self.who[k].appearance)
                    link[[i, j]] = np.nan
                else:
                    odds = 0.5 * (self._off(second, places[second]) - self._off(first, places[first]))
                    hidden = unseen(other, self.who[second].appearance)
                    matches[second] = other if apart else evolve(hidden, presence=other.presence)
                    link[[i, j]] *= _logistic(odds)
                return
            matches[second], places[second] = other, self._place(second, other)
        cov = self.who[i].cov + self.who[j].cov
        odds = 2.0 * float((places[i] - places[j]) @ np.linalg.solve(cov, self._at(i) - self._at(j)))
        if odds < LEVELS:
            turned = {k: self._find(k, {k: places[k]}, places[m]) for k, m in ((i, j), (j, i))}
            odds += sum(matches[k].likeness - turned[k].likeness for k in (i, j)) / UNLIKE
            if odds < 0:
                matches.update(turned)
        link[[i, j]] *= _logistic(abs(odds))

    def _find(self, i: int, taken: dict[int, Array], where: Array | None = None) -> Match[L]:
        """Return what is found of a target without those that are taken, expected `where` or at its own place."""
        image, at = self.image, self._at(i) if where is None else where
        for j, place in taken.items():
            image = self.without(image, place, self.who[j].appearance)
        match = self.find(i, image, at)
        return evolve(match, residual=match.residual + at - self._at(i))

    def _at(self, i: int) -> Array:
        return self.who[i].where

    def _place(self, i: int, match: Match[L]) -> Array:
        return self._at(i) + match.residual

    def _off(self, i: int, place: Array) -> float:
        """Return the squared distance of a place from the expected one."""
        d = place - self._at(i)
        return float(d @ np.linalg.solve(self.who[i].cov, d))

    def _same(self, i: int, place: Array, j: int, other: Array) -> bool:
        return bool(in_one_place(place, self.who[i].box, other, self.who[j].box))


def in_one_place(place: Array, box: Array, other: Array, size: Array) -> Mask:
    """Return whether targets at two places (*b, 2), in boxes of two sizes, are in one: within half of the smaller."""
    return np.asarray(np.all(np.abs(place - other) < 0.5 * np.minimum(box, size), axis=-1))


def _logistic(odds: float) -> float:
    return float(1.0 / (1.0 + np.exp(-min(odds, 50.0))))
