"""Estimators whose belief is an ensemble of equally likely states."""

import numpy as np
from attrs import frozen

import vedette
from foreign import Foreign
from foreign.joint import innovation
from foreign.motion_linear import Matern32
from foreign.motion_wrapped import SpeedScaledNoise
from vedette.filters import GaussianFilter, OverMotion, evaluate_linearised
from vedette.sampling import draw_gaussian
from vedette_standard.particles import draw_particles


@frozen(eq=False)
class Members:
    """Equally likely states (*b, t, p, n)."""

    points: vedette.Array


@frozen
class EnsembleKalman(OverMotion):
    """The ensemble square-root filter: members move with drawn noise; their moments give the gain, and they are turned
    into an ensemble that has exactly the moments of the weighted hypotheses.

    With P = L L' before and M M' after, x_s+ = x+ + M L^-1 (x_s - x). No returns are perturbed.
    Tippett, Anderson, Bishop, Hamill, Whitaker, Ensemble Square Root Filters, Monthly Weather Review 131, 2003.
    """

    kind = "ensemble_kalman"
    declares = vedette.Traits(draws=True)
    motion: vedette.MotionModel = vedette.fields.part("how the target moves")
    members: int = vedette.fields.integer("states per track", default=400, at_least=400, at_most=1_000_000)

    def start(self, prior, axes, rng):
        where = axes.locate(self.state)
        free = np.array([axis not in self.zero_variance for axis in self.state.names], dtype=float)
        cov = prior.cov[..., where, :][..., where] * free[:, None] * free
        return Members(draw_particles(vedette.Gaussian(prior.mean[..., where], cov), self.members, self.state, rng).points)

    def _moments(self, points):
        mean, apart = self.state.mean(points, np.full(points.shape[:-1], 1 / points.shape[-2]))
        return mean, np.swapaxes(apart, -1, -2) / np.sqrt(points.shape[-2])

    def moments(self, belief):
        mean, A = self._moments(belief.points)
        return vedette.Gaussian(mean, A @ np.swapaxes(A, -1, -2))

    def reframe(self, belief, combined):
        points = belief.points
        others = np.broadcast_to(combined.mean[..., None, :], points.shape)
        covs = np.zeros((*points.shape, points.shape[-1]))
        frame = vedette.Gaussian(others, covs + combined.cov[..., None, :, :])
        return Members(self.motion.reframe(vedette.Gaussian(points, covs), frame).mean)

    def predict(self, belief, dt, rng):
        if dt == 0:
            return belief
        ahead = self.motion.move(belief.points, dt)
        noise = self.motion.noise(belief.points, dt)
        drawn = draw_gaussian(np.zeros_like(ahead), np.broadcast_to(noise, (*ahead.shape, ahead.shape[-1])), rng)
        return Members(self.state.displace(ahead, drawn - drawn.mean(axis=-2, keepdims=True)))

    def cross_covariance(self, belief, dt):
        _, A = self._moments(belief.points)
        _, B = self._moments(self.motion.move(belief.points, dt))
        return A @ np.swapaxes(B, -1, -2)

    def evaluate(self, belief, sensor, observed, p_gate):
        where = self.state.locate(sensor.observes)
        mean, A = self._moments(belief.points)
        z = sensor.measure(belief.points[..., where])
        expected, apart = sensor.measurement.mean(z, np.full(z.shape[:-1], 1 / z.shape[-2]))
        D = np.swapaxes(apart, -1, -2) / np.sqrt(z.shape[-2])
        return innovation(sensor, observed, mean[..., where], expected, A, D, p_gate)

    def update(self, belief, innovation, weights):
        mean, A = self._moments(belief.points)
        cov, found = A @ np.swapaxes(A, -1, -2), innovation.detail
        shift = np.sum(weights[..., 1:, None] * found.shift, axis=-2)
        away = np.concatenate([np.zeros_like(shift)[..., None, :], found.shift], axis=-2) - shift[..., None, :]
        after = weights[..., 0, None, None] * cov + np.einsum("...k,...ki,...kj->...ij", weights, away, away)
        after = after + np.sum(weights[..., 1:, None, None] * found.post, axis=-3)
        turn = vedette.kernels.root(after) @ np.linalg.pinv(vedette.kernels.root(cov), rcond=1e-13)
        apart = np.swapaxes(turn @ A, -1, -2) * np.sqrt(belief.points.shape[-2])
        return Members(self.state.displace(self.state.displace(mean, shift)[..., None, :], apart))


@frozen
class MonteCarloKalman(GaussianFilter):
    """A Gaussian belief that is drawn from anew for each prediction: f's moments over points with the belief's own moments.

    P- = mean of (f(x_s) - x-) (f(x_s) - x-)' + Q. Measurements are linearised.
    Kotecha, Djuric, Gaussian Particle Filtering, IEEE T-SP 51, 2003.
    """

    kind = "monte_carlo_kalman"
    declares = vedette.Traits(draws=True)
    motion: vedette.MotionModel = vedette.fields.part("how the target moves")
    points: int = vedette.fields.integer("states drawn per track", default=300, at_least=100, at_most=2000)

    def predict(self, belief, dt, rng):
        if dt == 0:
            return belief
        drawn = draw_particles(belief, self.points, self.state, rng).points
        mean, apart = self.state.mean(self.motion.move(drawn, dt), np.full(drawn.shape[:-1], 1 / self.points))
        cov = np.swapaxes(apart, -1, -2) @ apart / self.points
        return vedette.Gaussian(mean, cov + self.motion.noise(belief.mean, dt))

    def evaluate(self, belief, sensor, observed, p_gate):
        return evaluate_linearised(belief, self.state, sensor, observed, p_gate)


COMPONENTS = (
    Foreign("ensemble Kalman", "estimator", lambda: EnsembleKalman(Matern32(50.0, 20.0))),
    Foreign("Monte Carlo Kalman", "estimator", lambda: MonteCarloKalman(SpeedScaledNoise())),
)
