"""Joint events of a scan one by one, among them those in which two tracks give one return."""

from __future__ import annotations

import numpy as np
from attrs import frozen

from vedette import Array, Indices

LEAST = 1e-7
"""Events below this part of the likeliest one are dropped as they grow."""
OPEN = -1


@frozen(eq=False)
class Events:
    """Joint events: the return (e, t) that each track takes, 0 for none; the pair (e, t) with which it gives it, -1 for
    none; and the log of their weight (e,).

    No two tracks take a return but as one of `pairs`. Svensson, Ulmke, Hammarstrand, Multitarget Sensor Resolution Model and
    JPDA, IEEE T-AES 48, 2012; groups of three and more are taken as pairs that were resolved from the others.
    """

    taken: Indices
    pair: Indices
    weight: Array

    @classmethod
    def of(cls, scores: Array, pairs: Indices, joint: Array, apart: Array) -> Events:
        """Return all events of tracks with log scores (t, 1+k), column 0 the miss.

        The `pairs` (p, 2) of tracks may give one return, with the log score `joint` (p, k); where both have returns of their
        own, `apart` (p, k, k) is the log of the probability that they were resolved.
        """
        t, k = scores.shape[0], scores.shape[1] - 1
        taken, pair, weight = np.full((1, t), OPEN), np.full((1, t), -1), np.zeros(1)
        used = np.zeros((1, k + 1), dtype=bool)
        for i in range(t):
            free = taken[:, i] == OPEN
            grown = [(taken[~free], pair[~free], weight[~free], used[~free])]
            for choice in np.flatnonzero(np.isfinite(scores[i])).tolist():
                rows = free & ~used[:, choice]
                grown.append(_grown(taken[rows], pair[rows], weight[rows], used[rows], [i], choice, -1, scores[i, choice]))
            for number in np.flatnonzero(pairs.min(axis=1) == i).tolist():
                j = int(pairs[number].max())
                for choice in (1 + np.flatnonzero(np.isfinite(joint[number]))).tolist():
                    rows, more = free & ~used[:, choice] & (taken[:, j] == OPEN), joint[number, choice - 1]
                    grown.append(_grown(taken[rows], pair[rows], weight[rows], used[rows], [i, j], choice, number, more))
            taken, pair, weight, used = (np.concatenate(part) for part in zip(*grown, strict=True))
            kept = weight > np.max(weight) + np.log(LEAST)
            taken, pair, weight, used = taken[kept], pair[kept], weight[kept], used[kept]
        for number, (i, j) in enumerate(pairs.tolist()):
            both = (taken[:, i] > 0) & (taken[:, j] > 0) & (taken[:, i] != taken[:, j])
            weight[both] += apart[number, taken[both, i] - 1, taken[both, j] - 1]
        return cls(taken, pair, weight)

    def likeliest(self, most: int | None) -> Events:
        """Return at most so many of the events, the likeliest; None: all."""
        if most is None or len(self.weight) <= most:
            return self
        kept = np.argpartition(-self.weight, most)[:most]
        return Events(self.taken[kept], self.pair[kept], self.weight[kept])

    def marginals(self, single: tuple[int, ...], merged: tuple[int, ...]) -> tuple[Array, Array]:
        """Return the weights of single returns (t, 1+k) and of merged ones (p, k)."""
        share = np.exp(self.weight - np.max(self.weight))
        share /= np.sum(share)
        alone, together = np.zeros(single), np.zeros(merged)
        for i in range(single[0]):
            own, first = self.pair[:, i] < 0, self.pair[:, i] >= 0
            np.add.at(alone[i], self.taken[own, i], share[own])
            # Each merged event stands at both of its tracks: a half at each.
            np.add.at(together, (self.pair[first, i], self.taken[first, i] - 1), 0.5 * share[first])
        return alone, together


def _grown(
    taken: Indices, pair: Indices, weight: Array, used: Array, tracks: list[int], choice: int, number: int, more: float
) -> tuple[Indices, Indices, Array, Array]:
    """Return events in which some tracks take a return, too."""
    taken[:, tracks], pair[:, tracks] = choice, number
    if choice > 0:
        used[:, choice] = True
    return taken, pair, weight + more, used


def of_pairs(miss: Array, alone: Array, joint: Array, apart: Array) -> Array:
    """Return the log weights of all events of pairs of tracks that share a return with no other: (p, (1+k)^2 + k).

    miss (p, 2), alone (p, 2, k), joint (p, k) and apart (p, k, k) are as in `Events.of`. Event (1+k) a + b: the first takes
    return a, from 1, or 0, and the second b; after these, both give each of the k.
    """
    first, second = (np.concatenate([miss[:, side, None], alone[:, side]], axis=1) for side in (0, 1))
    weight = first[:, :, None] + second[:, None]
    weight[:, 1:, 1:] += apart
    of_one = 1 + np.arange(alone.shape[2])
    weight[:, of_one, of_one] = -np.inf
    return np.concatenate([weight.reshape(len(miss), (1 + alone.shape[2]) ** 2), joint], axis=1)
