"""The square-root Kalman filter."""

from __future__ import annotations

import math
from typing import ClassVar, final

import numpy as np
from attrs import evolve, field, frozen

from vedette import Array, Detections, Frame, Gaussian, Innovation, MotionModel, Sensor, Space, Traits, fields, kernels
from vedette.filters import (
    Memo,
    OverMotion,
    extent_linearised,
    make_innovation,
    marginal,
    noise_over,
    prepare,
    without_variance,
)
from vedette_standard.compiled import fastest


@frozen(eq=False)
class Root:
    """Mean (*b, t, n) and a root L (*b, t, n, n) of the covariance L L'."""

    mean: Array
    root: Array


@frozen(eq=False)
class RootHypotheses:
    """For each return, the mean's shift (*b, t, k, n), and the root of the posterior covariance (*b, t, 1|k, n, n)."""

    shift: Array
    root: Array


@final
@frozen
class SquareRootKalman(OverMotion[Root]):
    """The extended Kalman filter on a square root of the covariance, never on P itself: this doubles the precision.

    All steps are orthogonal triangularisations: [F L, Q^1/2] -> L-, and [R^1/2, H L-; 0, L-] -> [S^1/2, 0; K S^1/2, L+]. So
    noises may differ by 1e12 and more. Soft association stacks its hypotheses' roots in the same way.
    Kaminski, Bryson, Schmidt, Discrete Square Root Filtering, IEEE Trans. Automatic Control 16, 1971.

    >>> from vedette import Detections, Gaussian
    >>> from vedette_standard import ConstantVelocity, LinearSensor
    >>> x, P, T = np.array([100.0, 5.0]), np.array([[30.0, 2.0], [2.0, 4.0]]), 2.0
    >>> F, Q = np.array([[1.0, T], [0.0, 1.0]]), 0.09 * np.array([[T**3 / 3.0, T**2 / 2.0], [T**2 / 2.0, T]])
    >>> estimator, sensor = SquareRootKalman(ConstantVelocity(0.3, axes=("x",))), LinearSensor(("x",), [[25.0]])
    >>> ahead = estimator.predict(estimator.start(Gaussian(x[None], P[None]), estimator.state, None), T, None)
    >>> np.allclose(ahead.root[0] @ ahead.root[0].T, F @ P @ F.T + Q), float(ahead.root[0, 0, 1])
    (True, 0.0)
    >>> m, P = F @ x, F @ P @ F.T + Q
    >>> S, nu = P[0, 0] + 25.0, np.array([104.0, 121.0]) - m[0]
    >>> K, step = P[:, 0] / S, 0.5 * nu[0] + 0.3 * nu[1]
    >>> seen = estimator.evaluate(ahead, sensor, Detections.of([[104.0], [121.0]]), 1.0)
    >>> np.allclose(seen.loglik[0, 1:], -0.5 * (nu**2 / S + np.log(2.0 * np.pi * S)))
    True
    >>> after = estimator.moments(estimator.update(ahead, seen, np.array([[0.2, 0.5, 0.3]])))
    >>> spread = 0.5 * nu[0] ** 2 + 0.3 * nu[1] ** 2 - step**2
    >>> np.allclose(after.mean[0], m + K * step), np.allclose(after.cov[0], P + np.outer(K, K) * (spread - 0.8 * S))
    (True, True)
    >>> wide = estimator.start(Gaussian(x[None], np.diag([1e14, 4.0])[None]), estimator.state, None)
    >>> sharp = estimator.evaluate(wide, LinearSensor(("x",), [[1e-4]]), Detections.of([[104.0]]), 1.0)
    >>> after = estimator.moments(estimator.update(wide, sharp, np.array([[0.0, 1.0]])))
    >>> np.allclose(after.cov[0], np.diag([1e-4, 4.0]), atol=1e-9)
    True
    """

    kind: ClassVar[str] = "srkf"
    abbreviations: ClassVar[tuple[str, ...]] = ("srif", "squareroot")
    declares: ClassVar[Traits] = Traits(exact_when_linear=True, bounded=True)

    motion: MotionModel = fields.part("how the target moves")
    _memo: Memo = field(init=False, repr=False, eq=False, factory=Memo)

    def start(self, prior: Gaussian, axes: Space, rng: np.random.Generator) -> Root:
        """Return the prior's marginal over the filter's axes, its covariance as a root."""
        located = marginal(prior, axes, self.state, self.zero_variance)
        return Root(located.mean, kernels.root(located.cov))

    def reframe(self, belief: Root, combined: Gaussian) -> Root:
        """Return the belief in the motion's frame of the `combined` estimate."""
        reframed = self.motion.reframe(self.moments(belief), combined)
        return Root(reframed.mean, kernels.root(without_variance(reframed.cov, self.state.locate(self.zero_variance))))

    def predict(self, belief: Root, dt: float, rng: np.random.Generator) -> Root:
        if dt == 0:
            return belief
        x = belief.mean
        twin, periods = self._memo.moving or self._memo.twin(self.motion)
        if twin is not None:
            root = kernels.predict_root_twin(x, belief.root, dt, twin.function, twin.numbers(x, dt), periods)
            if root is not None:
                return Root(*root)
        moved = self.motion.jacobian(x, dt) @ belief.root
        added = np.broadcast_to(kernels.root(self.motion.mean_noise(x, self.moments(belief).cov, dt)), moved.shape)
        wide = np.concatenate([moved, added], axis=-1)
        return Root(self.state.canonical(self.motion.move(x, dt)), kernels.lower_triangular(wide))

    def smooth_step(self, belief: Root, later: Root, dt: float, rng: np.random.Generator) -> Root:
        """Return the belief at one time given all scans; along a linear motion without loss of digits."""
        if dt == 0 or not self.motion.linear or self.motion.reframes:
            return super().smooth_step(belief, later, dt, rng)
        now, after = self.moments(belief), self.moments(later)
        F, Q, periods = self._memo.step(self.motion, now.mean, dt)
        return self.start(kernels.smooth_linear(now.mean, now.cov, F, Q, after.mean, after.cov, periods), self.state, rng)

    def cross_covariance(self, belief: Root, dt: float) -> Array:
        """Return P F' (*b, t, n, n)."""
        return self.moments(belief).cov @ np.swapaxes(self.motion.jacobian(belief.mean, dt), -1, -2)

    def evaluate(self, belief: Root, sensor: Sensor, observed: Detections | Frame, p_gate: float) -> Innovation:
        """Return the innovation of each detection and track, linearised at the track's mean."""
        assert isinstance(observed, Detections)
        twin = self._memo.constants(self.state, sensor, belief.mean).twin
        if twin is not None and observed.missing is None:
            by, axes, noise = *twin, None if observed.noise is None else observed.noise[..., None, :, :, :]
            scan = observed.z, noise, by.function, by.numbers(belief.mean), axes, p_gate, sensor.measurement.periods
            seen = kernels.evaluate_root_twin(belief.mean, belief.root, *scan)
            if seen is not None:
                return evolve(seen, detail=RootHypotheses(seen.detail.shift, seen.detail.post))
        where, n, m = self.state.locate(sensor.observes), len(self.state), len(sensor.measurement)
        x = belief.mean[..., where]
        ready = prepare(sensor, observed, sensor.measure(x), noise_over(self.moments(belief), sensor, where))
        before = np.zeros((*belief.mean.shape[:-1], ready.noise.shape[-3], m + n, m + n))
        before[..., :m, :m] = np.linalg.cholesky(ready.noise)
        before[..., :m, m:] = ready.rows((sensor.jacobian(x) @ belief.root[..., where, :])[..., None, :, :])
        before[..., m:, m:] = belief.root[..., None, :, :]
        after = kernels.lower_triangular(before)
        S_root, gain = after[..., :m, :m], after[..., m:, :m]
        white = np.linalg.solve(S_root, ready.residuals[..., None])
        distance = np.sum(white**2, axis=(-1, -2))
        log_volume = np.sum(np.log(np.abs(np.diagonal(S_root, axis1=-2, axis2=-1))), axis=-1)
        loglik = -0.5 * (distance + m * math.log(2 * math.pi)) - log_volume + ready.log_constant
        detail = RootHypotheses((gain @ white)[..., 0], after[..., m:, m:])
        return make_innovation(sensor, x, p_gate, loglik, distance, log_volume, detail)

    def extent(self, belief: Root, sensor: Sensor, detections: Detections, limit: Array | float) -> tuple[Array, Array]:
        return extent_linearised(self.moments(belief), self.state, sensor, detections, limit, self._memo)

    def update(self, belief: Root, innovation: Innovation, weights: Array) -> Root:
        """Return the moments of the weighted hypotheses, the spread of their means included, with a root covariance."""
        detail: RootHypotheses = innovation.detail
        mean, root = mixed_roots(belief.root, detail.shift, detail.root, weights)
        if len(self.zero_variance):
            root[..., self.state.locate(self.zero_variance), :] = 0.0
        return Root(self.state.displace(belief.mean, mean), root)

    def moments(self, belief: Root) -> Gaussian:
        """Return mean and covariance L L'."""
        cov = belief.root @ np.swapaxes(belief.root, -1, -2)
        return Gaussian(belief.mean, kernels.symmetric(cov))


@fastest
def mixed_roots(root: Array, shift: Array, roots: Array, weights: Array) -> tuple[Array, Array]:
    """Return the mean's shift (*b, n) and a root (*b, n, n) of the mixture's covariance, by weights (*b, 1+k).

    root (*b, n, n): the belief's; shift (*b, k, n), roots (*b, 1|k, n, n): those of the hypotheses.
    """
    miss, w = weights[..., :1], weights[..., 1:]
    mean = (w[..., None, :] @ shift)[..., 0, :]
    shared = roots.shape[-3] == 1
    share = np.sqrt(np.sum(w, axis=-1, keepdims=True) if shared else w)
    posts = np.swapaxes(share[..., None, None] * roots, -3, -2)
    parts = [
        np.sqrt(miss)[..., None] * root,
        posts.reshape(*mean.shape, -1) if posts.size else np.zeros((*mean.shape, 0)),
        np.swapaxes(np.sqrt(w)[..., None] * (shift - mean[..., None, :]), -1, -2),
        (np.sqrt(miss) * mean)[..., None],
    ]
    return mean, kernels.lower_triangular(np.concatenate(parts, axis=-1))
