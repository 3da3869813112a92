"""Events of close leaves, of which two may give one return: what each leaf of an event has decided to do."""

from __future__ import annotations

import numpy as np
from attrs import frozen

from vedette import Array, Indices, Mask, kernels
from vedette.hypotheses import LeafScores
from vedette_standard.unresolved.close import Close
from vedette_standard.unresolved.events import Events, of_pairs

RARER = 0.01
"""Events of a hypothesis' close leaves are dropped below this part of the weight at which hypotheses are."""


@frozen(eq=False)
class Decided:
    """Events (e,) of sets of close pairs of leaves: the set, its share of the set's; and the leaves (n,) of each.

    A leaf of event `event` is row `row` of those before; it gives the return `choice`, from 1, alone or with another, or 0,
    is missed; column: of a return for two, from 1, 0 of others; takes: whether it takes the return of this number, which one
    of two does. score: all that the set scores is its first leaf's, so that a hypothesis keeps its weight before the scan.
    """

    of: Indices
    share: Array
    event: Indices
    row: Indices
    choice: Indices
    column: Indices
    takes: Mask
    score: Array

    @classmethod
    def joined(cls, parts: list[Decided]) -> Decided:
        """Return the events of several, by their sets."""
        before = np.cumsum([0, *(len(part.share) for part in parts)])
        event = np.concatenate([start + part.event for start, part in zip(before, parts, strict=False)])
        of, share = (np.concatenate([getattr(part, name) for part in parts]) for name in ("of", "share"))
        names = ("row", "choice", "column", "takes", "score")
        return cls(of, share, event, *(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def of_single(pairs: Indices, scores: LeafScores, close: Close, least: float) -> Decided:
    """Return the events of pairs (s,) of leaves that are close to no other leaf of their hypothesis."""
    number, sides = np.arange(len(pairs)), close.pairs[pairs]
    starts = np.concatenate([[0], scores.ends])
    mine = [np.repeat(number, np.diff(starts)[sides[:, side]]) for side in (0, 1)]
    at = [starts[sides[of, side]] + kernels.counted(np.bincount(of, minlength=len(pairs))) for side, of in enumerate(mine)]
    given = np.flatnonzero(np.isin(close.pair, pairs))
    both = np.searchsorted(pairs, close.pair[given]), close.returns[given]
    codes = [of * scores.k + scores.returns[i] for of, i in zip(mine, at, strict=True)]
    every = np.unique(np.concatenate([*codes, both[0] * scores.k + both[1]]))
    of, returns = np.divmod(every, max(scores.k, 1))
    place = kernels.counted(np.bincount(of, minlength=len(pairs)))
    width = int(np.max(place, initial=-1)) + 1
    names = np.zeros((len(pairs), width), dtype=np.int64)
    names[of, place] = returns
    alone, joint = np.full((len(pairs), 2, width), -np.inf), np.full((len(pairs), width), -np.inf)
    for side, (code, i) in enumerate(zip(codes, at, strict=True)):
        to = np.searchsorted(every, code)
        alone[of[to], side, place[to]] = scores.scores[i]
    joint[of, place] = close.joint(pairs[of], returns)
    weight = of_pairs(scores.miss[sides], alone, joint, close.apart(pairs, names))
    total = kernels.log_sum(weight, axis=1)
    share = np.exp(weight - total[:, None])
    which, event = np.nonzero(share > RARER * least)
    first, second = np.divmod(event, 1 + width)
    merged = event >= (1 + width) ** 2
    given = np.where(merged, event - (1 + width) ** 2, 0)
    taken = np.stack([np.where(merged, 1 + given, first), np.where(merged, 1 + given, second)], axis=1)
    choice = np.where(taken > 0, 1 + names[which[:, None], np.maximum(taken - 1, 0)] if width else 0, 0)
    column = np.zeros_like(choice)
    for side in (0, 1):
        column[merged, side] = 1 + close.column(pairs[which[merged]], side, choice[merged, side] - 1)
    takes = (choice > 0) & ~(merged[:, None] & np.array([False, True]))
    score = total[which][:, None] * np.array([1.0, 0.0])
    event = np.repeat(np.arange(len(which)), 2)
    return Decided(
        which, share[share > RARER * least], event, sides[which].ravel(), choice.ravel(), column.ravel(), takes.ravel(),
        score.ravel(),
    )  # fmt: skip


def of_several(chosen: tuple[int, ...], number: int, scores: LeafScores, close: Close, least: float) -> Decided:
    """Return the events of a set of close pairs."""
    pairs = np.array(chosen, dtype=np.int64)
    leaves = np.unique(close.pairs[pairs])
    returns = returns_of(leaves, pairs, scores, close)
    table = np.full((len(leaves), 1 + len(returns)), -np.inf)
    table[:, 0] = scores.miss[leaves]
    for row, leaf in zip(table[:, 1:], leaves.tolist(), strict=True):
        own = slice(scores.ends[leaf - 1] if leaf else 0, scores.ends[leaf])
        row[np.searchsorted(returns, scores.returns[own])] = scores.scores[own]
    members = np.searchsorted(leaves, close.pairs[pairs])
    events = Events.of(table, members, close.joint(pairs[:, None], returns), close.apart(pairs, returns))
    total = float(kernels.log_sum(events.weight))
    share, names = np.exp(events.weight - total), np.concatenate([[0], 1 + returns])
    some = share > RARER * least
    pair, choice = events.pair[some], names[events.taken[some]]
    merged, n = pair >= 0, len(leaves)
    side = (members[pair, 1] == np.arange(n)).astype(np.int64)
    column = np.where(merged, 1 + close.column(pairs[pair], side, choice - 1), 0)
    takes = (choice > 0) & ~(merged & (side == 1))
    score = np.broadcast_to(total * (np.arange(n) == 0), choice.shape)
    count = np.count_nonzero(some)
    return Decided(
        np.full(count, number), share[some], np.repeat(np.arange(count), n), np.tile(leaves, count), choice.ravel(),
        column.ravel(), takes.ravel(), score.ravel(),
    )  # fmt: skip


def returns_of(leaves: Indices, pairs: Indices | list[int], scores: LeafScores, close: Close) -> Indices:
    """Return the returns that leaves may give, alone or with another."""
    starts = np.concatenate([[0], scores.ends])
    alone = [scores.returns[starts[leaf] : starts[leaf + 1]] for leaf in leaves.tolist()]
    return np.unique(np.concatenate([*alone, close.returned(np.asarray(pairs))]))
