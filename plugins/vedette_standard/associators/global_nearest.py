"""Global nearest neighbour."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Associator, kernels


@final
@frozen
class GlobalNearest(Associator):
    """Finds the joint assignment of returns to tracks with the largest total score; each return goes to at most one track.

    Every track may be missed, so the problem is always feasible. Where the tracks' best returns differ, they are
    the solution; else it is a linear assignment.
    Blackman, Popoli, Design and Analysis of Modern Tracking Systems, 1999, section 6.4.

    >>> import numpy as np
    >>> inf, one = np.inf, GlobalNearest()
    >>> one.associate(np.array([[-2.0, 1.0, 0.9], [-3.0, 2.0, -1.0]]), None).tolist()  # .9 + 2 is more than 1 - 1
    [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]
    >>> one.associate(np.array([[[-1.0, 1.0], [-2.0, 1.5]], [[0.5, 0.4], [-inf, -9.0]]]), None).tolist()  # -1 + 1.5; .5 - 9
    [[[1.0, 0.0], [0.0, 1.0]], [[1.0, 0.0], [0.0, 1.0]]]
    """

    kind: ClassVar[str] = "gnn"
    abbreviations: ClassVar[tuple[str, ...]] = ("gnnf",)
    by_cluster: ClassVar[bool] = True
    decides: ClassVar[bool] = True
    exclusive: ClassVar[bool] = True
    solves: ClassVar[str] = "best"

    def associate(self, scores: Array, evidence: Array | None) -> Array:
        """Return the association weights: (*b, t, 1+k) -> (*b, t, 1+k), one 1 in each row."""
        weights = kernels.one_hot(scores)
        contested = np.any(np.sum(weights[..., 1:], axis=-2) > 1.0, axis=-1)
        for run in map(tuple, np.argwhere(contested)):
            weights[run] = _assigned(scores[run])
        return weights


def _assigned(scores: Array) -> Array:
    """Return the weights (t, 1+k) of the best joint assignment: of returns to tracks where there are fewer returns."""
    # An impossible miss is expensive but finite: two tracks that cannot be missed may share one return.
    miss = np.maximum(scores[:, :1], np.max(scores, axis=-1, keepdims=True) - 1e6)
    cost = miss - scores[:, 1:]
    few = cost.T if len(cost) > cost.shape[1] else cost
    n, m = few.shape
    columns = kernels.k_best(np.hstack([few, np.where(np.eye(n), 0.0, np.inf)]), 1)[0][0]
    taken = np.zeros((n, m))
    taken[columns < m, columns[columns < m]] = 1.0
    weights = np.empty_like(scores)
    weights[:, 1:] = taken if few is cost else taken.T
    weights[:, 0] = 1.0 - weights[:, 1:].sum(axis=-1)
    return weights
