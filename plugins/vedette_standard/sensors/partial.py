"""A sensor whose returns may lack components."""

from __future__ import annotations

from typing import ClassVar, final

from attrs import frozen

from vedette import Sensor, Twin, WrappedSensor, fields


@final
@frozen
class Partial(WrappedSensor):
    """A sensor of which some components may be missing from a return, as `Detections.missing` states.

    Such a return is scored by, and updates with, the components that it has. `optional` states the interval over which
    clutter is uniform on each axis that may be missing, independently of the others: over the remaining axes, the density
    is larger by this factor. Whether a component is missing is independent of target and clutter. Such returns start
    tracks with the birth 'poisson' alone. Little, Rubin, Statistical Analysis with Missing Data, 2002 (what is missing at
    random leaves the rest its likelihood).

    >>> import numpy as np
    >>> from vedette import Detections, Gaussian
    >>> from vedette_standard import Kalman, PositionVelocity, ConstantVelocity
    >>> sensor = Partial(PositionVelocity(6.0, 0.5, 0.8), optional={"vx": 40.0, "vy": 50.0})
    >>> estimator, P = Kalman(ConstantVelocity(0.5)), np.diag([64.0, 13.0, 2.0, 3.0])
    >>> belief = estimator.start(Gaussian(np.zeros((1, 4)), P[None]), estimator.state, None)
    >>> seen = Detections([[10.0, 7.0, 0.0, 0.0]], [True], missing=[[False, False, True, True]])  # no velocity
    >>> loglik = estimator.evaluate(belief, sensor, seen, 1.0).loglik[0, 1]
    >>> np.allclose(loglik, np.log(0.8 / (2.0 * np.pi * 70.0)) - 0.5 * (100.0 / 100.0 + 49.0 / 49.0)), sensor.optional["vx"]
    (True, 40.0)
    """

    kind: ClassVar[str] = "partial"

    of: Sensor = fields.part("the sensor that reports all components")
    optional: dict[str, float] = fields.table("axis that may be missing to the length over which clutter spreads there")

    @property
    def twin(self) -> Twin | None:
        """That of `of`, for returns that lack nothing."""
        return self.of.twin

    def __attrs_post_init__(self) -> None:
        known = self.of.measurement
        for name, length in self.optional.items():
            if name not in known:
                raise ValueError(f"optional.{name}: must be one of {', '.join(known.names)}")
            if length <= 0:
                raise ValueError(f"optional.{name}: must be > 0, got {length:g}")
        if len(self.optional) == len(known):
            raise ValueError(f"optional: must leave one of {', '.join(known.names)} that is always reported")
