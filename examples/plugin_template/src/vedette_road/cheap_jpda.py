"""Joint association of many tracks for little work."""

import numpy as np
from attrs import frozen

import vedette


@frozen
class CheapJPDA(vedette.Associator):
    """Weights g / (sum of the row + sum of the column - g + 1), where g is a return's likelihood over that of a miss.

    Those of PDA for a track that shares no return; in total no return is given away more than once, and no enumeration is
    needed. Fitzgerald, Development of Practical PDA Logic for Multitarget Tracking by Microprocessor, Proc. American Control
    Conference, 1986.
    """

    kind = "cheap_jpda"
    exclusive = True

    def associate(self, scores, evidence):
        best = np.max(scores, axis=-1, keepdims=True)
        miss = np.maximum(scores[..., :1], best - 500.0)  # exp(500) leaves room for sums
        g = np.exp(scores[..., 1:] - miss)
        claimed = g / (g.sum(axis=-1, keepdims=True) + g.sum(axis=-2, keepdims=True) - g + 1.0)
        return np.concatenate([1.0 - claimed.sum(axis=-1, keepdims=True), claimed], axis=-1).clip(0.0)
