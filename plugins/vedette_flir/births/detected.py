"""Tracks that start where a detector found a target in a frame."""

from __future__ import annotations

from typing import Any, ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Birth, Detections, Estimator, Gaussian, Newborn, Sensor, fields


@final
@frozen
class Detected(Birth):
    """Starts a track at every detected box that no track claims; it is confirmed as the frames after it show the target.

    Position and box are those detected, with R of the sensor for the position; axes without variance get none. The other
    axes are 0 with the standard deviations in `spread`. A track starts with existence `initial`, which the estimator's
    evidence raises or lowers from then on.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 5.5.

    >>> from vedette import Detections
    >>> from vedette_flir.motion.constant_axes import Carrying
    >>> from vedette_flir.motion.image_velocity import ImageVelocity
    >>> from vedette_flir.sensors.detected_box import DetectedBox
    >>> from vedette_standard import Kalman
    >>> birth = Detected({"vx": 6.0, "vy": 7.0}, sensors=("detector",), claimed=0.2, initial=0.3)
    >>> estimator = Kalman(Carrying(ImageVelocity(), {"width": "px", "height": "px"}))  # a box has no variance
    >>> z = [[10.0, 20.0, 30.0, 40.0], [50.0, 60.0, 7.0, 8.0], [90.0, 9.0, 9.0, 9.0], [1.0, 2.0, 3.0, 4.0]]
    >>> seen = Detections(z, [True, True, False, True], missing=[[False] * 4] * 3 + [[False, False, True, False]])
    >>> claimed = np.array([0.19, 0.2, 0.0, 0.0])
    >>> new = birth.begin(None, estimator, DetectedBox(3.0), "detector", seen, claimed)
    >>> new.returns.tolist(), new.prior.mean.tolist(), new.existence.tolist(), birth.initial_existence
    ([0], [[10.0, 20.0, 0.0, 0.0, 30.0, 40.0]], [0.3], 0.3)
    >>> new.prior.cov[0].tolist() == np.diag([9.0, 9.0, 36.0, 49.0, 0.0, 0.0]).tolist()
    True
    >>> birth.starts_from("detector"), birth.starts_from("camera")
    (True, False)
    """

    kind: ClassVar[str] = "detected"

    spread: dict[str, float] = fields.table("axis that is not detected to its standard deviation in a new track", at_least=0)
    sensors: tuple[str, ...] = fields.words("sensors whose boxes may start tracks; default: all", default=())
    claimed: float = fields.probability(
        "a box is left alone if it is a track's with at least this probability; a new one exists with little",
        default=0.01,
        above=0,
    )
    initial: float = fields.probability("probability that a new track is of a target", default=0.1, above=0, below=1)

    @property
    def initial_existence(self) -> float:
        """Return `initial`."""
        return self.initial

    def begin(
        self, seen: Any, estimator: Estimator[Any], sensor: Sensor, name: str, detections: Detections, claimed: Array
    ) -> Newborn:
        """Return a track at each box that no track claims."""
        returns = np.flatnonzero(detections.complete & (claimed < self.claimed))
        names, count = estimator.state.names, len(returns)
        lacking = [axis for axis in names if axis not in sensor.observes and axis not in self.spread]
        if lacking:
            raise ValueError(f"spread: must state the standard deviation of {', '.join(map(repr, lacking))} in new tracks")
        spot = sensor.invert(detections.z[returns], detections.noise_of(returns))
        located = estimator.state.locate(sensor.observes)
        mean, cov = np.zeros((count, len(names))), np.zeros((count, len(names), len(names)))
        cov[:, range(len(names)), range(len(names))] = [self.spread.get(axis, 0.0) ** 2 for axis in names]
        mean[:, located], cov[:, np.array(located)[:, None], located] = spot.mean, spot.cov
        still = estimator.state.locate(estimator.zero_variance)
        cov[:, still, :] = cov[:, :, still] = 0.0
        return Newborn(returns, Gaussian(mean, cov), np.full(count, self.initial))
