"""The cubature Kalman filter."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import Factory, field, frozen

from vedette import Array, Detections, Frame, Gaussian, Innovation, MotionModel, Sensor, fields
from vedette.filters.gaussian import GaussianFilter
from vedette_standard.estimators.unscented import UnscentedKalman


@final
@frozen
class CubatureKalman(GaussianFilter):
    """Moves the 2n points mean +- sqrt(n) columns of the Cholesky factor of P, weights 1/(2n), and takes their moments.

    The rule is exact for polynomials up to the third degree. It is the unscented filter without a central point, kappa = 0,
    and is computed so.
    Arasaratnam, Haykin, Cubature Kalman Filters, IEEE Trans. Automatic Control 54, 2009.
    """

    kind: ClassVar[str] = "ckf"
    exact_when_linear: ClassVar[bool] = True

    motion: MotionModel = fields.part("how the target moves")
    _points: UnscentedKalman = field(
        init=False, repr=False, eq=False, default=Factory(lambda self: UnscentedKalman(self.motion, 0.0), takes_self=True)
    )

    def refuses(self, sensor: Sensor) -> str | None:
        """What the unscented filter refuses."""
        return self._points.refuses(sensor)

    def predict(self, belief: Gaussian, dt: float, rng: np.random.Generator, combined: Gaussian | None = None) -> Gaussian:
        """The belief `dt` s later."""
        return self._points.predict(belief, dt, rng, combined)

    def cross_covariance(self, belief: Gaussian, dt: float) -> Array:
        """Covariance of the points and of where they move: (*b, t, n, n)"""
        return self._points.cross_covariance(belief, dt)

    def evaluate(self, belief: Gaussian, sensor: Sensor, observed: Detections | Frame, p_gate: float) -> Innovation:
        """Every return against every track, by the moments of the points' measurements."""
        return self._points.evaluate(belief, sensor, observed, p_gate)
