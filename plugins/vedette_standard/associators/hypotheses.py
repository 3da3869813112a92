"""Global hypotheses: which leaf of each track each of them holds."""

from __future__ import annotations

from typing import Self

import numpy as np
from attrs import frozen

from vedette import Array, Branching, Indices, Mask, kernels


@frozen(eq=False)
class GlobalHypotheses:
    """Weights (h,) of the hypotheses, which sum to 1, heaviest first; the leaf (h, t) of each track in each, -1: none."""

    weights: Array
    leaves: Indices

    @classmethod
    def of(cls, tracks: int) -> Self:
        """Return the one hypothesis that holds every track, in one leaf each."""
        return cls(np.ones(1), np.arange(tracks)[None])


def branched(hypotheses: GlobalHypotheses, scores: Array, begins: Mask, most: int, least: float) -> Branching:
    """Return the best associations of a scan's returns to the leaves: at most `most`, of weights above `least`.

    A hypothesis of weight w has ceil(w most) of them. A return that no track takes begins one, where it may.
    """
    wanted = np.ceil(most * hypotheses.weights).astype(np.int64)
    origin, choice, gain = kernels.best_joint(scores, hypotheses.leaves, wanted)
    log_weight = gain + np.log(hypotheses.weights)[origin]
    weights = np.exp(log_weight - np.max(log_weight))
    weights /= np.sum(weights)
    heaviest = np.argsort(-weights, kind="stable")[:most]
    heaviest = heaviest[weights[heaviest] > min(least, 0.5 * weights[heaviest[0]])]
    weights, choice, before = weights[heaviest], choice[heaviest], hypotheses.leaves[origin[heaviest]]

    columns = scores.shape[-1]
    leaf, code = _numbered(np.where(before >= 0, before * columns + choice, -1), len(scores) * columns)
    taken = np.zeros((len(weights), columns), dtype=bool)
    taken[np.arange(len(weights))[:, None], choice] = True
    free = begins & ~taken[:, 1:]
    news = np.flatnonzero(free.any(axis=0))
    begun = np.where(free[:, news], len(code) + np.arange(len(news)), -1)
    return Branching(
        parent=np.concatenate([code // columns, np.full(len(news), -1)]),
        choice=np.concatenate([code % columns, 1 + news]),
        hypotheses=GlobalHypotheses(weights / np.sum(weights), np.concatenate([leaf, begun], axis=1)),
    )


def kept(hypotheses: GlobalHypotheses, alive: Mask) -> tuple[GlobalHypotheses, Indices]:
    """Return the hypotheses without the leaves that ended, equal ones merged, and the rows of the leaves that stay."""
    leaves, weights = hypotheses.leaves, hypotheses.weights
    if not alive.all():
        leaves = np.where(np.append(alive, False)[leaves], leaves, -1)
    leaves = leaves[:, (leaves >= 0).any(axis=0)]
    if len(weights) > 1:
        leaves, weights = _merged(np.ascontiguousarray(leaves), weights)
    leaves, rows = _numbered(leaves, len(alive))
    return GlobalHypotheses(weights, leaves), rows


def leaf_probability(hypotheses: GlobalHypotheses) -> Array:
    """Return the probability of each leaf: the weight of the hypotheses that hold it (l,)."""
    leaves = hypotheses.leaves
    weights = np.broadcast_to(hypotheses.weights[:, None], leaves.shape)
    held = leaves >= 0
    return np.bincount(leaves[held], weights[held], int(leaves.max(initial=-1)) + 1).astype(float)


def heaviest(hypotheses: GlobalHypotheses) -> Indices:
    """Return the leaves of the heaviest hypothesis."""
    leaves: Indices = hypotheses.leaves[0]
    return leaves[leaves >= 0]


def _numbered(codes: Indices, count: int) -> tuple[Indices, Indices]:
    """Return codes below `count`, -1 for none, as row numbers in the codes' order, and the code of each row."""
    number = np.zeros(count + 1, dtype=np.int64)
    number[codes] = 1
    number[-1] = 0
    used = np.flatnonzero(number)
    number[used] = np.arange(len(used))
    number[-1] = -1
    return number[codes], used


def _merged(leaves: Indices, weights: Array) -> tuple[Indices, Array]:
    """Return the hypotheses without repetitions, the heaviest first."""
    if leaves.shape[1] == 0:
        return leaves[:1], np.ones(1)
    _, first, which = np.unique(leaves.view(f"V{8 * leaves.shape[1]}").ravel(), return_index=True, return_inverse=True)
    if len(first) == len(weights):
        return leaves, weights
    total = np.bincount(which.ravel(), weights).astype(float)
    order = np.lexsort((first, -total))
    return leaves[first[order]], total[order]
