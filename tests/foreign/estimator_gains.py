"""Estimators of linear models in another form, or with a gain that is not Kalman's."""

import numpy as np
from attrs import evolve, frozen

import vedette
from foreign import Foreign
from foreign.joint import with_gain
from foreign.motion_linear import Matern32, SpringDamper
from vedette.filters import GaussianFilter, OverMotion, embedded, evaluate_linearised, predict_linearised, prepare


@frozen
class FadingMemory(GaussianFilter):
    """The extended Kalman filter with a fading memory: P- = exp(dt / memory) F P F' + Q, so that old returns count less.

    Its covariance is meant to be larger than the errors are if the model is right. After 30 memories it fades no further:
    all is forgotten by then, and a gap of hours leaves numbers.
    Sorenson, Sacks, Recursive Fading Memory Filtering, Information Sciences 3, 1971.
    """

    kind = "fading_memory"
    declares = vedette.Traits(conservative=True)
    motion: vedette.MotionModel = vedette.fields.part("how the target moves")
    memory: float = vedette.fields.quantity("s", "time after which a return counts 1/e", default=200, at_least=1)

    def _growth(self, dt):
        return np.exp(min(dt / self.memory, 30.0))

    def predict(self, belief, dt, rng):
        if dt == 0:
            return belief
        return predict_linearised(evolve(belief, cov=self._growth(dt) * belief.cov), self.motion, dt)

    def cross_covariance(self, belief, dt):
        F = self.motion.jacobian(belief.mean, dt)
        return self._growth(dt) * belief.cov @ np.swapaxes(F, -1, -2)

    def evaluate(self, belief, sensor, observed, p_gate):
        return evaluate_linearised(belief, self.state, sensor, observed, p_gate)


@frozen(eq=False)
class Information:
    """Information matrix Y (*b, t, n, n) = P^-1 and vector y (*b, t, n) = Y x."""

    matrix: vedette.Array
    vector: vedette.Array


def inverse(matrix):
    """Return the inverse of symmetric positive definite matrices, scaled to a diagonal of 1 first."""
    scale = 1 / np.sqrt(np.diagonal(matrix, axis1=-2, axis2=-1))
    both = scale[..., :, None] * scale[..., None, :]
    inside = np.linalg.inv(matrix * both)
    return (inside + np.swapaxes(inside, -1, -2)) / 2 * both


@frozen
class InformationFilter(OverMotion):
    """The Kalman filter on Y = P^-1 and y = Y x: a return adds H' R^-1 H and H' R^-1 z; prediction inverts twice.

    For linear models of which every axis has variance; it needs a prior that is not singular.
    Maybeck, Stochastic Models, Estimation, and Control, Volume 1, 1979, section 5.7.
    """

    kind = "information_filter"
    declares = vedette.Traits(exact_when_linear=True)
    motion: vedette.MotionModel = vedette.fields.part("how the target moves; a linear model")

    def __attrs_post_init__(self):
        if not self.motion.linear or len(self.motion.zero_variance):
            raise ValueError(f"motion: must be linear with variance on each axis, got {self.motion.kind!r}")

    def refuses(self, sensor):
        return None if sensor.linear else "it is not linear"

    def _belief(self, mean, cov):
        matrix = inverse(cov)
        return Information(matrix, (matrix @ mean[..., None])[..., 0])

    def start(self, prior, axes, rng):
        where = axes.locate(self.state)
        return self._belief(self.state.canonical(prior.mean[..., where]), prior.cov[..., where, :][..., where])

    def moments(self, belief):
        cov = inverse(belief.matrix)
        return vedette.Gaussian(self.state.canonical((cov @ belief.vector[..., None])[..., 0]), cov)

    def predict(self, belief, dt, rng):
        if dt == 0:
            return belief
        now = self.moments(belief)
        F, Q = self.motion.jacobian(now.mean, dt), self.motion.noise(now.mean, dt)
        return self._belief(self.motion.move(now.mean, dt), F @ now.cov @ np.swapaxes(F, -1, -2) + Q)

    def cross_covariance(self, belief, dt):
        now = self.moments(belief)
        return now.cov @ np.swapaxes(self.motion.jacobian(now.mean, dt), -1, -2)

    def evaluate(self, belief, sensor, observed, p_gate):
        now = self.moments(belief)
        where = self.state.locate(sensor.observes)
        x = now.mean[..., where]
        ready = prepare(sensor, observed, sensor.measure(x), sensor.noise(x))
        H = ready.rows(embedded(sensor.jacobian(x), where, len(self.state))[..., None, :, :])
        turned = np.swapaxes(H, -1, -2) @ np.linalg.inv(ready.noise)  # H' R^-1
        post = inverse(belief.matrix[..., None, :, :] + turned @ H)
        root = vedette.kernels.root(now.cov)[..., None, :, :]
        S = H @ now.cov[..., None, :, :] @ np.swapaxes(H, -1, -2) + ready.noise
        made = with_gain(sensor, x, ready, root, H @ root, S, post @ turned, p_gate)
        added, gained = turned @ ready.residuals[..., None], turned @ H
        return evolve(made, detail=(added, np.broadcast_to(gained, (*x.shape[:-1], *gained.shape[-3:]))))

    def update(self, belief, innovation, weights):
        now = self.moments(belief)
        added, gained = innovation.detail
        cov = inverse(belief.matrix[..., None, :, :] + gained)
        shift = (cov @ added)[..., 0]
        mean = np.sum(weights[..., 1:, None] * shift, axis=-2)
        away = np.concatenate([np.zeros_like(mean)[..., None, :], shift], axis=-2) - mean[..., None, :]
        spread = np.einsum("...k,...ki,...kj->...ij", weights, away, away)
        cov = weights[..., 0, None, None] * now.cov + np.sum(weights[..., 1:, None, None] * cov, axis=-3)
        return self._belief(self.state.displace(now.mean, mean), cov + spread)


@frozen
class StaticGain(GaussianFilter):
    """The alpha-beta filter: a position's residual e moves it by alpha e and its velocity by beta e / interval.

    e = H^+ (z - H x) for any linear sensor. The covariance is that of this fixed gain: (I - K H) P (I - K H)' + K R K'.
    Kalata, The Tracking Index: A Generalized Parameter for Alpha-Beta and Alpha-Beta-Gamma Target Trackers, T-AES 20, 1984.
    """

    kind = "static_gain"
    motion: vedette.MotionModel = vedette.fields.part("how the target moves; it has positions and velocities")
    alpha: float = vedette.fields.quantity("1", "of the position", default=0.5, at_least=0.05, at_most=0.9)
    beta: float = vedette.fields.quantity("1", "of the velocity", default=0.1, at_least=0.001, at_most=0.3)
    interval: float = vedette.fields.quantity("s", "of the scans that it is for", default=2, at_least=1, at_most=60)

    def refuses(self, sensor):
        return None if sensor.linear else "it is not linear"

    def predict(self, belief, dt, rng):
        return belief if dt == 0 else predict_linearised(belief, self.motion, dt)

    def evaluate(self, belief, sensor, observed, p_gate):
        where = self.state.locate(sensor.observes)
        x = belief.mean[..., where]
        ready = prepare(sensor, observed, sensor.measure(x), sensor.noise(x))
        H = ready.rows(embedded(sensor.jacobian(x), where, len(self.state))[..., None, :, :])
        fixed = np.zeros((len(self.state), len(self.state)))
        for i, axis in enumerate(self.state.names):
            if "v" + axis in self.state and axis not in self.zero_variance:
                fixed[i, i] = self.alpha
                fixed[self.state.names.index("v" + axis), i] = self.beta / self.interval
        gain = fixed @ np.linalg.pinv(H)  # a missing component, a row of 0, moves nothing
        root = vedette.kernels.root(belief.cov)[..., None, :, :]
        S = H @ belief.cov[..., None, :, :] @ np.swapaxes(H, -1, -2) + ready.noise
        return with_gain(sensor, x, ready, root, H @ root, S, gain, p_gate)


COMPONENTS = (
    Foreign("fading memory", "estimator", lambda: FadingMemory(Matern32(50.0, 20.0))),
    Foreign("information filter", "estimator", lambda: InformationFilter(Matern32(50.0, 20.0))),
    Foreign("alpha-beta", "estimator", lambda: StaticGain(SpringDamper())),
)
