"""Sensors in other units and of other sets: km and degrees, delays in ms, range and Doppler alone, tilted errors, gyros."""

import numpy as np
from attrs import evolve, field, frozen

import vedette
from foreign import Foreign
from foreign.sensor_active import polar
from foreign.sensor_passive import towards
from vedette.space import Axis, Space

DEGREES = 180 / np.pi
PLANE, MOVING = Space.of(x="m", y="m"), Space.of(x="m", y="m", vx="m/s", vy="m/s")


class Even(vedette.Sensor):
    """Sees what it sees with one probability and constant noise; false returns, if any, are even over `volume`."""

    detection_probability = 0.9
    clutter_per_scan = 0.0
    volume = 1.0

    def noise(self, x):
        return np.diag(np.square(self.sigmas))

    def detects(self, x):
        return np.array(self.detection_probability)

    def clutter(self, z):
        return np.array(self.clutter_per_scan / self.volume)


@frozen
class Survey(Even):
    """Range in km and azimuth in degrees from north, clockwise, which wraps at 360.

    Skolnik, Introduction to Radar Systems, 2001, chapter 1.
    """

    kind = "survey"
    observes = PLANE
    measurement = Space((Axis("distance", "km"), Axis("azimuth", "deg", 360.0)))
    max_range: float = vedette.fields.quantity("km", "beyond which nothing is seen", default=20, at_least=5, at_most=60)
    sigma_distance: float = vedette.fields.quantity("km", "deviation", default=0.05, above=0, at_most=1)
    sigma_azimuth: float = vedette.fields.quantity("deg", "deviation", default=0.3, above=0, at_most=3)

    @property
    def sigmas(self):
        return [self.sigma_distance, self.sigma_azimuth]

    def measure(self, x):
        r = np.hypot(x[..., 0], x[..., 1])
        return self.measurement.canonical(np.stack([r / 1e3, DEGREES * np.arctan2(x[..., 0], x[..., 1])], axis=-1))

    def covers(self, z):
        return z[..., 0] <= self.max_range

    def detects(self, x):
        return np.where(np.hypot(x[..., 0], x[..., 1]) <= 1e3 * self.max_range, 0.9, 0.0)

    def invert(self, z, noise=None):
        r, c, s = 1e3 * z[..., 0], np.cos(z[..., 1] / DEGREES), np.sin(z[..., 1] / DEGREES)
        J = np.stack(
            [np.stack([1e3 * s, r * c / DEGREES], axis=-1), np.stack([1e3 * c, -r * s / DEGREES], axis=-1)], axis=-2
        )
        R = self.noise(z) if noise is None else noise
        return vedette.Gaussian(r[..., None] * np.stack([s, c], axis=-1), J @ R @ np.swapaxes(J, -1, -2))


@frozen
class RangeDoppler(Even):
    """A continuous-wave radar: distance and how fast it grows, no direction.

    Richards, Scheer, Holm, Principles of Modern Radar: Basic Principles, 2010, chapter 8.
    """

    kind = "range_doppler"
    observes = MOVING
    measurement = Space.of(range="m", range_rate="m/s")
    sigma_range: float = vedette.fields.quantity("m", "deviation", default=3, above=0, at_most=50)
    sigma_range_rate: float = vedette.fields.quantity("m/s", "deviation", default=0.2, above=0, at_most=5)

    @property
    def sigmas(self):
        return [self.sigma_range, self.sigma_range_rate]

    def measure(self, x):
        r, u = towards(x[..., :2], np.zeros(2))
        return np.stack([r, np.sum(u * x[..., 2:], axis=-1)], axis=-1)


@frozen
class Goniometer(Even):
    """Azimuth and elevation in degrees of what flies, nothing else.

    Stansfield, Statistical Theory of D.F. Fixing, Journal of the IEE 94, 1947.
    """

    kind = "goniometer"
    observes = Space.of(x="m", y="m", z="m")
    measurement = Space((Axis("azimuth", "deg", 360.0), Axis("elevation", "deg")))
    sigma_angle: float = vedette.fields.quantity("deg", "deviation of each", default=0.2, above=0, at_most=2)

    @property
    def sigmas(self):
        return [self.sigma_angle, self.sigma_angle]

    def measure(self, x):
        azimuth = np.arctan2(x[..., 1], x[..., 0])
        elevation = np.arctan2(x[..., 2], np.hypot(x[..., 0], x[..., 1]))
        return self.measurement.canonical(DEGREES * np.stack([azimuth, elevation], axis=-1))


@frozen
class Echo(Even):
    """The time of an echo in ms at a known speed of sound, where one stands.

    Urick, Principles of Underwater Sound, 1983, chapter 5.
    """

    kind = "echo"
    observes = PLANE
    measurement = Space.of(delay="ms")
    sigma_delay: float = vedette.fields.quantity("ms", "deviation", default=2, above=0, at_most=50)
    speed_of_sound: float = vedette.fields.quantity("m/s", "in the water", default=1500, at_least=1400, at_most=1600)

    @property
    def sigmas(self):
        return [self.sigma_delay]

    def measure(self, x):
        return 2e3 * towards(x, np.zeros(2))[0][..., None] / self.speed_of_sound


@frozen
class Tilted(vedette.Sensor):
    """Reported x and y of a radar, whose errors lie along and across the sight: R = T diag(s_r^2, (r s_b)^2 + 1) T'.

    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 10.4.3.
    """

    kind = "tilted"
    observes = measurement = PLANE
    sigma_range: float = vedette.fields.quantity("m", "deviation along the sight", default=5, at_least=1, at_most=100)
    sigma_bearing: float = vedette.fields.quantity("rad", "deviation of the bearing", default=0.01, above=0, at_most=0.05)
    density: float = vedette.fields.quantity("1/m^2", "false reports", default=1e-7, at_least=0, at_most=1e-4)

    def measure(self, x):
        return x + 0.0

    def jacobian(self, x):
        return np.eye(2)

    def noise(self, x):
        r, a = np.hypot(x[..., 0], x[..., 1]), np.arctan2(x[..., 1], x[..., 0])
        u, across = np.stack([np.cos(a), np.sin(a)], axis=-1), np.stack([-np.sin(a), np.cos(a)], axis=-1)
        along = self.sigma_range**2 * u[..., :, None] * u[..., None, :]
        return along + ((r * self.sigma_bearing) ** 2 + 1.0)[..., None, None] * across[..., :, None] * across[..., None, :]

    def detects(self, x):
        return np.array(0.95)

    def clutter(self, z):
        return np.array(self.density)

    def invert(self, z, noise=None):
        return vedette.Gaussian(z, np.broadcast_to(self.noise(z) if noise is None else noise, (*z.shape, 2)))


@frozen
class Bistatic(Even):
    """The whole way from a transmitter over the target, and the bearing from the receiver at the origin.

    Willis, Bistatic Radar, 2005, chapter 3.
    """

    kind = "bistatic_way"
    observes = PLANE
    measurement = Space.of(way="m", bearing="rad mod 2pi")
    sigma_way: float = vedette.fields.quantity("m", "deviation", default=10, above=0, at_most=100)
    sigma_bearing: float = vedette.fields.quantity("rad", "deviation", default=0.01, above=0, at_most=0.05)
    base: float = vedette.fields.quantity("m", "from receiver to transmitter, along x", default=3000, at_least=100)

    @property
    def sigmas(self):
        return [self.sigma_way, self.sigma_bearing]

    def measure(self, x):
        way = towards(x, np.zeros(2))[0] + towards(x, np.array([self.base, 0.0]))[0]
        return np.stack([way, polar(x)[0][..., 1]], axis=-1)


@frozen
class Transponder(vedette.Sensor):
    """All of a state at once, with correlated errors: what one filter reports to another.

    Chong, Mori, Chang, Distributed Multitarget Multisensor Tracking, 1990 (tracks as measurements).
    """

    kind = "transponder"
    linear = True
    observes = measurement = Space.of(vx="m/s", x="m", vy="m/s", y="m")
    sigma: float = vedette.fields.quantity("m", "deviation of a position", default=8, above=0, at_most=100)
    interval: float = vedette.fields.quantity("s", "over which velocities were taken", default=4, at_least=1, at_most=60)

    def measure(self, x):
        return x + 0.0

    def jacobian(self, x):
        return np.eye(4)

    def noise(self, x):
        T = self.interval
        return self.sigma**2 * np.kron(np.eye(2), [[2 / T**2, 1 / T], [1 / T, 1.0]])

    def detects(self, x):
        return np.ones(())

    def clutter(self, z):
        return np.zeros(())

    def invert(self, z, noise=None):
        R = self.noise(z) if noise is None else noise
        return vedette.Gaussian(z, np.broadcast_to(R, (*z.shape, 4)))


@frozen
class Magnetometer(vedette.Sensor):
    """A heading and a rate of turn, of any place.

    Farrell, Aided Navigation, 2008, chapter 10.
    """

    kind = "magnetometer"
    linear = True
    observes = measurement = Space.of(heading="rad mod 2pi", turn_rate="rad/s")
    sigma_heading: float = vedette.fields.quantity("rad", "deviation", default=0.02, above=0, at_most=0.2)
    sigma_turn_rate: float = vedette.fields.quantity("rad/s", "deviation", default=0.005, above=0, at_most=0.05)

    def measure(self, x):
        return self.measurement.canonical(x)

    def jacobian(self, x):
        return np.eye(2)

    def noise(self, x):
        return np.diag([self.sigma_heading**2, self.sigma_turn_rate**2])

    def detects(self, x):
        return np.array(1.0)

    def clutter(self, z):
        return np.array(0.0)


@frozen
class Curtain(Even):
    """Tells where along a line a target is, but only one that is near the line; a miss elsewhere is nothing.

    Skolnik, Radar Handbook, 2008, chapter 17 (fences).
    """

    kind = "curtain"
    observes = PLANE
    measurement = Space.of(along="m")
    sigma_along: float = vedette.fields.quantity("m", "deviation", default=5, above=0, at_most=50)
    depth: float = vedette.fields.quantity("m", "distance at which P_D has fallen to .9 / e", default=200, at_least=10)

    @property
    def sigmas(self):
        return [self.sigma_along]

    def measure(self, x):
        return x[..., :1] + 0.0

    def detects(self, x):
        return 0.9 * np.exp(-np.abs(x[..., 1]) / self.depth)


@frozen
class Altimeter(Even):
    """A height above a datum, and the climb: affine, for the datum is not 0.

    U.S. Standard Atmosphere, NOAA, 1976.
    """

    kind = "altimeter"
    observes = Space.of(z="m", vz="m/s")
    measurement = Space.of(height="m", climb="m/s")
    sigma_height: float = vedette.fields.quantity("m", "deviation", default=15, above=0, at_most=100)
    sigma_climb: float = vedette.fields.quantity("m/s", "deviation", default=0.5, above=0, at_most=10)
    datum: float = vedette.fields.quantity("m", "height of the origin", default=250, at_least=-500, at_most=5000)

    @property
    def sigmas(self):
        return [self.sigma_height, self.sigma_climb]

    def measure(self, x):
        return x + np.array([self.datum, 0.0])


@frozen
class Merging(Even):
    """A grid of positions that cannot tell two targets within a cell apart.

    Koch, van Keuk, Multiple Hypothesis Track Maintenance with Possibly Unresolved Measurements, IEEE T-AES 33, 1997.
    """

    kind = "merging"
    linear = True
    observes = measurement = PLANE
    sigma: float = vedette.fields.quantity("m", "deviation", default=5, above=0, at_most=100)
    cell: float = vedette.fields.quantity(
        "m", "distance at which two merge with probability 1 / sqrt(e)", default=40, above=0
    )

    @property
    def sigmas(self):
        return [self.sigma, self.sigma]

    def measure(self, x):
        return x + 0.0

    def jacobian(self, x):
        return np.eye(2)

    def unresolved(self, x):
        return self.cell**2 * np.eye(2)

    def invert(self, z, noise=None):
        return vedette.Gaussian(z, np.broadcast_to(self.noise(z) if noise is None else noise, (*z.shape, 2)))


@frozen
class Wedge(Even):
    """Ranges and bearings within a wedge around its own axis, wherever its platform stands and heads.

    Richards, Scheer, Holm, Principles of Modern Radar: Basic Principles, 2010, chapter 3.
    """

    kind = "wedge"
    observes = PLANE
    measurement = Space.of(range="m", bearing="rad mod 2pi")
    sigma_range: float = vedette.fields.quantity("m", "deviation", default=4, above=0, at_most=50)
    sigma_bearing: float = vedette.fields.quantity("rad", "deviation", default=0.01, above=0, at_most=0.05)
    reach: float = vedette.fields.quantity("m", "of its sight", default=4000, at_least=500, at_most=2e4)
    clutter_per_scan: float = vedette.fields.quantity("1", "false returns", default=2, at_least=0, at_most=50)
    pose: vedette.Pose = field(init=False, repr=False, eq=False, default=vedette.Pose(np.zeros(2)))

    @property
    def sigmas(self):
        return [self.sigma_range, self.sigma_bearing]

    def measure(self, x):
        seen, _ = polar(x - self.pose.position[..., None, :] if self.pose.position.ndim > 1 else x - self.pose.position)
        turn = np.asarray(self.pose.heading, dtype=float)
        return self.measurement.canonical(seen - np.stack([0 * turn, turn], axis=-1)[..., None, :] if turn.ndim else
                                          seen - np.array([0.0, turn]))  # fmt: skip

    def _inside(self, z):
        z = self.measurement.canonical(z)
        return (z[..., 0] >= 0) & (z[..., 0] <= self.reach) & (np.abs(z[..., 1]) <= 1.0)

    def covers(self, z):
        return self._inside(z)

    def detects(self, x):
        return np.where(self._inside(self.measure(x)), 0.9, 0.0)

    def clutter(self, z):
        return np.array(self.clutter_per_scan / (2.0 * self.reach))

    def at(self, pose):
        placed = evolve(self)
        object.__setattr__(placed, "pose", vedette.Pose(pose.position[..., :2], heading=pose.heading))
        return placed


COMPONENTS = (
    Foreign("survey", "sensor", Survey),
    Foreign("range and Doppler", "sensor", RangeDoppler),
    Foreign("goniometer", "sensor", Goniometer),
    Foreign("echo", "sensor", Echo),
    Foreign("tilted errors", "sensor", Tilted),
    Foreign("bistatic way", "sensor", Bistatic),
    Foreign("transponder", "sensor", Transponder),
    Foreign("magnetometer", "sensor", Magnetometer),
    Foreign("curtain", "sensor", Curtain),
    Foreign("altimeter", "sensor", Altimeter),
    Foreign("merging", "sensor", Merging),
    Foreign("wedge", "sensor", Wedge),
)
