"""What lifecycles that start tracks by themselves share."""

from __future__ import annotations

import numpy as np
from attrs import frozen

from vedette import Array, Gaussian, Lifecycle, Mask, Space, fields


@frozen
class Automatic(Lifecycle):
    """Starts a track at every return that no track explains, with its axes beyond the sensor's spread around 0."""

    spread: dict[str, float] = fields.table("state axis that sensors do not see to its standard deviation in new tracks")
    sensors: tuple[str, ...] = fields.words("sensors whose returns may start tracks; default: all", default=())
    claimed: float = fields.probability("a return that tracks explain more probably starts none", default=0.5, above=0)

    def starts(self, sensor: str, claimed: Array) -> Mask:
        """(k,) -> (k,)"""
        return (claimed < self.claimed) & (not self.sensors or sensor in self.sensors)

    def prior(self, measured: Gaussian, observes: Space, state: Space) -> Gaussian:
        """What was seen, and `spread` on the other axes, uncorrelated."""
        lacking = [name for name in state.names if name not in observes and name not in self.spread]
        if lacking:
            raise ValueError(f"spread: must state the standard deviation of {', '.join(map(repr, lacking))} in new tracks")
        t, n = len(measured.mean), len(state)
        own = state.locate(observes)
        mean, cov = np.zeros((t, n)), np.zeros((t, n, n))
        cov[:, range(n), range(n)] = [self.spread.get(name, 0.0) ** 2 for name in state.names]
        mean[:, own] = measured.mean
        cov[:, np.array(own)[:, None], own] = measured.cov
        return Gaussian(mean, cov)
