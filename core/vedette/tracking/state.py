"""The state of a tracker after a scan."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from attrs import Factory, frozen

from vedette.sampling.seeds import Seed, Seeds
from vedette.space import Array, Indices, Mask
from vedette.tracking import state_data
from vedette.tracking.identity import Names
from vedette.tracking.lineage import Gates, Lineage, lineage
from vedette.types import Gaussian, Pose
from vedette.values import evolver


@frozen(eq=False)
class Look:
    """When a sensor looked last, from where, and after how many s it is to look again: infinitely many if it looked once."""

    time: float
    every: float
    pose: Pose | None


@frozen(eq=False)
class State:
    """The complete state of a tracker after a scan. `t` tracks, oldest first; `*b` runs in lock-step.

    belief is the estimator's, memory the lifecycle's, unseen the birth's. ids (t,), confirmed (*b, t), existence (*b, t);
    weights (*b, t, 1+k), the association probabilities, and squared distances (*b, t, k) are those of the last
    scan. Of many tracks and returns only pairs within gates are kept: `returns` (t, k) then names the return of each column,
    -1 if there is none; else it is None. born counts the tracks ever begun, approximated those whose weights were not exact,
    once a scan; lost is the probability that truncated hypotheses lack of each of these, in sum. The seed and the number of
    steps say what the next step draws: the same, whenever it is taken. Where the associator keeps hypotheses, `leaves` holds
    all that they need, and the tracks are those that are reported; else None. `gates` keeps what `lineage` follows from;
    None where tracks are permanent. `names`: the codes that tracks bear; None where no return named its object.
    `offsets`: mean (*b, q) and covariance (*b, q, q) of what all tracks share, and `linked`: codes of whose
    returns tracks took, by which some tell of it; None if they share nothing. `looks`: the last of each sensor, if there
    are several and tracks may end.
    """

    time: float
    belief: Any
    memory: Any
    unseen: Any
    ids: Indices
    existence: Array
    confirmed: Mask
    weights: Array
    distances: Array
    born: int
    approximated: int
    seed: Seed | Seeds
    steps: int
    leaves: Any
    returns: Indices | None = None
    gates: Gates | None = None
    names: Names | None = None
    lost: float = 0.0
    offsets: Gaussian | None = None
    linked: Indices | None = None
    looks: Mapping[str, Look] = Factory(dict)

    def to_data(self) -> Any:
        """Return the state as plain data, which JSON holds and `Tracker.state_from` reads back to the last bit.

        Raises
        ------
        TypeError : a part of the tracker keeps something else than attrs values, tuples, tables and arrays
        """
        return state_data.written(self)

    @property
    def rows(self) -> Any:
        """What meets a scan: the state itself by its tracks, or where hypotheses are kept their leaves."""
        return self if self.leaves is None else self.leaves

    @property
    def hit(self) -> Array:
        """The probability of having been detected in the last scan (*b, t)."""
        return 1.0 - self.weights[..., 0]

    @property
    def nis(self) -> Array:
        """The squared distance weighted over the last scan's returns (*b, t)."""
        return weighted_distance(self.weights, self.distances)

    @property
    def links(self) -> Array | None:
        """The probability (t,) that the return which a track took and its last before are of one target, NaN without such;
        None where no hypotheses are kept and the belief has no `links`: `weights` has the probabilities then.
        """
        return getattr(self.belief, "links", None) if self.leaves is None else self.leaves.links

    @property
    def identity(self) -> Indices | None:
        """The code (*b, t) that each track most likely bears, -1 for none; None where no return named its object."""
        return None if self.names is None else self.names.borne

    @property
    def lineage(self) -> Lineage | None:
        """The tracks that split and merged in the last scan; None if none did."""
        return None if self.gates is None else lineage(self.gates, self.ids, self.born, self.weights, self.returns)


def weighted_distance(weights: Array, distances: Array) -> Array:
    """Return the squared distances (*b, t, k) of returns, weighted by all of `weights` (*b, t, 1+k) but a miss's."""
    return np.sum(weights[..., 1:] * distances, axis=-1)


next_state = evolver(State)
