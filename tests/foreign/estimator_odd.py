"""Estimators by roots of covariances, with doubt beyond the models, and one that hands on what another does."""

import numpy as np
from attrs import evolve, frozen

import vedette
from foreign import Foreign
from foreign.joint import innovation, observed_first
from foreign.motion_linear import Matern32, SpringDamper
from foreign.motion_odd import Torus
from vedette.filters import GaussianFilter, evaluate_linearised, predict_linearised


@frozen
class RootKalman(GaussianFilter):
    """The extended Kalman filter by roots of covariances: S = D D' + R with D = H L, and K from the joint deviations.

    Kaminski, Bryson, Schmidt, Discrete Square Root Filtering, IEEE T-AC 16, 1971.
    """

    kind = "root_kalman"
    declares = vedette.Traits(exact_when_linear=True)
    motion: vedette.MotionModel = vedette.fields.part("how the target moves")

    def predict(self, belief, dt, rng):
        if dt == 0:
            return belief
        F = self.motion.jacobian(belief.mean, dt)
        arms = F @ vedette.kernels.root(belief.cov)
        cov = arms @ np.swapaxes(arms, -1, -2) + self.motion.noise(belief.mean, dt)
        mean = self.state.canonical(self.motion.move(belief.mean, dt))
        return vedette.Gaussian(mean, (cov + np.swapaxes(cov, -1, -2)) / 2)

    def evaluate(self, belief, sensor, observed, p_gate):
        root, where = observed_first(self.state, sensor.observes, belief.cov)
        x = belief.mean[..., where]
        D = sensor.jacobian(x) @ root[..., where, :]
        return innovation(sensor, observed, x, sensor.measure(x), root, D, p_gate)


@frozen
class Considered(GaussianFilter):
    """A Kalman filter that considers a fixed share of doubt beyond its models: each prediction adds `doubt` of Q.

    Its covariance is meant to be larger than the errors.
    Schmidt, Application of State-Space Methods to Navigation Problems, Advances in Control Systems 3, 1966.
    """

    kind = "considered"
    declares = vedette.Traits(conservative=True)
    motion: vedette.MotionModel = vedette.fields.part("how the target moves")
    doubt: float = vedette.fields.quantity("1", "share of Q that is added", default=0.3, at_least=0, at_most=2)

    def predict(self, belief, dt, rng):
        if dt == 0:
            return belief
        made = predict_linearised(belief, self.motion, dt)
        return evolve(made, cov=made.cov + self.doubt * self.motion.noise(belief.mean, dt))

    def evaluate(self, belief, sensor, observed, p_gate):
        return evaluate_linearised(belief, self.state, sensor, observed, p_gate)


@frozen
class Held(vedette.Estimator):
    """Any estimator with what it cannot do left out: no frames, no smoothing. It hands on all else.

    Gamma et al., Design Patterns, 1994 (decorator).
    """

    kind = "held"
    drops = ("takes_frames", "bounded")
    of: vedette.Estimator = vedette.fields.part("the estimator")

    @property
    def state(self):
        return self.of.state

    @property
    def zero_variance(self):
        return self.of.zero_variance

    def refuses(self, sensor):
        return self.of.refuses(sensor)

    def start(self, prior, axes, rng):
        return self.of.start(prior, axes, rng)

    def reframe(self, belief, combined):
        return self.of.reframe(belief, combined)

    def predict(self, belief, dt, rng):
        return self.of.predict(belief, dt, rng)

    def evaluate(self, belief, sensor, observed, p_gate):
        return self.of.evaluate(belief, sensor, observed, p_gate)

    def update(self, belief, innovation, weights):
        return self.of.update(belief, innovation, weights)

    def moments(self, belief):
        return self.of.moments(belief)

    def merge(self, belief, mixtures):
        return self.of.merge(belief, mixtures)


COMPONENTS = (
    Foreign("root Kalman", "estimator", lambda: RootKalman(Matern32(50.0, 20.0))),
    Foreign("root Kalman, on a torus", "estimator", lambda: RootKalman(Torus())),
    Foreign("considered", "estimator", lambda: Considered(SpringDamper())),
    Foreign("held back", "estimator", lambda: Held(RootKalman(Torus()))),
)
