"""Motion models in units, periods and state layouts of their own: km and hours, degrees, a torus, half turns, no noise."""

import numpy as np
from attrs import frozen

import vedette
from foreign import Foreign
from foreign.diffusion import Diffusion
from vedette.space import Axis, Space


def white(dt):
    """Return the noise of a position and its velocity, which gains white noise of density 1."""
    return np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])


def wrapped(angle):
    return np.mod(angle + np.pi, 2 * np.pi) - np.pi


class Steady(vedette.MotionModel):
    """Positions that move with their velocities, which gain white noise; a velocity of 1 moves by `pace` in 1 s."""

    divisible = True
    linear = True
    pace = 1.0

    def jacobian(self, x, dt):
        F = np.eye(len(self.state))
        for i, v in self.pairs:
            F[i, v] = self.pace * dt
        return F

    def move(self, x, dt):
        return self.state.canonical(x @ self.jacobian(x, dt).T)

    def noise(self, x, dt):
        Q = np.zeros((len(self.state), len(self.state)))
        for pair in self.pairs:
            Q[np.ix_(pair, pair)] = self.gained**2 * np.outer([self.pace, 1.0], [self.pace, 1.0]) * white(dt)
        return Q


@frozen
class Lorry(Steady):
    """A velocity in km/h that gains white noise, a position in km, time in s: x' = v / 3600.

    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 6.2.
    """

    kind = "lorry"
    gained: float = vedette.fields.quantity("km/h", "speed gained in 1 s", default=2, above=0, at_most=20)
    state = Space.of(x="km", vx="km/h", y="km", vy="km/h")
    pairs, pace = ((0, 1), (2, 3)), 1 / 3600


@frozen
class Globe(Diffusion):
    """Longitude and latitude in degrees that wander; the longitude wraps at 360.

    Gelb, Applied Optimal Estimation, 1974, section 4.3 (random walks).
    """

    kind = "globe"
    gained: float = vedette.fields.quantity("deg", "angle gained in 1 s", default=0.01, above=0, at_most=0.1)
    state = Space((Axis("longitude", "deg", 360.0), Axis("latitude", "deg")))

    def drift(self):
        return np.zeros((2, 2))

    def spread(self):
        return self.gained * np.eye(2)


@frozen
class Torus(Steady):
    """A vehicle in a world that closes on itself, 10 km by 4 km.

    Vicsek et al., Novel Type of Phase Transition in a System of Self-Driven Particles, PRL 75, 1995 (periodic boxes).
    """

    kind = "torus"
    gained: float = vedette.fields.quantity("m/s^1.5", "speed gained in 1 s", default=1, above=0, at_most=20)
    state = Space((Axis("x", "m", 1e4), Axis("y", "m", 4e3), Axis("vx", "m/s"), Axis("vy", "m/s")))
    pairs = ((0, 2), (1, 3))


@frozen
class Rod(Steady):
    """The direction of a rod without ends, which is the same after half a turn, and its rate.

    Mardia, Jupp, Directional Statistics, 2000, section 1.1 (axial data).
    """

    kind = "rod"
    gained: float = vedette.fields.quantity("rad/s^1.5", "rate gained in 1 s", default=0.01, above=0, at_most=0.1)
    state = Space((Axis("lie", "rad", np.pi), Axis("lie_rate", "rad/s")))
    pairs = ((0, 1),)


@frozen
class Climbing(Diffusion):
    """Turns at a known rate in the plane and rises: v' = w J v + noise, and the vertical speed wanders.

    Li, Jilkov, Survey of Maneuvering Target Tracking, Part I, IEEE T-AES 39, 2003, section V (known turn rate).
    """

    kind = "climbing"
    omega: float = vedette.fields.quantity("rad/s", "turn to the left", default=0.05, at_least=-1, at_most=1)
    sigma_accel: float = vedette.fields.quantity("m/s^1.5", "speed gained in 1 s, each way", default=1, above=0, at_most=20)
    state = Space.of(vz="m/s", z="m", vy="m/s", vx="m/s", y="m", x="m")

    def drift(self):
        A = np.zeros((6, 6))
        A[1, 0] = A[4, 2] = A[5, 3] = 1.0
        A[2, 3], A[3, 2] = self.omega, -self.omega
        return A

    def spread(self):
        G = np.zeros((6, 3))
        G[0, 0] = G[2, 1] = G[3, 2] = self.sigma_accel
        return G


@frozen
class Thermometer(Diffusion):
    """No position at all: a temperature and a loss in dB, each back to its mean at its own pace.

    Uhlenbeck, Ornstein, On the Theory of the Brownian Motion, Physical Review 36, 1930.
    """

    kind = "thermometer"
    slow: float = vedette.fields.quantity("s", "of the temperature", default=600, at_least=10, at_most=1e4)
    quick: float = vedette.fields.quantity("s", "of the loss", default=5, at_least=0.5, at_most=100)
    state = Space.of(temperature="K", loss="dB")

    def drift(self):
        return -np.diag([1 / self.slow, 1 / self.quick])

    def spread(self):
        return np.diag([2.0 * np.sqrt(2 / self.slow), 3.0 * np.sqrt(2 / self.quick)])


@frozen
class Clockwork(vedette.MotionModel):
    """Goes round a circle of known radius at a known rate, without any noise: only the phase is unknown.

    Kepler, Astronomia nova, 1609 (circular case).
    """

    kind = "clockwork"
    divisible = True
    rate: float = vedette.fields.quantity("rad/s", "of the phase", default=0.2, at_least=-2, at_most=2)
    state = Space.of(phase="rad mod 2pi")

    def move(self, x, dt):
        return self.state.canonical(x + self.rate * dt)

    def jacobian(self, x, dt):
        return np.eye(1)

    def noise(self, x, dt):
        return np.zeros((1, 1))


@frozen
class Drifter(vedette.MotionModel):
    """A buoy in a known current, which wanders about it: x' = x + c dt + w; affine, so not called linear.

    Okubo, Oceanic Diffusion Diagrams, Deep-Sea Research 18, 1971.
    """

    kind = "drifter"
    divisible = True
    east: float = vedette.fields.quantity("m/s", "of the current", default=0.5, at_least=-5, at_most=5)
    north: float = vedette.fields.quantity("m/s", "of the current", default=-0.2, at_least=-5, at_most=5)
    spread: float = vedette.fields.quantity("m", "gained in 1 s", default=0.5, above=0, at_most=10)
    state = Space.of(x="m", y="m")

    def move(self, x, dt):
        return x + dt * np.array([self.east, self.north])

    def jacobian(self, x, dt):
        return np.eye(2)

    def noise(self, x, dt):
        return self.spread**2 * dt * np.eye(2)


@frozen
class Helix(vedette.MotionModel):
    """Flies at a speed, a heading and an angle of climb that wander: x' = s cos c cos h, y' = s cos c sin h, z' = s sin c.

    Straight over a step; noise enters the three last axes.
    Blackman, Popoli, Design and Analysis of Modern Tracking Systems, 1999, section 4.2.
    """

    kind = "helix"
    sigma_speed: float = vedette.fields.quantity("m/s^1.5", "speed gained in 1 s", default=0.5, above=0, at_most=10)
    sigma_turn: float = vedette.fields.quantity("rad/s^0.5", "angle gained in 1 s", default=0.02, above=0, at_most=0.2)
    state = Space.of(x="m", y="m", z="m", speed="m/s", heading="rad mod 2pi", climb="rad")

    def move(self, x, dt):
        s, h, c = x[..., 3], x[..., 4], x[..., 5]
        way = np.stack([np.cos(c) * np.cos(h), np.cos(c) * np.sin(h), np.sin(c)], axis=-1) * (s * dt)[..., None]
        return np.concatenate([x[..., :3] + way, x[..., 3:]], axis=-1)

    def noise(self, x, dt):
        return dt * np.diag([0.0, 0.0, 0.0, self.sigma_speed, self.sigma_turn, self.sigma_turn]) ** 2


@frozen
class Polar(vedette.MotionModel):
    """A straight path in polar axes, exact: range, azimuth and their rates over Cartesian ones and back.

    Noise of the rates alone, over a short step: q [T^3/3 T^2/2; T^2/2 T] along and across the sight.
    Aidala, Hammel, Utilization of Modified Polar Coordinates for Bearings-Only Tracking, IEEE T-AC 28, 1983.
    """

    kind = "polar_path"
    sigma_range_rate: float = vedette.fields.quantity("m/s^1.5", "rate gained in 1 s", default=1, above=0, at_most=20)
    sigma_turn: float = vedette.fields.quantity("rad/s^1.5", "rate gained in 1 s", default=0.01, above=0, at_most=0.1)
    state = Space.of(range="m", azimuth="rad mod 2pi", range_rate="m/s", azimuth_rate="rad/s")

    def move(self, x, dt):
        r, a, rate, turn = np.moveaxis(x, -1, 0)
        r = np.where(np.abs(r) < 1.0, 1.0, r)
        along, across = r + dt * rate, dt * r * turn
        far = np.hypot(along, across)
        far = np.where(far < 1e-9, 1e-9, far)
        speed = (along * rate + across * r * turn) / far
        swing = (along * r * turn - across * rate) / far**2
        moved = np.stack([far, wrapped(a + np.arctan2(across, along)), speed, swing], axis=-1)
        return np.where(dt == 0, x, moved)

    def noise(self, x, dt):
        return np.kron(white(dt), np.diag([self.sigma_range_rate**2, self.sigma_turn**2]))


@frozen
class Cruise(vedette.MotionModel):
    """Along its heading at a speed that goes back to a cruising speed; the path over a step is integrated exactly.

    s(t) = c + (s - c) exp(-t / T), so the way is c t + (s - c) T (1 - exp(-t / T)).
    Millefiori et al., Modeling Vessel Kinematics Using a Stochastic Mean-Reverting Process, IEEE T-AES 52, 2016.
    """

    kind = "cruise"
    cruising: float = vedette.fields.quantity("m/s", "speed to which it returns", default=8, at_least=0, at_most=40)
    settling: float = vedette.fields.quantity("s", "in which it does", default=60, at_least=5, at_most=1000)
    sigma_speed: float = vedette.fields.quantity("m/s^1.5", "speed gained in 1 s", default=0.3, above=0, at_most=5)
    sigma_heading: float = vedette.fields.quantity("rad/s^0.5", "angle gained in 1 s", default=0.02, above=0, at_most=0.2)
    state = Space.of(heading="rad mod 2pi", x="m", speed="m/s", y="m")

    def move(self, x, dt):
        h, s = x[..., 0], x[..., 2]
        left = np.exp(-dt / self.settling)
        way = self.cruising * dt + (s - self.cruising) * self.settling * -np.expm1(-dt / self.settling)
        new = self.cruising + (s - self.cruising) * left
        new = s if dt == 0 else new
        return np.stack([h, x[..., 1] + way * np.cos(h), new, x[..., 3] + way * np.sin(h)], axis=-1)

    def noise(self, x, dt):
        kept = -np.expm1(-2 * dt / self.settling) * self.settling / 2
        return np.diag([self.sigma_heading**2 * dt, 0.0, self.sigma_speed**2 * kept, 0.0])


COMPONENTS = (
    Foreign("lorry", "motion", Lorry),
    Foreign("globe", "motion", Globe),
    Foreign("torus", "motion", Torus),
    Foreign("rod", "motion", Rod),
    Foreign("climbing", "motion", Climbing),
    Foreign("thermometer", "motion", Thermometer),
    Foreign("clockwork", "motion", Clockwork),
    Foreign("drifter", "motion", Drifter),
    Foreign("helix", "motion", Helix),
    Foreign("polar path", "motion", Polar),
    Foreign("cruise", "motion", Cruise),
)
