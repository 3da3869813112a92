"""The iterated extended Kalman filter."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Detections, Frame, Gaussian, Innovation, MotionModel, Sensor, fields, kernels
from vedette.gaussian import GaussianFilter, imaged, linearised


@final
@frozen
class IteratedKalman(GaussianFilter):
    """Linearises a frame anew at what the last pass found: x_i+1 = x- + P+ C' [g_i + J_i (C x_i - C x-)].

    With one pass it is the extended Kalman filter in information form, P+ = (P-^-1 + C' J C)^-1, which is inconsistent
    where the prediction errs by as much as the spot is wide; three or four passes reach the bound. Returns other than
    frames are linearised once.
    Bell, Cathey, The Iterated Kalman Filter Update as a Gauss-Newton Method, IEEE T-AC 38, 1993.
    """

    kind: ClassVar[str] = "iterated_ekf"
    exact_when_linear: ClassVar[bool] = True

    motion: MotionModel = fields.part("how the target moves")
    passes: int = fields.integer("linearisations of a frame, at most", default=3, at_least=1, at_most=50)

    def predict(self, belief: Gaussian, dt: float, rng: np.random.Generator, combined: Gaussian | None = None) -> Gaussian:
        """The belief `dt` s later."""
        if dt == 0:
            return belief
        belief = self.motion.settle(belief, belief if combined is None else combined)
        x = belief.mean
        cov = kernels.propagate(belief.cov, self.motion.jacobian(x, dt), self.motion.noise(x, dt))
        return Gaussian(self.motion.move(x, dt), cov)

    def innovate(self, belief: Gaussian, sensor: Sensor, seen: Detections | Frame, p_gate: float) -> Innovation:
        """Every return against every track; a frame in several passes."""
        if isinstance(seen, Frame):
            return imaged(belief, self.state, sensor, seen, p_gate, self.passes)
        return linearised(belief, self.state, sensor, seen, p_gate)
