"""Motion models that are linear stochastic differential equations."""

import numpy as np
from attrs import frozen
from scipy.special import gammainc

import vedette
from foreign import Foreign
from foreign.diffusion import Diffusion


@frozen
class ConstantJerk(Diffusion):
    """White-noise snap per axis: p'''' = w, so that the jerk is a Wiener process.

    F is the Taylor series to T^3 / 6, Q_ij = q T^(7-i-j) / ((3-i)! (3-j)! (7-i-j)) for i, j = 0..3.
    Mehrotra, Mahapatra, A Jerk Model for Tracking Highly Maneuvering Targets, IEEE T-AES 33, 1997.
    """

    kind = "constant_jerk"
    sigma_snap: float = vedette.fields.quantity("m/s^4", "jerk gained in 1 s", above=0)
    axes: tuple[str, ...] = vedette.fields.words("the position axes", default=("x", "y"))

    @property
    def state(self):
        units = {"": "m", "v": "m/s", "a": "m/s^2", "j": "m/s^3"}
        return vedette.Space.of(**{prefix + axis: unit for prefix, unit in units.items() for axis in self.axes})

    def drift(self):
        return np.kron(np.eye(4, k=1), np.eye(len(self.axes)))

    def spread(self):
        return np.kron([[0.0], [0.0], [0.0], [self.sigma_snap]], np.eye(len(self.axes)))


@frozen
class Matern32(vedette.MotionModel):
    """A position with the Matern covariance sigma^2 (1 + l t) exp(-l t), l = sqrt(3) / length, around the origin, per axis.

    With a = l T: F = exp(-a) [1 + a, T; -l a, 1 - a]; Q11 = sigma^2 P(3, 2 a) with the incomplete gamma function P,
    Q12 = 2 sigma^2 l a^2 exp(-2 a), Q22 = sigma^2 l^2 (1 - exp(-2 a) (1 - 2 a + 2 a^2)).
    Hartikainen, Sarkka, Kalman Filtering and Smoothing Solutions to Temporal Gaussian Process Regression, MLSP 2010.
    """

    kind = "matern_32"
    divisible = True
    linear = True
    sigma: float = vedette.fields.quantity("m", "stationary standard deviation of the position", above=0)
    length: float = vedette.fields.quantity("s", "time over which the position is correlated", above=0)
    state = vedette.Space.of(x="m", y="m", vx="m/s", vy="m/s")

    def move(self, x, dt):
        return x @ self.jacobian(x, dt).T

    def jacobian(self, x, dt):
        rate = np.sqrt(3.0) / self.length
        a = rate * dt
        return np.kron(np.exp(-a) * np.array([[1 + a, dt], [-rate * a, 1 - a]]), np.eye(2))

    def noise(self, x, dt):
        rate = np.sqrt(3.0) / self.length
        a = rate * dt
        fade = np.exp(-2 * a)
        cross = 2 * rate * a**2 * fade
        speed = rate**2 * (-np.expm1(-2 * a) + 2 * fade * a * (1 - a))
        return self.sigma**2 * np.kron([[gammainc(3.0, 2 * a), cross], [cross, speed]], np.eye(2))


@frozen
class SpringDamper(Diffusion):
    """A moored body: p'' = -w^2 p - 2 d w p' + noise per axis, exactly discretised, whether or not it swings.

    Its noise has the density q = 4 d w^3 sigma^2, so that sigma is the stationary standard deviation of the position.
    Chandrasekhar, Stochastic Problems in Physics and Astronomy, Reviews of Modern Physics 15, 1943, section II.3.
    """

    kind = "spring_damper"
    natural: float = vedette.fields.quantity("rad/s", "natural frequency w", default=0.3, above=0, at_most=10)
    damping: float = vedette.fields.quantity("1", "damping ratio d", default=0.2, above=0, at_most=10)
    sigma: float = vedette.fields.quantity("m", "stationary standard deviation of the position", default=5, above=0)
    state = vedette.Space.of(x="m", y="m", vx="m/s", vy="m/s")

    def drift(self):
        return np.kron([[0.0, 1.0], [-(self.natural**2), -2 * self.damping * self.natural]], np.eye(2))

    def spread(self):
        root = self.sigma * np.sqrt(4 * self.damping * self.natural**3)
        return np.kron([[0.0], [root]], np.eye(2))


@frozen
class ClohessyWiltshire(Diffusion):
    """A spacecraft near another on a circular orbit of mean motion n: x'' = 3 n^2 x + 2 n y', y'' = -2 n x', z'' = -n^2 z.

    x points away from the Earth, y along the orbit, z across it; each acceleration has white noise.
    Clohessy, Wiltshire, Terminal Guidance System for Satellite Rendezvous, J. Aerospace Sciences 27, 1960.
    """

    kind = "clohessy_wiltshire"
    mean_motion: float = vedette.fields.quantity("rad/s", "of the orbit", default=0.00113, above=0, at_most=0.01)
    sigma_accel: float = vedette.fields.quantity("m/s^2", "velocity gained in 1 s, per axis", default=0.01, above=0)
    state = vedette.Space.of(x="m", y="m", z="m", vx="m/s", vy="m/s", vz="m/s")

    def drift(self):
        n = self.mean_motion
        drift = np.zeros((6, 6))
        drift[:3, 3:] = np.eye(3)
        drift[3, 0], drift[3, 4] = 3 * n**2, 2 * n
        drift[4, 3], drift[5, 2] = -2 * n, -(n**2)
        return drift

    def spread(self):
        return np.vstack([np.zeros((3, 3)), self.sigma_accel * np.eye(3)])


@frozen
class CoupledPair(Diffusion):
    """A towing vessel and its tow on one line: the tow is pulled towards a place behind the vessel and damped by the water.

    p' = v, v' = w; q' = u, u' = k (p - q) + c (v - u) + w_2, where q is the tow's place less the length of the rope.
    Pang, Li, Godsill, Detection and Tracking of Coordinated Groups, IEEE T-AES 47, 2011.
    """

    kind = "coupled_pair"
    stiffness: float = vedette.fields.quantity("1/s^2", "k, of the rope", default=0.05, above=0, at_most=10)
    drag: float = vedette.fields.quantity("1/s", "c, of the relative velocity", default=0.2, above=0, at_most=10)
    sigma_lead: float = vedette.fields.quantity("m/s^2", "velocity that the vessel gains in 1 s", default=0.1, above=0)
    sigma_tow: float = vedette.fields.quantity("m/s^2", "velocity that the tow gains in 1 s", default=0.05, at_least=0)
    state = vedette.Space.of(x="m", vx="m/s", tow="m", tow_speed="m/s")

    def drift(self):
        k, c = self.stiffness, self.drag
        return np.array([[0, 1, 0, 0], [0, 0, 0, 0], [0, 0, 0, 1], [k, c, -k, -c]], dtype=float)

    def spread(self):
        return np.array([[0, 0], [self.sigma_lead, 0], [0, 0], [0, self.sigma_tow]], dtype=float)


@frozen
class TwoStateClock(Diffusion):
    """A receiver's clock: b' = d + white frequency noise, d' = random-walk frequency noise; b is c times the clock's error.

    Q = [q_b T + q_d T^3 / 3, q_d T^2 / 2; q_d T^2 / 2, q_d T].
    Brown, Hwang, Introduction to Random Signals and Applied Kalman Filtering, 1997.
    """

    kind = "two_state_clock"
    sigma_phase: float = vedette.fields.quantity("m", "error gained in 1 s by white frequency noise", default=0.3, above=0)
    sigma_drift: float = vedette.fields.quantity("m/s", "drift gained in 1 s", default=0.03, above=0)
    state = vedette.Space.of(clock_bias="m", clock_drift="m/s")

    def drift(self):
        return np.eye(2, k=1)

    def spread(self):
        return np.diag([self.sigma_phase, self.sigma_drift])


COMPONENTS = (
    Foreign("constant jerk", "motion", lambda: ConstantJerk(0.2)),
    Foreign("constant jerk in space", "motion", lambda: ConstantJerk(0.2, ("x", "y", "z"))),
    Foreign("Matern 3/2", "motion", lambda: Matern32(50.0, 20.0)),
    Foreign("spring and damper", "motion", SpringDamper),
    Foreign("Clohessy-Wiltshire", "motion", ClohessyWiltshire),
    Foreign("towed pair", "motion", CoupledPair),
    Foreign("two-state clock", "motion", TwoStateClock),
)
