"""The extended Kalman filter."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Detections, Frame, Gaussian, Innovation, MotionModel, Sensor, fields
from vedette.filters.gaussian import GaussianFilter, linearised, moved


@final
@frozen
class ExtendedKalman(GaussianFilter):
    """Linearises motion and sensor at the current mean; the posterior covariance in Joseph's form.

    P- = F P F' + Q, S = H P- H' + R, K = P- H' S^-1, P+ = (I - K H) P- (I - K H)' + K R K'.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 10.3.
    """

    kind: ClassVar[str] = "ekf"
    exact_when_linear: ClassVar[bool] = True

    motion: MotionModel = fields.part("how the target moves")

    def predict(self, belief: Gaussian, dt: float, rng: np.random.Generator, combined: Gaussian | None = None) -> Gaussian:
        """The belief `dt` s later."""
        return belief if dt == 0 else moved(belief, self.motion, dt, combined, self._memo)

    def evaluate(self, belief: Gaussian, sensor: Sensor, observed: Detections | Frame, p_gate: float) -> Innovation:
        """Every return against every track, linearised at its mean."""
        return linearised(belief, self.state, sensor, observed, p_gate, self._memo)
