"""Probabilistic data association."""

from __future__ import annotations

from typing import ClassVar, final

from attrs import frozen

from vedette import Array, Associator, kernels


@final
@frozen
class Pda(Associator):
    """Weights every return in the gate by the posterior probability that it is the track's, for each track independently.

    weights = exp(scores) / sum exp(scores). Exact for one target among uniform clutter.
    Bar-Shalom, Tse, Tracking in a Cluttered Environment with Probabilistic Data Association, Automatica 11, 1975.

    >>> import numpy as np
    >>> scores = np.array([[np.log(0.5), np.log(1.5), -np.inf], np.log([3.0, 1.0, 4.0])])
    >>> Pda().associate(scores, None).round(9).tolist()  # of 2, and of 8, whatever the other track takes
    [[0.25, 0.75, 0.0], [0.375, 0.125, 0.5]]
    """

    kind: ClassVar[str] = "pda"
    by_cluster: ClassVar[bool] = True
    solves: ClassVar[str] = "marginals"

    def associate(self, scores: Array, evidence: Array | None) -> Array:
        """Return the association weights: (*b, t, 1+k) -> (*b, t, 1+k)."""
        return kernels.softmax(scores)
