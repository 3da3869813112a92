"""Tracks that start at single returns."""

from __future__ import annotations

from typing import Any, ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Birth, Detections, Estimator, Gaussian, Newborn, Sensor, fields


@final
@frozen
class FromReturns(Birth):
    """Starts a track at every return that no existing track explains: one-point initiation.

    The axes that the sensor observes have the mean and covariance of the return, from `Sensor.invert`; the others are 0 with
    the standard deviations in `spread`, uncorrelated.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 5.5.
    """

    kind: ClassVar[str] = "from_returns"

    spread: dict[str, float] = fields.table(
        "state axis that the sensors do not observe to its standard deviation in a new track"
    )
    sensors: tuple[str, ...] = fields.words("sensors whose returns may start tracks; default: all", default=())
    claimed: float = fields.probability(
        "a return is left alone if it comes from a track with at least this probability", default=0.5, above=0
    )
    initial: float = fields.probability("probability that a new track is of a target", default=0.2, above=0)

    def starts_from(self, sensor: str) -> bool:
        """Return whether `sensor` is one of `sensors`."""
        return not self.sensors or sensor in self.sensors

    def begin(
        self, seen: Any, estimator: Estimator[Any], sensor: Sensor, name: str, detections: Detections, claimed: Array
    ) -> Newborn:
        """Return a track at each complete return that no track claims."""
        start = (claimed < self.claimed) & detections.valid
        if detections.missing is not None:
            start &= ~detections.missing.any(axis=-1)
        returns = np.flatnonzero(start)
        noise = None if detections.noise is None else detections.noise[returns]
        spot, state = sensor.invert(detections.z[returns], noise), estimator.state
        lacking = [axis for axis in state.names if axis not in sensor.observes and axis not in self.spread]
        if lacking:
            raise ValueError(f"spread: must state the standard deviation of {', '.join(map(repr, lacking))} in new tracks")
        count, n, own = len(returns), len(state), state.locate(sensor.observes)
        mean, cov = np.zeros((count, n)), np.zeros((count, n, n))
        cov[:, range(n), range(n)] = [self.spread.get(axis, 0.0) ** 2 for axis in state.names]
        mean[:, own] = spot.mean
        cov[:, np.array(own)[:, None], own] = spot.cov
        return Newborn(returns, Gaussian(mean, cov), np.full(count, self.initial))
