"""What the filters with a Gaussian belief share: they differ in how they predict and in what a scan says to them."""

from __future__ import annotations

from abc import abstractmethod

import numpy as np
from attrs import frozen

from vedette import kernels
from vedette.roles import Estimator, MotionModel, Sensor
from vedette.space import Array, Space
from vedette.types import Detections, Gaussian, Innovation


@frozen(eq=False)
class Hypotheses:
    """The detail of a Gaussian filter's innovation: shift (*b, t, k, n) and post (*b, t, 1|k, n, n) of each return."""

    shift: Array
    post: Array


@frozen
class GaussianFilter(Estimator[Gaussian]):
    """A filter over one motion model whose belief is a mean and a covariance."""

    @property
    @abstractmethod
    def motion(self) -> MotionModel: ...

    @property
    def state(self) -> Space:
        return self.motion.state

    @property
    def carried(self) -> Space:
        return self.motion.carried

    def start(self, prior: Gaussian, axes: Space, rng: np.random.Generator) -> Gaussian:
        """The prior's own axes; those that are carried lose their variance."""
        own = axes.locate(self.state)
        cov = prior.cov[..., own, :][..., own]
        if len(self.carried):
            cov = without_variance(cov, self.state.locate(self.carried))
        return Gaussian(prior.mean[..., own], cov)

    def absorb(self, belief: Gaussian, innovation: Innovation, weights: Array) -> Gaussian:
        """Moments of the weighted hypotheses, the spread of their means included."""
        detail: Hypotheses = innovation.detail
        step, cov = kernels.mixture(belief.cov, detail.shift, detail.post, weights)
        return Gaussian(self.state.displace(belief.mean, step), cov)

    def moments(self, belief: Gaussian) -> Gaussian:
        return belief

    def cross(self, belief: Gaussian, dt: float) -> Array:
        """P F', F the derivative of the motion at the mean; for filters that predict by it."""
        keeps_its_frame(self.motion)
        return belief.cov @ np.swapaxes(self.motion.jacobian(belief.mean, dt), -1, -2)


def keeps_its_frame(motion: MotionModel) -> None:
    """NotImplementedError if beliefs over this motion are re-expressed on the way: two moments have no common frame."""
    if type(motion).settle is not MotionModel.settle:
        raise NotImplementedError(f"motion {motion.kind!r} turns its frame from scan to scan")


def without_variance(cov: Array, axes: list[int]) -> Array:
    """Covariances (*b, n, n) with zeros in the rows and columns of `axes`, as carried axes have."""
    keep = np.ones(cov.shape[-1])
    keep[axes] = 0.0
    return cov * (keep[:, None] * keep)


def linearised(belief: Gaussian, state: Space, sensor: Sensor, seen: Detections, p_gate: float) -> Innovation:
    """Every return against every track, by the sensor's derivative at each track's mean."""
    where = state.locate(sensor.looks_at)
    x = belief.mean[..., where]
    nu = residuals(sensor, seen, sensor.measure(x))
    slope = sensor.jacobian(x)
    H = np.zeros((*slope.shape[:-1], len(state)))
    H[..., where] = slope
    return joined(sensor, x, p_gate, kernels.innovate(belief.cov, nu, H, noise_of(sensor, seen, x)))


def residuals(sensor: Sensor, seen: Detections, expected: Array) -> Array:
    """Every return minus every track's expected one: (*b, k, m), (*b, t, m) -> (*b, t, k, m)"""
    return sensor.measurement.difference(seen.z[..., None, :, :], expected[..., :, None, :])


def noise_of(sensor: Sensor, seen: Detections, x: Array) -> Array:
    """Measurement noise (*b, t|1, 1|k, m, m): the returns' own where they bring it, else the sensor's at `x` (*b, t, n)."""
    if seen.noise is not None:
        return seen.noise[..., None, :, :, :]
    R = sensor.noise(x)
    return R[..., None, :, :]


def joined(sensor: Sensor, x: Array, p_gate: float, parts: tuple[Array, Array, Array, Array, Array]) -> Innovation:
    """A kernel's result over the returns, and the detection probability at `x` (*b, t, n), the sensor's axes."""
    loglik, distance, log_volume, shift, post = parts
    p_detect = np.asarray(sensor.detects(x))
    columns = np.empty((*loglik.shape[:-1], 1 + loglik.shape[-1]))
    columns[..., 0] = kernels.safe_log(1.0 - p_detect * p_gate)
    columns[..., 1:] = loglik + kernels.safe_log(p_detect)[..., None]
    volume = np.broadcast_to(np.max(log_volume, axis=-1, initial=-np.inf), loglik.shape[:-1])
    return Innovation(columns, distance, volume, distance, Hypotheses(shift, post))
