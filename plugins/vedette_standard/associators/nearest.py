"""Nearest neighbour."""

from __future__ import annotations

from typing import ClassVar, final

from attrs import frozen

from vedette import Array, Associator, kernels


@final
@frozen
class Nearest(Associator):
    """Gives each track its best return, or a miss where that scores higher, whatever the other tracks take.

    Bar-Shalom, Li, Multitarget-Multisensor Tracking, 1995, section 3.2.

    >>> import numpy as np
    >>> scores = np.array([[-2.0, 1.0, 0.9], [-3.0, 2.0, -1.0], [0.5, 0.4, -np.inf]])  # two take one return, one is missed
    >>> Nearest().associate(scores, None).tolist()
    [[0.0, 1.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]
    """

    kind: ClassVar[str] = "nearest"
    abbreviations: ClassVar[tuple[str, ...]] = ("nn",)
    by_cluster: ClassVar[bool] = True
    decides: ClassVar[bool] = True
    solves: ClassVar[str] = "best"

    def associate(self, scores: Array, evidence: Array | None) -> Array:
        """Return the association weights: (*b, t, 1+k) -> (*b, t, 1+k), one 1 in each row."""
        return kernels.one_hot(scores)
