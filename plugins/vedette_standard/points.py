"""Filters that propagate a belief through motion and sensor by points: the unscented filter and its relatives."""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar

import numpy as np
from attrs import frozen

from vedette import Array, Detections, Frame, Gaussian, Innovation, Sensor, kernels
from vedette.filters import GaussianFilter, gate_box, make_innovation, noise_over, predict_linearised, prepare
from vedette.types import Hypotheses


@frozen
class PointFilter(GaussianFilter):
    """A Gaussian filter that predicts and evaluates by the moments of 2n+1 points; the noises are additive.

    Points: the mean, and the mean +- the columns of the Cholesky factor of (n + kappa) P, weights kappa / (n + kappa) and
    1 / (2 (n + kappa)), n counting the axes with variance. kappa >= 0 makes every weight positive and every covariance PSD.
    """

    linearises: ClassVar[bool] = True

    @property
    @abstractmethod
    def kappa(self) -> float:
        """Weight of the central point, times n + kappa."""

    def offsets(self, belief: Gaussian) -> tuple[Array, Array]:
        """Return the points' offsets from the mean (*b, t, s, n), 0 on axes without variance, and their weights (s,)."""
        memo = self._memo
        _, fixed = memo.frame or memo.framed(self.motion)
        if not fixed:
            return kernels.sigma_points(belief.cov, self.kappa)
        free = [i for i in range(len(self.state)) if i not in fixed]
        spread, weights = kernels.sigma_points(belief.cov[..., free, :][..., free], self.kappa)
        offsets = np.zeros((*spread.shape[:-1], len(self.state)))
        offsets[..., free] = spread
        return offsets, weights

    def predict(self, belief: Gaussian, dt: float, rng: np.random.Generator) -> Gaussian:
        """Return the belief `dt` s later; of a linear motion the points' moments are F x and F P F' + Q."""
        if dt == 0:
            return belief
        if self.motion.linear:
            return predict_linearised(belief, self.motion, dt, self._memo)
        offsets, weights = self.offsets(belief)
        twin, periods = self._memo.moving or self._memo.twin(self.motion)
        if twin is not None:
            x, numbers = belief.mean, twin.numbers(belief.mean, dt)
            ahead = kernels.predict_points_twin(x, offsets, weights, dt, twin.function, numbers, periods)
            if ahead is not None:
                return ahead
        points = self.state.displace(belief.mean[..., None, :], offsets)
        mean, apart = self.state.mean(self.motion.move(points, dt), weights)
        spread = np.swapaxes(apart * weights[:, None], -1, -2) @ apart
        return Gaussian(mean, kernels.symmetric(spread) + self.motion.mean_noise(belief.mean, belief.cov, dt))

    def cross_covariance(self, belief: Gaussian, dt: float) -> Array:
        """Return the covariance (*b, t, n, n) between the points and their predictions."""
        offsets, weights = self.offsets(belief)
        points = self.state.displace(belief.mean[..., None, :], offsets)
        _, apart = self.state.mean(self.motion.move(points, dt), weights)
        return np.swapaxes(offsets * weights[:, None], -1, -2) @ apart

    def extent(self, belief: Gaussian, sensor: Sensor, detections: Detections, limit: Array | float) -> tuple[Array, Array]:
        """Return the box around each track's gate, by the moments of the points' measurements."""
        where, (dx, weights) = self.state.locate(sensor.observes), self.offsets(belief)
        points = self.state.displace(belief.mean[..., None, :], dx)
        centre, dz = sensor.measurement.mean(sensor.measure(points[..., where]), weights)
        return gate_box(detections, limit, centre, weights @ dz**2, noise_over(belief, sensor, where))

    def evaluate(self, belief: Gaussian, sensor: Sensor, observed: Detections | Frame, p_gate: float) -> Innovation:
        """Return the innovation of each detection and track, by the moments of the points' measurements."""
        assert isinstance(observed, Detections)
        dx, weights = self.offsets(belief)
        constants = self._memo.constants(self.state, sensor, belief.mean)
        if constants.twin is not None and observed.missing is None:
            (twin, axes), x = constants.twin, belief.mean
            noise = None if observed.noise is None else observed.noise[..., None, :, :, :]
            state_periods, _ = self._memo.frame or self._memo.framed(self.motion)
            innovation = kernels.evaluate_points_twin(
                x,
                dx,
                weights,
                observed.z,
                noise,
                twin.function,
                twin.numbers(x),
                axes,
                p_gate,
                state_periods,
                constants.periods,
            )
            if innovation is not None:
                return innovation
        where = self.state.locate(sensor.observes)
        points = self.state.displace(belief.mean[..., None, :], dx)
        expected, dz = sensor.measurement.mean(sensor.measure(points[..., where]), weights)
        x = belief.mean[..., where]
        ready = prepare(sensor, observed, expected, noise_over(belief, sensor, where))
        if ready.present is None:
            seen = kernels.evaluate_points(dx, dz, weights, ready.residuals, ready.noise)
            detail = Hypotheses(seen.shift, seen.post)
            return make_innovation(sensor, x, p_gate, seen.loglik, seen.distance, seen.log_volume, detail)
        dz, nu, R = ready.columns(dz[..., None, :, :]), ready.residuals[..., None, :], ready.noise[..., None, :, :]
        seen = kernels.evaluate_points(dx[..., None, :, :], dz, weights, nu, R)
        likely, detail = seen.loglik[..., 0] + ready.log_constant, Hypotheses(seen.shift[..., 0, :], seen.post[..., 0, :, :])
        return make_innovation(sensor, x, p_gate, likely, seen.distance[..., 0], seen.log_volume[..., 0], detail)
