"""The Kalman filter."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import (
    Array,
    Detections,
    Frame,
    Gaussian,
    Innovation,
    MotionModel,
    Sensor,
    Traits,
    fields,
    kernels,
    new_gaussian,
)
from vedette.filters import GaussianFilter, evaluate_linearised, extent_linearised, scan_step_linearised
from vedette.roles import GatedScan


@final
@frozen
class Kalman(GaussianFilter):
    """Exact for linear models with Gaussian noise; it refuses models that do not declare themselves linear.

    x- = F x, P- = F P F' + Q, S = H P- H' + R, K = P- H' S^-1, P+ = (I - K H) P- (I - K H)' + K R K'.
    Kalman, A New Approach to Linear Filtering and Prediction Problems, J. Basic Engineering 82, 1960.
    """

    kind: ClassVar[str] = "kalman"
    abbreviations: ClassVar[tuple[str, ...]] = ("kf", "information")
    declares: ClassVar[Traits] = Traits(exact_when_linear=True, takes_frames=True, bounded=True)
    linearises: ClassVar[bool] = True

    motion: MotionModel = fields.part("how the target moves; a linear model")

    def __attrs_post_init__(self) -> None:
        if not self.motion.linear:
            raise ValueError(f"motion {self.motion.kind!r} is not linear: use the estimator 'ekf' or 'ukf' with it")

    def refuses(self, sensor: Sensor) -> str | None:
        """Refuse sensors that are not linear."""
        return None if sensor.linear else f"it is not linear: use the estimator 'ekf' or 'ukf' with {sensor.kind!r}"

    def predict(self, belief: Gaussian, dt: float, rng: np.random.Generator) -> Gaussian:
        """Return the belief `dt` s later."""
        if dt == 0:
            return belief
        x, memo = belief.mean, self._memo
        F, Q, periods = memo.steps.get(dt) or memo.step(self.motion, x, dt)
        ahead = kernels.predict(x, belief.cov, F, Q)
        return new_gaussian(self.state.canonical(ahead.mean), ahead.cov) if periods else ahead

    def evaluate(self, belief: Gaussian, sensor: Sensor, observed: Detections | Frame, p_gate: float) -> Innovation:
        """Return the innovation of each track."""
        return evaluate_linearised(belief, self.motion.state, sensor, observed, p_gate, self._memo)

    def scan_step(self, belief: Gaussian, scan: GatedScan) -> tuple[Gaussian, Array, Array] | None:
        """Return what a scan makes of runs of one track, in one kernel where the models are such."""
        return scan_step_linearised(belief, self.motion, scan, self._memo)

    def extent(self, belief: Gaussian, sensor: Sensor, detections: Detections, limit: float) -> tuple[Array, Array]:
        """Return the box around each track's gate."""
        return extent_linearised(belief, self.motion.state, sensor, detections, limit, self._memo)
