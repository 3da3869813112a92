"""Global nearest neighbour."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Associator


@final
@frozen
class GlobalNearest(Associator):
    """Finds the joint assignment of returns to tracks with the largest total score; each return goes to at most one track.

    Every track may be missed, so the problem is always feasible; scipy solves it as a linear assignment.
    Blackman, Popoli, Design and Analysis of Modern Tracking Systems, 1999, section 6.4.
    """

    kind: ClassVar[str] = "gnn"
    exclusive: ClassVar[bool] = True

    @property
    def solves(self) -> str:
        return "best"

    def associate(self, scores: Array, evidence: Array | None) -> Array:
        """Return the association weights: (*b, t, 1+k) -> (*b, t, 1+k), one 1 in each row."""
        from scipy.optimize import linear_sum_assignment

        t, k = scores.shape[-2], scores.shape[-1] - 1
        # An impossible miss is expensive but finite: two tracks that cannot be missed may share one return.
        miss = np.maximum(scores[..., :1], np.max(scores, axis=-1, keepdims=True) - 1e6)
        gain = np.full((*scores.shape[:-1], k + t), -np.inf)
        gain[..., :k] = scores[..., 1:] - miss
        gain[..., range(t), range(k, k + t)] = 0.0
        weights = np.zeros_like(scores)
        for run in np.ndindex(scores.shape[:-2]):
            rows, columns = linear_sum_assignment(gain[run], maximize=True)
            weights[run][rows, np.where(columns < k, columns + 1, 0)] = 1.0
        return weights
