"""What the best joint associations of a cluster leave out."""

from __future__ import annotations

import numpy as np

from vedette import Array, Mask
from vedette.hypotheses import LOST, best_marginals_of_table


def left_out(scores: Array, m: int) -> Mask:
    """Return the tracks of clusters whose associations beyond the `m` best are too probable: (*b, t, 1+k) -> (*b, t)."""
    if np.max(np.prod(1.0 + np.isfinite(scores[..., 1:]).sum(axis=-1), axis=-1), initial=0.0) <= m:
        return np.zeros(scores.shape[:-1], dtype=bool)
    return best_marginals_of_table(scores, m)[1] > LOST
