"""The state of a tracker after a scan."""

from __future__ import annotations

from typing import Any

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from vedette.sampling.seeds import Seed, Seeds
from vedette.space import Array, Mask
from vedette.tracking.lineage import Gates, Lineage, lineage
from vedette.values import maker


@frozen(eq=False)
class State:
    """The complete state of a tracker after a scan. `t` tracks, oldest first; `*b` runs in lock-step.

    belief is the estimator's, memory the lifecycle's, unseen the birth's. ids (t,), confirmed (*b, t), existence (*b, t);
    weights (*b, t, 1+k), the association probabilities, and squared distances (*b, t, k) are those of the last
    scan. Of many tracks and returns only pairs within gates are kept: `returns` (t, k) then names the return of each column,
    -1 if there is none; else it is None. born counts the tracks ever begun, approximated those whose weights were not exact,
    once a scan. The seed and the number of steps say what the next step draws: the same, whenever it is taken. Where the
    associator keeps hypotheses, `leaves` holds all that they need, and the tracks are those that are reported; else None.
    `gates` keeps what `lineage` follows from; None where tracks are permanent.
    """

    time: float
    belief: Any
    memory: Any
    unseen: Any
    ids: NDArray[np.int64]
    existence: Array
    confirmed: Mask
    weights: Array
    distances: Array
    born: int
    approximated: int
    seed: Seed | Seeds
    steps: int
    leaves: Any
    returns: NDArray[np.int64] | None = None
    gates: Gates | None = None

    @property
    def hit(self) -> Array:
        """The probability of having been detected in the last scan (*b, t)."""
        return 1.0 - self.weights[..., 0]

    @property
    def nis(self) -> Array:
        """The squared distance weighted over the last scan's returns (*b, t)."""
        total: Array = np.sum(self.weights[..., 1:] * self.distances, axis=-1)
        return total

    @property
    def lineage(self) -> Lineage | None:
        """The tracks that split and merged in the last scan; None if none did."""
        return None if self.gates is None else lineage(self.gates, self.ids, self.born, self.weights, self.returns)


new_state = maker(State)
