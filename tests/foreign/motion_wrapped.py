"""Motion models with an axis that wraps, a rest that is not 0, or axes without variance."""

import numpy as np
from attrs import frozen

import vedette
from foreign import Foreign
from foreign.diffusion import Diffusion, discretised


@frozen
class CompassGyro(Diffusion):
    """A heading by a gyro with a drifting bias: h' = -b + white noise, b' = -b / tau + white noise, b stationary.

    The gyro's own reading is taken out before: the heading is that relative to its dead reckoning.
    Farrenkopf, Analytic Steady-State Accuracy Solutions for Two Common Spacecraft Attitude Estimators, JGC 1, 1978.
    """

    kind = "compass_gyro"
    sigma_walk: float = vedette.fields.quantity("rad", "angle gained in 1 s", default=0.01, above=0, at_most=1)
    sigma_bias: float = vedette.fields.quantity(
        "rad/s", "stationary deviation of the bias", default=0.01, above=0, at_most=1
    )
    tau: float = vedette.fields.quantity("s", "time after which a bias is down to 1/e", default=100, above=0)
    state = vedette.Space.of(heading="rad mod 2pi", gyro_bias="rad/s")

    def drift(self):
        return np.array([[0.0, -1.0], [0.0, -1.0 / self.tau]])

    def spread(self):
        return np.diag([self.sigma_walk, self.sigma_bias * np.sqrt(2.0 / self.tau)])


@frozen
class RingRoad(Diffusion):
    """A vehicle on a closed road: its path wraps with the length of the road, its speed gains white noise.

    F = [1 T; 0 1], Q = q [T^3/3 T^2/2; T^2/2 T] along the road.
    Ulmke, Koch, Road-Map Assisted Ground Moving Target Tracking, IEEE T-AES 42, 2006.
    """

    kind = "ring_road"
    length: float = vedette.fields.quantity("m", "once around", default=2000, at_least=100)
    sigma_accel: float = vedette.fields.quantity("m/s^2", "speed gained in 1 s", default=0.5, above=0)

    @property
    def state(self):
        return vedette.Space((vedette.Axis("path", "m", self.length), vedette.Axis("speed", "m/s")))

    def drift(self):
        return np.eye(2, k=1)

    def spread(self):
        return np.array([[0.0], [self.sigma_accel]])


@frozen
class CurrentStatistical(vedette.MotionModel):
    """Singer's acceleration around a mean that is not 0: a' = -(a - mean) / tau + white noise, exactly discretised.

    x' = r + F (x - r) + displacement of a body whose acceleration rests at the mean: affine, not linear.
    Zhou, Kumar, A Current Statistical Model and Adaptive Algorithm for Estimating Maneuvering Targets, JGCD 7, 1984.
    """

    kind = "current_statistical"
    divisible = True
    tau: float = vedette.fields.quantity("s", "time after which an acceleration is down to 1/e", default=20, above=0)
    sigma_accel: float = vedette.fields.quantity("m/s^2", "stationary deviation of the acceleration", default=1, above=0)
    mean_x: float = vedette.fields.quantity("m/s^2", "mean acceleration along x", default=0.5, at_least=-50, at_most=50)
    mean_y: float = vedette.fields.quantity("m/s^2", "mean acceleration along y", default=-0.2, at_least=-50, at_most=50)
    state = vedette.Space.of(x="m", y="m", vx="m/s", vy="m/s", ax="m/s^2", ay="m/s^2")

    def _step(self, dt):
        drift = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0 / self.tau]])
        return discretised(drift, np.array([[0.0], [0.0], [self.sigma_accel * np.sqrt(2.0 / self.tau)]]), dt)

    def move(self, x, dt):
        mean = np.array([self.mean_x, self.mean_y])
        rest = np.concatenate([np.zeros(4), mean])
        carried = np.concatenate([dt**2 / 2 * mean, dt * mean, np.zeros(2)])
        return rest + carried + (x - rest) @ self.jacobian(x, dt).T

    def jacobian(self, x, dt):
        return np.kron(self._step(dt)[0], np.eye(2))

    def noise(self, x, dt):
        return np.kron(self._step(dt)[1], np.eye(2))


@frozen
class KnownCurrent(vedette.MotionModel):
    """Nearly constant velocity through water that itself moves: p' = v + c, v' = white noise; the current c is known.

    The current has no variance: it is set by rules, such as a table of tides.
    Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2011, section 8.3.
    """

    kind = "known_current"
    divisible = True
    linear = True
    sigma_accel: float = vedette.fields.quantity("m/s^2", "velocity gained in 1 s, per axis", default=0.1, above=0)
    state = vedette.Space.of(x="m", y="m", vx="m/s", vy="m/s", current_x="m/s", current_y="m/s")

    @property
    def zero_variance(self):
        return vedette.Space.of(current_x="m/s", current_y="m/s")

    def move(self, x, dt):
        return x @ self.jacobian(x, dt).T

    def jacobian(self, x, dt):
        return np.kron([[1.0, dt, dt], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], np.eye(2))

    def noise(self, x, dt):
        each = [[dt**3 / 3, dt**2 / 2, 0.0], [dt**2 / 2, dt, 0.0], [0.0, 0.0, 0.0]]
        return self.sigma_accel**2 * np.kron(each, np.eye(2))


@frozen
class SpeedScaledNoise(vedette.MotionModel):
    """Nearly constant velocity with white acceleration of density sigma^2 + (share |v|)^2: who is fast turns harder.

    F = [1 T; 0 1], Q = (sigma^2 + share^2 |v|^2) [T^3/3 T^2/2; T^2/2 T] per axis.
    Li, Jilkov, Survey of Maneuvering Target Tracking, Part I: Dynamic Models, IEEE T-AES 39, 2003, section III.
    """

    kind = "speed_scaled_noise"
    sigma_accel: float = vedette.fields.quantity("m/s^2", "velocity gained in 1 s at rest, per axis", default=0.1, above=0)
    share: float = vedette.fields.quantity(
        "1/s", "gained in 1 s beyond it, over the speed", default=0.05, above=0, at_most=10
    )
    state = vedette.Space.of(x="m", y="m", vx="m/s", vy="m/s")

    def move(self, x, dt):
        return np.concatenate([x[..., :2] + dt * x[..., 2:], x[..., 2:]], axis=-1)

    def jacobian(self, x, dt):
        return np.kron([[1.0, dt], [0.0, 1.0]], np.eye(2))

    def noise(self, x, dt):
        density = self.sigma_accel**2 + self.share**2 * np.sum(x[..., 2:] ** 2, axis=-1)
        return density[..., None, None] * np.kron([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]], np.eye(2))


@frozen
class CourseFrame(vedette.MotionModel):
    """Speeds along and across a course, which gain noises of their own; the course has no variance and is set by rule.

    p' = along (cos c, sin c) + across (-sin c, cos c). Before each prediction the frame turns to the combined velocity.
    Li, Jilkov, Survey of Maneuvering Target Tracking, Part I: Dynamic Models, IEEE T-AES 39, 2003, section V.
    """

    kind = "course_frame"
    reframes = True
    sigma_along: float = vedette.fields.quantity("m/s^2", "speed along gained in 1 s", default=0.1, above=0)
    sigma_across: float = vedette.fields.quantity("m/s^2", "speed across gained in 1 s", default=0.5, above=0)
    state = vedette.Space.of(x="m", y="m", along="m/s", across="m/s", course="rad mod 2pi")
    zero_variance = vedette.Space.of(course="rad mod 2pi")

    def move(self, x, dt):
        moved = x.copy()
        moved[..., :2] += dt * (_turn(x[..., 4]) @ x[..., 2:4, None])[..., 0]
        return self.state.canonical(moved)

    def jacobian(self, x, dt):
        turn = _turn(x[..., 4])
        F = np.zeros((*x.shape[:-1], 5, 5)) + np.eye(5)
        F[..., :2, 2:4] = dt * turn
        sideways = np.stack([-x[..., 3], x[..., 2]], axis=-1)
        F[..., :2, 4] = dt * (turn @ sideways[..., None])[..., 0]
        return F

    def noise(self, x, dt):
        turn, densities = _turn(x[..., 4]), np.diag([self.sigma_along**2, self.sigma_across**2])
        Q = np.zeros((*x.shape[:-1], 5, 5))
        Q[..., :2, :2] = dt**3 / 3 * turn @ densities @ np.swapaxes(turn, -1, -2)
        Q[..., :2, 2:4] = dt**2 / 2 * turn @ densities
        Q[..., 2:4, :2] = np.swapaxes(Q[..., :2, 2:4], -1, -2)
        Q[..., 2:4, 2:4] = dt * densities
        return Q

    def reframe(self, own, combined):
        ahead = combined.mean[..., 4] + np.arctan2(combined.mean[..., 3], combined.mean[..., 2])
        M = np.zeros((*own.mean.shape, 5)) + np.diag([1.0, 1.0, 0.0, 0.0, 0.0])
        M[..., 2:4, 2:4] = _turn(own.mean[..., 4] - ahead)
        mean = (M @ own.mean[..., None])[..., 0]
        mean[..., 4] = ahead
        return vedette.Gaussian(self.state.canonical(mean), M @ own.cov @ np.swapaxes(M, -1, -2))


def _turn(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([np.stack([c, -s], axis=-1), np.stack([s, c], axis=-1)], axis=-2)


COMPONENTS = (
    Foreign("compass and gyro", "motion", CompassGyro),
    Foreign("ring road", "motion", RingRoad),
    Foreign("current statistical model", "motion", CurrentStatistical),
    Foreign("known current", "motion", KnownCurrent),
    Foreign("speed-scaled noise", "motion", SpeedScaledNoise),
    Foreign("course frame", "motion", CourseFrame),
)
