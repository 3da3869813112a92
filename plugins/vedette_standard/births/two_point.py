"""Tracks that start at the returns of two scans."""

from __future__ import annotations

from typing import Any, ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Detections, Estimator, Gaussian, Indices, Sensor
from vedette_standard.births.following import Following, Waiting, nothing, pairs, spots


@final
@frozen
class TwoPoint(Following):
    """Starts a track at a return that a target of up to `max_speed` can have reached from one of the scan before.

    z2 and z1, dt apart, give the position z2 and the velocity (z2 - z1) / dt, with the covariances R2, (R1 + R2) / dt^2 and
    R2 / dt between them: two-point differencing. Both returns belong to no track; of several earlier ones the nearest
    counts. Other axes are 0 with the standard deviations in `spread`.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 5.5.3.
    """

    kind: ClassVar[str] = "two_point"

    def followers(self, now: Gaussian, memory: Waiting, limit: Array) -> tuple[Indices, Gaussian]:
        """Return which positions follow one of the scan before."""
        return pairs(now, memory, limit, self.deviations)

    def update(
        self,
        memory: Waiting | None,
        estimator: Estimator[Any],
        sensor: Sensor,
        detections: Detections,
        claimed: Array,
        p_gate: float,
    ) -> Waiting:
        """Return this scan's returns that no track claims."""
        rows = self.left_over(detections, claimed)
        if not len(rows):
            return nothing(len(sensor.observes))
        spot = spots(sensor, detections, rows)
        return Waiting(spot.mean, spot.cov, np.asarray(0.0))
