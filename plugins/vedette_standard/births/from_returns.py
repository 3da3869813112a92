"""Tracks that start at single returns."""

from __future__ import annotations

from typing import Any, ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Birth, Detections, Estimator, Newborn, Sensor, fields
from vedette_standard.births.one_point import one_point, unclaimed, within
from vedette_standard.regions import Polygon


@final
@frozen
class FromReturns(Birth):
    """Starts a track at every return that belongs to no existing track: one-point initiation.

    The axes that the sensor observes have the mean and covariance of the return, from `Sensor.invert`; the others are 0 with
    the standard deviations in `spread`, uncorrelated. `initial` is the share of unclaimed returns that are of new targets;
    many false returns make it small. Of twelve drawn targets, P_D .5 and 100 false returns a scan, GOSPA by `k_best` is 65
    to 77 m with .2, 37 to 46 m with .05.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 5.5.

    >>> from vedette import Detections
    >>> from vedette_standard import CartesianPosition, ConstantVelocity, Kalman
    >>> from vedette_standard.regions import Polygon
    >>> here = Polygon([[-99.0, -99.0], [99.0, -99.0], [99.0, 99.0], [-99.0, 99.0]])
    >>> birth = FromReturns({"vx": 6.0, "vy": 7.0}, sensors=("radar",), claimed=0.4, initial=0.3, appears_in=(here,))
    >>> z, R = [[10.0, 20.0], [30.0, 40.0], [50.0, 60.0], [500.0, 0.0]], [[4.0, 1.0], [1.0, 9.0]]
    >>> seen = Detections(z, [True, True, False, True], noise=[R] * 4)  # of a track; padding; outside of the area
    >>> claimed = np.array([0.39, 0.4, 0.0, 0.0])
    >>> new = birth.begin(None, Kalman(ConstantVelocity(0.5)), CartesianPosition(3.0), "radar", seen, claimed)
    >>> new.returns.tolist(), new.prior.mean.tolist(), new.existence.tolist()  # over x, y, vx, vy
    ([0], [[10.0, 20.0, 0.0, 0.0]], [0.3])
    >>> new.prior.cov[0].tolist()
    [[4.0, 1.0, 0.0, 0.0], [1.0, 9.0, 0.0, 0.0], [0.0, 0.0, 36.0, 0.0], [0.0, 0.0, 0.0, 49.0]]
    >>> birth.starts_from("radar"), birth.starts_from("camera"), birth.initial_existence
    (True, False, 0.3)
    """

    kind: ClassVar[str] = "from_returns"

    spread: dict[str, float] = fields.table(
        "state axis that the sensors do not observe to its standard deviation in a new track", at_least=0
    )
    sensors: tuple[str, ...] = fields.words("sensors whose returns may start tracks; default: all", default=())
    claimed: float = fields.probability(
        "a return is left alone if it comes from a track with at least this probability", default=0.5, above=0
    )
    initial: float = fields.probability("probability that a new track is of a target", default=0.2, above=0)
    appears_in: tuple[Polygon, ...] = fields.part(
        "areas outside of which no track starts; default: everywhere", default=(), tried=((),)
    )

    @property
    def initial_existence(self) -> float:
        """Return `initial`."""
        return self.initial

    def begin(
        self, seen: Any, estimator: Estimator[Any], sensor: Sensor, name: str, detections: Detections, claimed: Array
    ) -> Newborn:
        """Return a track at each complete return that no track claims."""
        returns = unclaimed(detections, claimed, self.claimed)
        if len(claimed) and not len(returns):
            return Newborn.none(len(estimator.state))
        prior = one_point(sensor, detections, returns, self.spread, estimator.state)
        begin = Newborn(returns, prior, np.full(len(returns), self.initial))
        return within(self.appears_in, begin, estimator.state)
