"""The unscented Kalman filter."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Detections, Frame, Gaussian, ImagingSensor, Innovation, MotionModel, Sensor, fields, kernels
from vedette.filters.gaussian import (
    GaussianFilter,
    among_present,
    joined,
    keeps_its_frame,
    missing_share,
    noise_of,
    reported,
    residuals,
)


@final
@frozen
class UnscentedKalman(GaussianFilter):
    """Moves 2n+1 points of the belief through motion and sensor and takes their moments; the noises are additive.

    Points: the mean, and the mean +- the columns of the Cholesky factor of (n + kappa) P, weights kappa / (n + kappa) and
    1 / (2 (n + kappa)). kappa >= 0, so that every weight is positive and every covariance PSD by construction.
    Julier, Uhlmann, Unscented Filtering and Nonlinear Estimation, Proc. IEEE 92, 2004.
    """

    kind: ClassVar[str] = "ukf"
    exact_when_linear: ClassVar[bool] = True

    motion: MotionModel = fields.part("how the target moves")
    kappa: float = fields.quantity("1", "weight of the central point, times n + kappa", default=1.0, at_least=0)

    def refuses(self, sensor: Sensor) -> str | None:
        """Cameras."""
        return "it takes no frames: use the estimator 'ekf' or 'iekf'" if isinstance(sensor, ImagingSensor) else None

    def _offsets(self, belief: Gaussian) -> tuple[Array, Array]:
        """Offsets from the mean (*b, t, s, n) and weights (s,); zero-variance axes have no variance: their offsets are 0."""
        free = [i for i, axis in enumerate(self.state.axes) if axis.name not in self.zero_variance]
        spread, weights = kernels.sigma_points(belief.cov[..., free, :][..., free], self.kappa)
        offsets = np.zeros((*spread.shape[:-1], len(self.state)))
        offsets[..., free] = spread
        return offsets, weights

    def predict(self, belief: Gaussian, dt: float, rng: np.random.Generator, combined: Gaussian | None = None) -> Gaussian:
        """The belief `dt` s later; the noise is taken at the mean."""
        if dt == 0:
            return belief
        belief = self.motion.reframe(belief, belief if combined is None else combined)
        offsets, weights = self._offsets(belief)
        points = self.state.displace(belief.mean[..., None, :], offsets)
        mean, apart = self.state.mean(self.motion.move(points, dt), weights)
        spread = np.swapaxes(apart * weights[:, None], -1, -2) @ apart
        return Gaussian(mean, kernels.symmetric(spread) + self.motion.noise(belief.mean, dt))

    def cross_covariance(self, belief: Gaussian, dt: float) -> Array:
        """Covariance of the points and of where they move: (*b, t, n, n)"""
        keeps_its_frame(self.motion)
        offsets, weights = self._offsets(belief)
        points = self.state.displace(belief.mean[..., None, :], offsets)
        _, apart = self.state.mean(self.motion.move(points, dt), weights)
        return np.swapaxes(offsets * weights[:, None], -1, -2) @ apart

    def evaluate(self, belief: Gaussian, sensor: Sensor, observed: Detections | Frame, p_gate: float) -> Innovation:
        """Every return against every track, by the moments of the points' measurements."""
        assert isinstance(observed, Detections)
        where = self.state.locate(sensor.observes)
        dx, weights = self._offsets(belief)
        points = self.state.displace(belief.mean[..., None, :], dx)
        expected, dz = sensor.measurement.mean(sensor.measure(points[..., where]), weights)
        nu = residuals(sensor, observed, expected)
        x = belief.mean[..., where]
        R = noise_of(sensor, observed, x)
        if observed.missing is None:
            return joined(sensor, x, p_gate, kernels.evaluate_points(dx, dz, weights, nu, R))
        there = reported(observed)
        nu, dz = np.where(there, nu, 0.0), dz[..., None, :, :] * there[..., None, :]
        R = among_present(R, there)
        parts = kernels.evaluate_points(dx[..., None, :, :], dz, weights, nu[..., None, :], R[..., None, :, :])
        loglik, distance, log_volume, shift, post = parts
        loglik = loglik[..., 0] + missing_share(there)
        own = (loglik, distance[..., 0], log_volume[..., 0], shift[..., 0, :], post[..., 0, :, :])
        return joined(sensor, x, p_gate, own)
