"""The square-root Kalman filter."""

from __future__ import annotations

import math
from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Detections, Estimator, Frame, Gaussian, Innovation, MotionModel, Sensor, Space, fields, kernels
from vedette.filters.gaussian import (
    among_present,
    keeps_its_frame,
    missing_share,
    noise_of,
    own_part,
    reported,
    residuals,
)
from vedette.roles import ImagingSensor
from vedette.sampling.trajectories import factor


@frozen(eq=False)
class Root:
    """Mean (*b, t, n) and a root L (*b, t, n, n) of the covariance L L'."""

    mean: Array
    root: Array


@frozen(eq=False)
class RootHypotheses:
    """Of each return: the mean's shift (*b, t, k, n), and the root of the posterior covariance (*b, t, 1|k, n, n)."""

    shift: Array
    root: Array


@final
@frozen
class SquareRootKalman(Estimator[Root]):
    """The extended Kalman filter on a root of the covariance, which it never forms: digits count twice.

    All is done by orthogonal triangularisation: [F L, Q^1/2] -> L-, and [R^1/2, H L-; 0, L-] -> [S^1/2, 0; K S^1/2, L+]. So
    noises may differ by 1e12 and more. Soft association stacks its hypotheses' roots in the same way.
    Kaminski, Bryson, Schmidt, Discrete Square Root Filtering, IEEE Trans. Automatic Control 16, 1971.
    """

    kind: ClassVar[str] = "srkf"
    exact_when_linear: ClassVar[bool] = True

    motion: MotionModel = fields.part("how the target moves")

    @property
    def state(self) -> Space:
        return self.motion.state

    @property
    def zero_variance(self) -> Space:
        return self.motion.zero_variance

    def refuses(self, sensor: Sensor) -> str | None:
        """Cameras: a frame has no root."""
        return "it works on returns, not on frames: use 'ekf' or 'iekf'" if isinstance(sensor, ImagingSensor) else None

    def start(self, prior: Gaussian, axes: Space, rng: np.random.Generator) -> Root:
        """The prior's own axes; those without variance lose their variance."""
        own = own_part(prior, axes, self.state, self.zero_variance)
        return Root(own.mean, factor(own.cov))

    def predict(self, belief: Root, dt: float, rng: np.random.Generator, combined: Gaussian | None = None) -> Root:
        """The belief `dt` s later."""
        if dt == 0:
            return belief
        if type(self.motion).reframe is not MotionModel.reframe:
            own = self.moments(belief)
            belief = self.start(self.motion.reframe(own, own if combined is None else combined), self.state, rng)
        x = belief.mean
        moved = self.motion.jacobian(x, dt) @ belief.root
        added = np.broadcast_to(factor(self.motion.noise(x, dt)), moved.shape)
        return Root(self.motion.move(x, dt), _triangular(np.concatenate([moved, added], axis=-1)))

    def cross_covariance(self, belief: Root, dt: float) -> Array:
        """P F': (*b, t, n, n)"""
        keeps_its_frame(self.motion)
        return self.moments(belief).cov @ np.swapaxes(self.motion.jacobian(belief.mean, dt), -1, -2)

    def evaluate(self, belief: Root, sensor: Sensor, observed: Detections | Frame, p_gate: float) -> Innovation:
        """Every return against every track, linearised at its mean."""
        assert isinstance(observed, Detections)
        where, n, m = self.state.locate(sensor.observes), len(self.state), len(sensor.measurement)
        x = belief.mean[..., where]
        R = noise_of(sensor, observed, x)
        seen_root = (sensor.jacobian(x) @ belief.root[..., where, :])[..., None, :, :]
        nu = residuals(sensor, observed, sensor.measure(x))
        share: Array | float = 0.0
        if observed.missing is not None:
            there = reported(observed)
            R, seen_root, nu = among_present(R, there), seen_root * there[..., None], np.where(there, nu, 0.0)
            share = missing_share(there)
        shape = (*belief.mean.shape[:-1], R.shape[-3])
        before = np.zeros((*shape, m + n, m + n))
        before[..., :m, :m] = np.linalg.cholesky(R)
        before[..., :m, m:] = seen_root
        before[..., m:, m:] = belief.root[..., None, :, :]
        after = _triangular(before)
        S_root, gain = after[..., :m, :m], after[..., m:, :m]
        white = np.linalg.solve(S_root, nu[..., None])
        distance = np.sum(white**2, axis=(-1, -2))
        log_volume = np.sum(np.log(np.abs(np.diagonal(S_root, axis1=-2, axis2=-1))), axis=-1)
        loglik = -0.5 * (distance + m * math.log(2 * math.pi)) - log_volume + share
        p_detect = np.asarray(sensor.detects(x))
        columns = np.empty((*distance.shape[:-1], 1 + distance.shape[-1]))
        columns[..., 0] = kernels.safe_log(1.0 - p_detect * p_gate)
        columns[..., 1:] = loglik + kernels.safe_log(p_detect)[..., None]
        detail = RootHypotheses((gain @ white)[..., 0], after[..., m:, m:])
        return Innovation(columns, distance, np.max(log_volume, axis=-1, initial=-np.inf), distance, detail)

    def update(self, belief: Root, innovation: Innovation, weights: Array) -> Root:
        """Moments of the weighted hypotheses, the spread of their means included, as one root."""
        detail: RootHypotheses = innovation.detail
        miss, w = weights[..., :1], weights[..., 1:]
        mean = (w[..., None, :] @ detail.shift)[..., 0, :]
        shared = detail.root.shape[-3] == 1
        share = np.sqrt(np.sum(w, axis=-1, keepdims=True) if shared else w)
        posts = np.swapaxes(share[..., None, None] * detail.root, -3, -2)
        apart = np.sqrt(w)[..., None] * (detail.shift - mean[..., None, :])
        parts = [
            np.sqrt(miss)[..., None] * belief.root,
            posts.reshape(*mean.shape, -1) if posts.size else np.zeros((*mean.shape, 0)),
            np.swapaxes(apart, -1, -2),
            (np.sqrt(miss) * mean)[..., None],
        ]
        root = _triangular(np.concatenate(parts, axis=-1))
        if len(self.zero_variance):
            root[..., self.state.locate(self.zero_variance), :] = 0.0
        return Root(self.state.displace(belief.mean, mean), root)

    def moments(self, belief: Root) -> Gaussian:
        """Mean, and the covariance L L'."""
        cov = belief.root @ np.swapaxes(belief.root, -1, -2)
        return Gaussian(belief.mean, kernels.symmetric(cov))


def _triangular(wide: Array) -> Array:
    """Lower triangular L (*b, n, n) with L L' = A A' for A (*b, n, p), p >= n."""
    return np.swapaxes(np.linalg.qr(np.swapaxes(wide, -1, -2), mode="r"), -1, -2).copy()
