"""Nonlinear motion models integrated by splitting: each part's flow is exact, so that none blows up."""

import numpy as np
from attrs import frozen

import vedette
from foreign import Foreign


@frozen
class Pendulum(vedette.MotionModel):
    """A damped pendulum, angle a from the lowest point: a'' = -w^2 sin(a) - c a' + noise, by Strang's splitting.

    A step: half a kick, half the damping, the drift of the angle, half the damping, half a kick; F is its exact derivative.
    Hairer, Lubich, Wanner, Geometric Numerical Integration, 2006, section I.1.
    """

    kind = "pendulum"
    natural: float = vedette.fields.quantity("rad/s", "w, of small swings", default=1, above=0, at_most=5)
    damping: float = vedette.fields.quantity("1/s", "c", default=0.05, at_least=0, at_most=10)
    sigma_accel: float = vedette.fields.quantity("rad/s^2", "rate gained in 1 s", default=0.1, above=0, at_most=10)
    step: float = vedette.fields.quantity("s", "longest step of the integration", default=0.05, at_least=0.01, at_most=0.1)
    state = vedette.Space.of(angle="rad mod 2pi", rate="rad/s")

    def _flow(self, x, dt):
        angle, rate = x[..., 0], x[..., 1]
        F = np.zeros((*x.shape[:-1], 2, 2)) + np.eye(2)
        steps = max(1, int(np.ceil(dt / self.step)))
        half = dt / steps / 2
        fade, w2 = np.exp(-self.damping * half), self.natural**2
        for _ in range(steps):
            F[..., 1, :] = fade * (F[..., 1, :] - half * w2 * np.cos(angle)[..., None] * F[..., 0, :])
            rate = fade * (rate - half * w2 * np.sin(angle))
            F[..., 0, :] += 2 * half * F[..., 1, :]
            angle = angle + 2 * half * rate
            F[..., 1, :] = fade * F[..., 1, :] - half * w2 * np.cos(angle)[..., None] * F[..., 0, :]
            rate = fade * rate - half * w2 * np.sin(angle)
        return self.state.canonical(np.stack([angle, rate], axis=-1)), F

    def move(self, x, dt):
        return self._flow(x, dt)[0]

    def jacobian(self, x, dt):
        return self._flow(x, dt)[1]

    def noise(self, x, dt):
        return self.sigma_accel**2 * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])


@frozen
class VanDerPol(vedette.MotionModel):
    """Self-sustained swings of amplitude 2 A: x'' = m (1 - (x / A)^2) x' - w^2 x + noise, by Strang's splitting.

    A step: half of v' = m (1 - (x / A)^2) v, exactly; the harmonic oscillator, exactly; the other half.
    van der Pol, On Relaxation-Oscillations, Philosophical Magazine 2, 1926.
    """

    kind = "van_der_pol"
    natural: float = vedette.fields.quantity("rad/s", "w", default=1, above=0.01, at_most=5)
    growth: float = vedette.fields.quantity("1/s", "m, of small swings", default=0.5, above=0, at_most=2)
    amplitude: float = vedette.fields.quantity("m", "A, half of that on the limit cycle", default=50, at_least=10)
    sigma_accel: float = vedette.fields.quantity("m/s^2", "velocity gained in 1 s", default=0.5, above=0)
    step: float = vedette.fields.quantity("s", "longest step of the integration", default=0.05, at_least=0.01, at_most=0.1)
    state = vedette.Space.of(x="m", vx="m/s")

    def _flow(self, x, dt):
        p, v = x[..., 0], x[..., 1]
        F = np.zeros((*x.shape[:-1], 2, 2)) + np.eye(2)
        steps = max(1, int(np.ceil(dt / self.step)))
        h, w = dt / steps, self.natural
        c, s = np.cos(w * h), np.sin(w * h)
        turn = np.array([[c, s / w], [-w * s, c]])
        for _ in range(steps):
            v, F = self._grow(p, v, F, h / 2)
            p, v = turn[0, 0] * p + turn[0, 1] * v, turn[1, 0] * p + turn[1, 1] * v
            F = turn @ F
            v, F = self._grow(p, v, F, h / 2)
        return np.stack([p, v], axis=-1), F

    def _grow(self, p, v, F, t):
        factor = np.exp(self.growth * t * (1 - (p / self.amplitude) ** 2))
        slope = -2 * self.growth * t * p / self.amplitude**2 * factor * v
        grown = factor[..., None] * F[..., 1, :] + slope[..., None] * F[..., 0, :]
        return factor * v, np.stack([F[..., 0, :], grown], axis=-2)

    def move(self, x, dt):
        return self._flow(x, dt)[0]

    def jacobian(self, x, dt):
        return self._flow(x, dt)[1]

    def noise(self, x, dt):
        return self.sigma_accel**2 * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])


@frozen
class Reentry(vedette.MotionModel):
    """A body that falls through the atmosphere: v' = -g - k |v| v, k = exp(-z / H) / coefficient, by Strang's splitting.

    A step: half the drift, half the fall, the drag v / (1 + k |v| T), half the fall, half the drift. The logarithm of the
    ballistic coefficient over its usual value wanders. The derivative is left to the contract's numerical one.
    Farina, Ristic, Benvenuti, Tracking a Ballistic Target: Comparison of Several Nonlinear Filters, IEEE T-AES 38, 2002.
    """

    kind = "reentry"
    coefficient: float = vedette.fields.quantity(
        "m", "speed falls by 1/e over this path at sea level", default=8000, at_least=100
    )
    sigma_accel: float = vedette.fields.quantity("m/s^2", "velocity gained in 1 s", default=1, above=0)
    sigma_log: float = vedette.fields.quantity("1", "log of the coefficient gained in 1 s", default=0.05, above=0, at_most=1)
    state = vedette.Space.of(x="m", z="m", vx="m/s", vz="m/s", log_coefficient="1")

    def move(self, x, dt):
        place, velocity, log = x[..., :2], x[..., 2:4], x[..., 4]
        steps = max(1, int(np.ceil(dt / 0.1)))
        h = dt / steps
        fall = np.array([0.0, -9.80665]) * h / 2
        for _ in range(steps):
            place = place + h / 2 * velocity
            velocity = velocity + fall
            density = np.exp(30.0 * np.tanh((-place[..., 1] / 8434.0 - log) / 30.0)) / self.coefficient  # no e^30 denser
            velocity = velocity / (1 + h * density * np.sqrt(np.sum(velocity**2, axis=-1) + 1e-6))[..., None]
            velocity = velocity + fall
            place = place + h / 2 * velocity
        return np.concatenate([place, velocity, x[..., 4:]], axis=-1)

    def noise(self, x, dt):
        Q = np.zeros((5, 5))
        Q[:4, :4] = self.sigma_accel**2 * np.kron([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]], np.eye(2))
        Q[4, 4] = self.sigma_log**2 * dt
        return Q


FIXED_STEPS = ("any_gap_can_be_moved_over",)
"""By steps of a fraction of a second: a gap of days takes minutes, or grows without bound."""

COMPONENTS = (
    Foreign("pendulum", "motion", Pendulum, FIXED_STEPS),
    Foreign("van der Pol", "motion", VanDerPol, FIXED_STEPS),
    Foreign("re-entry", "motion", Reentry, FIXED_STEPS),
)
