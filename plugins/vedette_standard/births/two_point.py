"""Tracks that start at the returns of two scans."""

from __future__ import annotations

from typing import ClassVar, final

from attrs import frozen

from vedette import Array, Gaussian, Indices, Sensor
from vedette_standard.births.following import Following, Waiting, pairs


@final
@frozen
class TwoPoint(Following):
    """Starts a track at a return that a target of up to `max_speed` can have reached from one of the scan before.

    z2 and z1, dt apart, give the position z2 and the velocity (z2 - z1) / dt, with the covariances R2, (R1 + R2) / dt^2 and
    R2 / dt between them: two-point differencing. Both returns belong to no track; of several earlier ones the nearest
    counts. Other axes are 0 with the standard deviations in `spread`.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 5.5.3.

    >>> import numpy as np
    >>> from vedette import Detections
    >>> from vedette_standard import CartesianPosition, ConstantAcceleration, Kalman
    >>> others = {"spread": {"ax": 0.5, "ay": 0.7}, "claimed": 0.4, "initial": 0.3, "deviations": 2.0}
    >>> birth = TwoPoint(10.0, sensor_speeds={"slow": 2.0}, class_speeds=[3.0, 99.0], **others)
    >>> sensor, estimator = CartesianPosition(3.0), Kalman(ConstantAcceleration(0.1))
    >>> seen = Detections.of([[0.0, 0.0], [8.0, 0.0], [0.0, 100.0], [0.0, 300.0]])
    >>> memory = birth.update(None, estimator, sensor, seen, np.array([0.0, 0.0, 0.0, 0.4]), 1.0)
    >>> memory = birth.predict(memory, estimator, 2.0, None)
    >>> z = [[36.4, 0.0], [28.6, 100.0], [3.0, 300.0], [1.0, 1.0], [0.0, 115.0], [0.0, 85.6]]
    >>> seen = Detections(z, [True] * 6, identity=[-1, 1, 1, 1, 0, 0])  # up to 10 m/s 2 s + 2 sqrt(9 + 9) m, of class 0 less
    >>> claimed = np.array([0.39, 0.0, 0.0, 0.4, 0.0, 0.0])
    >>> new = birth.begin(memory, estimator, sensor, "radar", seen, claimed)
    >>> new.returns.tolist(), new.existence.tolist(), new.prior.mean[:, :4].round(9).tolist()
    ([0, 5], [0.3, 0.3], [[36.4, 0.0, 14.2, 0.0], [0.0, 85.6, 0.0, -7.2]])
    >>> along = np.array([[9.0, 4.5, 0.0], [4.5, 4.5, 0.0], [0.0, 0.0, 0.25]])  # R2, R2 / dt; R2 / dt, (R1 + R2) / dt^2
    >>> np.allclose(new.prior.cov[0][::2, ::2], along), np.allclose(np.diag(new.prior.cov[0]), [9, 9, 4.5, 4.5, 0.25, 0.49])
    (True, True)
    >>> birth.begin(memory, estimator, sensor, "slow", seen, claimed).returns.tolist()  # no more than 12.49 m
    []
    """

    kind: ClassVar[str] = "two_point"

    def followers(self, now: Gaussian, memory: Waiting, limit: Array) -> tuple[Indices, Gaussian]:
        """Return which positions follow one of the scan before."""
        return pairs(now, memory.earlier, limit, self.deviations)

    def remembered(self, memory: Waiting | None, now: Waiting, sensor: Sensor, limit: Array) -> Waiting:
        """Return this scan's returns, and those before that its sensor could not have seen again."""
        return now if memory is None else memory.outlasting(sensor).and_now(now)
