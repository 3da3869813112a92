"""Targets near each other in a frame: each pixel is claimed once, and places are shared out by motion and likeness."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product
from typing import Generic

import numpy as np
from attrs import evolve, frozen

from vedette import Array, Mask, kernels
from vedette.space import Indices
from vedette_flir.estimators.matches import L, Match, unseen
from vedette_flir.evidence import UNLIKE

REACH = 2.0
"""Targets nearer than this many times the larger box are near: one is taken out of the frame before the other is sought."""

LEVELS = 8.0
"""Log-odds of an exchange by motion from which likeness is not asked, and it does not happen."""


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
    Targets near each other, or found in one place, are a group; those of it expected in one place with others, a chain.
    2. Of those in a group that are found in one place (within half the smaller box) the one nearest to where it is expected
    claims it; another is sought in the frame less all others. If that finds no place of its own, and both are of a chain,
    the whole chain coasts; else the first keeps the place.
    3. A place a costs a target expected at p (a - p)' P^-1 (a - p) / 2 + (1 - s) / u, in logarithms: P the covariance, s its
    likeness there; 1 less a likeness is taken as exponential of mean u. The places of a group are shared out at least cost.
    A target's link from the frame before to this one is 1 over 1 plus the odds of its exchange with each of the others.
    4. Lost targets, and those that would start anew elsewhere, are sought last, in the frame less all others.
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
        one = in_one_place(places[:, None], box[:, None], places, box)
        for i in held:
            beside = [j for j in np.flatnonzero(near[i] & ~one[i]).tolist() if self.who[j].held]
            matches[i] = self._find(i, {j: self._at(j) for j in beside})
        late = [i for i in range(count) if i not in matches or matches[i].elsewhere]
        settled = np.array([i for i in held if i not in late], dtype=np.intp)
        for i in settled:
            places[i] = self._place(i, matches[i])
        meet = near | in_one_place(places[:, None], box[:, None], places, box)
        group = _connected(meet[np.ix_(settled, settled)])
        for members in (settled[group == n] for n in np.flatnonzero(np.bincount(group) > 1)):
            chain = _connected(one[np.ix_(members, members)])
            claimed = self._claimed(members.tolist(), chain.tolist(), matches, link)
            if len(claimed) > 1:
                self._share_out(claimed, matches, link)
        alone = {i: matches.pop(i) for i in late if i in matches}
        for i in late:
            taken = {j: self._place(j, match) for j, match in matches.items() if match.place > 0}
            match = alone[i] if i in alone and not taken else self._find(i, taken)
            matches[i] = unseen(match, self.who[i].appearance) if self._taken(i, match, taken) else match
        return [matches[i] for i in range(count)], link

    def _claimed(
        self, group: Sequence[int], chain: Sequence[int], matches: dict[int, Match[L]], link: Array
    ) -> dict[int, Array]:
        """Return the place that each target of a group claims; the chain of a target that finds none of its own coasts."""
        claimed: dict[int, Array] = {}
        of, coasting = dict(zip(group, chain, strict=True)), set()
        for i in sorted(group, key=lambda k: (self._off(k, self._place(k, matches[k])), k)):
            place = self._place(i, matches[i])
            if clash := self._taken(i, matches[i], claimed):
                other = self._find(i, {j: claimed.get(j, self._at(j)) for j in group if j != i})
                apart = not self._taken(i, other, claimed)
                if apart and other.place > 0:
                    matches[i], place = other, self._place(i, other)
                elif any(of[j] == of[i] for j in clash):
                    coasting.add(of[i])
                    continue
                else:
                    odds = 0.5 * (self._off(i, place) - self._off(clash[0], claimed[clash[0]]))
                    hidden = unseen(other, self.who[i].appearance)
                    matches[i] = other if apart else evolve(hidden, presence=other.presence)
                    link[[i, clash[0]]] *= _logistic(odds)
                    continue
            claimed[i] = place
        for i in (i for i in group if of[i] in coasting):
            matches[i], link[i] = unseen(matches[i], self.who[i].appearance), np.nan
        return {i: place for i, place in claimed.items() if of[i] not in coasting}

    def _share_out(self, claimed: dict[int, Array], matches: dict[int, Match[L]], link: Array) -> None:
        """Give the places that targets of a group claim to them at least cost."""
        ways = {(i, i): matches[i] for i in claimed}
        motion = np.array([[0.5 * self._off(i, place) for place in claimed.values()] for i in claimed])
        likely = _exchanged(motion) < LEVELS
        for (i, k), asked in zip(product(claimed, claimed), likely.flat, strict=True):
            if asked and i != k:
                ways[i, k] = self._find(i, {i: claimed[i]}, claimed[k])
        cost = motion + np.array([[1.0 - ways.get((i, k), matches[i]).likeness for k in claimed] for i in claimed]) / UNLIKE
        (way,) = kernels.k_best(np.where(likely, cost, np.inf), 1).columns
        risk = np.exp(-np.maximum(_exchanged(cost[:, way]), 0.0)).sum(axis=1)
        names = list(claimed)
        for n, i in enumerate(names):
            matches[i] = ways[i, names[way[n]]]
            link[i] /= risk[n]

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

    def _taken(self, i: int, match: Match[L], by: dict[int, Array]) -> list[int]:
        """Return which targets, at their places, are in one with a match."""
        place = self._place(i, match)
        return [j for j, at in by.items() if in_one_place(place, self.who[i].box, at, self.who[j].box)]


def in_one_place(place: Array, box: Array, other: Array, size: Array) -> Mask:
    """Return whether targets at two places (*b, 2), in boxes of two sizes, are in one: within half of the smaller."""
    return np.asarray(np.all(np.abs(place - other) < 0.5 * np.minimum(box, size), axis=-1))


def _connected(linked: Mask) -> Indices:
    """Return a number (t,) for each target, the same for those that are linked (t, t), at first or second hand."""
    i, j = np.nonzero(linked)
    return kernels.linked_clusters(i, j, len(linked), len(linked))[: len(linked)]


def _exchanged(cost: Array) -> Array:
    """Return what it costs (t, t) more that a pair of targets exchange their places, of those of which each has its own."""
    own = np.diag(cost)
    return np.asarray(cost + cost.T - own - own[:, None])


def _logistic(odds: float) -> float:
    return float(1.0 / (1.0 + np.exp(-min(odds, 50.0))))
