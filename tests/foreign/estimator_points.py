"""Gaussian filters by points other than those of the unscented and cubature filters."""

from functools import lru_cache
from itertools import product

import numpy as np
from attrs import frozen

import vedette
from foreign import Foreign
from foreign.joint import innovation, observed_first
from foreign.motion_linear import Matern32
from foreign.motion_wrapped import SpeedScaledNoise
from vedette.filters import GaussianFilter, predict_linearised


@lru_cache
def grid(order, n):
    """Return the tensor grid of Gauss and Hermite (s, n) for a standard normal, and its weights (s,)."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(order)
    points = np.array(list(product(nodes, repeat=n))).reshape(-1, n)
    return points, np.prod(np.array(list(product(weights / weights.sum(), repeat=n))).reshape(-1, n), axis=-1)


@frozen
class GaussHermite(GaussianFilter):
    """Moments by the tensor grid of Gauss and Hermite with `order` points per axis, exact for polynomials to 2 order - 1.

    With P = L L', points x + L g_s and weights w_s. The measurement's grid spans the observed axes alone.
    Ito, Xiong, Gaussian Filters for Nonlinear Filtering Problems, IEEE T-AC 45, 2000.
    """

    kind = "gauss_hermite"
    declares = vedette.Traits(exact_when_linear=True)
    motion: vedette.MotionModel = vedette.fields.part("how the target moves")
    order: int = vedette.fields.integer("points per axis", default=3, at_least=2, at_most=3)

    def predict(self, belief, dt, rng):
        if dt == 0:
            return belief
        if self.motion.linear:
            return predict_linearised(belief, self.motion, dt)
        moving = [i for i, axis in enumerate(self.state.names) if axis not in self.zero_variance]
        spread, weights = grid(self.order, len(moving))
        root = vedette.kernels.root(belief.cov)[..., moving]
        x = self.state.displace(belief.mean[..., None, :], spread @ np.swapaxes(root, -1, -2))
        mean, apart = self.state.mean(self.motion.move(x, dt), np.broadcast_to(weights, x.shape[:-1]))
        cov = np.swapaxes(apart, -1, -2) @ (weights[:, None] * apart)
        return vedette.Gaussian(mean, cov + self.motion.noise(belief.mean, dt))

    def evaluate(self, belief, sensor, observed, p_gate):
        root, where = observed_first(self.state, sensor.observes, belief.cov)
        o = len(where)
        x, seen = belief.mean[..., where], root[..., :o]
        spread, weights = grid(self.order, o)
        points = sensor.observes.displace(x[..., None, :], spread @ np.swapaxes(seen[..., where, :], -1, -2))
        expected, apart = sensor.measurement.mean(sensor.measure(points), np.broadcast_to(weights, points.shape[:-1]))
        scale = np.sqrt(weights)
        A = np.concatenate([seen @ (scale[:, None] * spread).T, root[..., o:]], axis=-1)
        D = np.swapaxes(apart, -1, -2) * scale
        D = np.concatenate([D, np.zeros((*D.shape[:-1], len(self.state) - o))], axis=-1)
        return innovation(sensor, observed, x, expected, A, D, p_gate)


@frozen
class CentralDifference(GaussianFilter):
    """Moments by Stirling's interpolation to second order with steps of sqrt(3) deviations along a root of P.

    With f+- = f(x +- h l_j), h^2 = 3: mean f_0 + sum (f+ + f- - 2 f_0) / (2 h^2); covariance, sums of squares of
    (f+ - f-) / (2 h) and sqrt(h^2 - 1) (f+ + f- - 2 f_0) / (2 h^2); that with the state by the former alone.
    Norgaard, Poulsen, Ravn, New Developments in State Estimation for Nonlinear Systems, Automatica 36, 2000.
    """

    kind = "central_difference"
    declares = vedette.Traits(exact_when_linear=True)
    motion: vedette.MotionModel = vedette.fields.part("how the target moves")

    def _moments(self, function, space, x, root, over):
        """Return the mean of `function` over `space`, and its first and second differences (*b, n, s) along `root`."""
        step = np.sqrt(3.0) * np.swapaxes(root, -1, -2)
        middle = function(x)
        right = space.difference(function(over.displace(x[..., None, :], step)), middle[..., None, :])
        left = space.difference(function(over.displace(x[..., None, :], -step)), middle[..., None, :])
        first, second = (right - left) / np.sqrt(12.0), (right + left) * np.sqrt(2.0) / 6.0
        mean = space.displace(middle, np.sum(right + left, axis=-2) / 6.0)
        return mean, np.swapaxes(first, -1, -2), np.swapaxes(second, -1, -2)

    def predict(self, belief, dt, rng):
        if dt == 0:
            return belief
        root = vedette.kernels.root(belief.cov)
        mean, first, second = self._moments(lambda x: self.motion.move(x, dt), self.state, belief.mean, root, self.state)
        cov = first @ np.swapaxes(first, -1, -2) + second @ np.swapaxes(second, -1, -2)
        return vedette.Gaussian(mean, cov + self.motion.noise(belief.mean, dt))

    def cross_covariance(self, belief, dt):
        root = vedette.kernels.root(belief.cov)
        _, first, _ = self._moments(lambda x: self.motion.move(x, dt), self.state, belief.mean, root, self.state)
        return root @ np.swapaxes(first, -1, -2)

    def evaluate(self, belief, sensor, observed, p_gate):
        root, where = observed_first(self.state, sensor.observes, belief.cov)
        x = belief.mean[..., where]
        expected, first, second = self._moments(sensor.measure, sensor.measurement, x, root[..., where, :], sensor.observes)
        A = np.concatenate([root, np.zeros_like(root)], axis=-1)
        return innovation(sensor, observed, x, expected, A, np.concatenate([first, second], axis=-1), p_gate)


COMPONENTS = (
    Foreign("Gauss-Hermite", "estimator", lambda: GaussHermite(SpeedScaledNoise())),
    Foreign("Gauss-Hermite, linear", "estimator", lambda: GaussHermite(Matern32(50.0, 20.0), 2)),
    Foreign("central difference", "estimator", lambda: CentralDifference(SpeedScaledNoise())),
)
