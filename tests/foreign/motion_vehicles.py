"""Nonlinear motion models in closed form: vehicles and orbits."""

import numpy as np
from attrs import frozen

import vedette
from foreign import Foreign

NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)


@frozen
class Bicycle(vedette.MotionModel):
    """The kinematic bicycle: at constant speed and steering the rear axle goes along an arc of curvature k = tan(d) / base.

    d = lock tanh(steer / lock), so the wheel never turns beyond its lock. With s = v T and turn f = k s the chord is
    s sinc(f / 2) along heading + f / 2. Speed and steering gain white noise.
    Rajamani, Vehicle Dynamics and Control, 2012, section 2.2.
    """

    kind = "bicycle"
    base: float = vedette.fields.quantity("m", "distance of the axles", default=3, at_least=1, at_most=20)
    lock: float = vedette.fields.quantity("rad", "largest angle of the wheel", default=0.6, at_least=0.1, at_most=1)
    sigma_accel: float = vedette.fields.quantity("m/s^2", "speed gained in 1 s", default=0.5, above=0)
    sigma_steer: float = vedette.fields.quantity("rad", "steering gained in 1 s", default=0.05, above=0, at_most=1)
    state = vedette.Space.of(x="m", y="m", heading="rad mod 2pi", speed="m/s", steer="rad")

    def _arc(self, x, dt):
        path = x[..., 3] * dt
        soft = np.tanh(x[..., 4] / self.lock)
        curvature = np.tan(self.lock * soft) / self.base
        bend = (1 - soft**2) / np.cos(self.lock * soft) ** 2 / self.base  # d curvature / d steer
        return path, curvature, bend

    def move(self, x, dt):
        path, curvature, _ = self._arc(x, dt)
        half = curvature * path / 2
        chord, towards = path * np.sinc(half / np.pi), x[..., 2] + half
        place = x[..., :2] + chord[..., None] * np.stack([np.cos(towards), np.sin(towards)], axis=-1)
        turned = x[..., 2, None] + 2 * half[..., None]
        return self.state.canonical(np.concatenate([place, turned, x[..., 3:]], axis=-1))

    def jacobian(self, x, dt):
        path, curvature, bend = self._arc(x, dt)
        half = curvature * path / 2
        small = np.abs(half) < 1e-3
        safe = np.where(small, 1.0, half)
        sinc = np.sinc(half / np.pi)
        slope = np.where(small, -half / 3 + half**3 / 30, (np.cos(safe) - np.sin(safe) / safe) / safe)
        c, s = np.cos(x[..., 2] + half), np.sin(x[..., 2] + half)
        F = np.zeros((*x.shape[:-1], 5, 5)) + np.eye(5)
        F[..., 0, 2], F[..., 1, 2] = -path * sinc * s, path * sinc * c
        F[..., 0, 3] = dt * np.cos(x[..., 2] + 2 * half)
        F[..., 1, 3] = dt * np.sin(x[..., 2] + 2 * half)
        F[..., 2, 3] = dt * curvature
        F[..., 0, 4] = bend * path**2 / 2 * (slope * c - sinc * s)
        F[..., 1, 4] = bend * path**2 / 2 * (slope * s + sinc * c)
        F[..., 2, 4] = bend * path
        return F

    def noise(self, x, dt):
        return dt * np.diag([0.0, 0.0, 0.0, self.sigma_accel**2, self.sigma_steer**2])


@frozen
class AcceleratedTurn(vedette.MotionModel):
    """Constant turn rate and acceleration along the path: h' = w, v' = a; the path is integrated by Gauss and Legendre.

    Turn rate and acceleration gain white noise, which reaches heading and speed too: [T^3/3 T^2/2; T^2/2 T].
    Schubert, Richter, Wanielik, Comparison and Evaluation of Advanced Motion Models for Vehicle Tracking, FUSION 2008.
    """

    kind = "accelerated_turn"
    sigma_turn: float = vedette.fields.quantity("rad/s^2", "turn rate gained in 1 s", default=0.02, above=0, at_most=1)
    sigma_jerk: float = vedette.fields.quantity("m/s^3", "acceleration gained in 1 s", default=0.3, above=0)
    state = vedette.Space.of(x="m", y="m", heading="rad mod 2pi", speed="m/s", turn_rate="rad/s", accel="m/s^2")

    def move(self, x, dt):
        t = dt * (NODES + 1) / 2
        heading = x[..., 2, None] + x[..., 4, None] * t
        speed = x[..., 3, None] + x[..., 5, None] * t
        gone = dt / 2 * np.stack([(speed * np.cos(heading)) @ WEIGHTS, (speed * np.sin(heading)) @ WEIGHTS], axis=-1)
        return self.state.canonical(np.concatenate([x[..., :2] + gone, x[..., 2:4] + dt * x[..., 4:], x[..., 4:]], axis=-1))

    def noise(self, x, dt):
        Q = np.zeros((6, 6))
        each = np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
        Q[2::2, 2::2] = self.sigma_turn**2 * each
        Q[3::2, 3::2] = self.sigma_jerk**2 * each
        return Q


@frozen
class KeplerElements(vedette.MotionModel):
    """An orbit by its height (semi-major axis less the Earth's radius), mean longitude l, and eccentricity vector (h, k).

    l' = l + n T, n = sqrt(mu / a^3), dn/da = -3 n / (2 a); drag noise on the height moves l as well.
    Vallado, Fundamentals of Astrodynamics and Applications, 2013, chapter 2.
    """

    kind = "kepler_elements"
    sigma_height: float = vedette.fields.quantity("km", "height gained in 1 s", default=0.001, above=0, at_most=10)
    sigma_shape: float = vedette.fields.quantity("1", "eccentricity gained in 1 s", default=1e-4, above=0, at_most=1)
    state = vedette.Space.of(height="km", longitude="rad mod 2pi", h="1", k="1")

    def _rate(self, x):
        axis = np.maximum(6378.137 + x[..., 0], 1000.0)  # within the Earth nothing orbits
        rate = np.sqrt(398600.4418 / axis**3)
        return rate, np.where(6378.137 + x[..., 0] > 1000.0, -1.5 * rate / axis, 0.0)

    def move(self, x, dt):
        moved = x.copy()
        moved[..., 1] += self._rate(x)[0] * dt
        return self.state.canonical(moved)

    def jacobian(self, x, dt):
        F = np.zeros((*x.shape[:-1], 4, 4)) + np.eye(4)
        F[..., 1, 0] = self._rate(x)[1] * dt
        return F

    def noise(self, x, dt):
        slope = self._rate(x)[1]
        Q = np.zeros((*x.shape[:-1], 4, 4)) + dt * self.sigma_shape**2 * np.diag([0.0, 0.0, 1.0, 1.0])
        Q[..., 0, 0] = self.sigma_height**2 * dt
        Q[..., 0, 1] = Q[..., 1, 0] = self.sigma_height**2 * slope * dt**2 / 2
        Q[..., 1, 1] = self.sigma_height**2 * slope**2 * dt**3 / 3
        return Q


@frozen
class LogisticSpeed(vedette.MotionModel):
    """A vehicle that approaches its top speed: v' = r v (1 - v / top), by its state u = log(v / (top - v)), so that u' = r.

    The path is (top / r) (softplus(u + r T) - softplus(u)) along a heading that wanders.
    Verhulst, Notice sur la loi que la population suit dans son accroissement, Corr. Math. Phys. 10, 1838.
    """

    kind = "logistic_speed"
    top: float = vedette.fields.quantity("m/s", "top speed", default=30, above=0)
    rate: float = vedette.fields.quantity("1/s", "how fast it is approached", default=0.1, above=0.001, at_most=10)
    sigma_heading: float = vedette.fields.quantity("rad", "heading gained in 1 s", default=0.02, above=0, at_most=1)
    sigma_u: float = vedette.fields.quantity("1", "u gained in 1 s", default=0.1, above=0, at_most=10)
    state = vedette.Space.of(x="m", y="m", heading="rad mod 2pi", u="1")

    def _path(self, u, dt):
        return self.top / self.rate * (np.logaddexp(0.0, u + self.rate * dt) - np.logaddexp(0.0, u))

    def move(self, x, dt):
        path, h = self._path(x[..., 3], dt), x[..., 2]
        step = np.stack([path * np.cos(h), path * np.sin(h), np.zeros_like(h), np.full_like(h, self.rate * dt)], axis=-1)
        return self.state.displace(x, step)

    def jacobian(self, x, dt):
        h, u = x[..., 2], x[..., 3]
        path = self._path(u, dt)
        slope = self.top / self.rate * (_logistic(u + self.rate * dt) - _logistic(u))
        F = np.zeros((*x.shape[:-1], 4, 4)) + np.eye(4)
        F[..., 0, 2], F[..., 0, 3] = -path * np.sin(h), slope * np.cos(h)
        F[..., 1, 2], F[..., 1, 3] = path * np.cos(h), slope * np.sin(h)
        return F

    def noise(self, x, dt):
        return dt * np.diag([0.0, 0.0, self.sigma_heading**2, self.sigma_u**2])


def _logistic(u):
    return (1 + np.tanh(u / 2)) / 2


COMPONENTS = (
    Foreign("bicycle", "motion", Bicycle),
    Foreign("accelerated turn", "motion", AcceleratedTurn),
    Foreign("Kepler elements", "motion", KeplerElements),
    Foreign("logistic speed", "motion", LogisticSpeed),
)
