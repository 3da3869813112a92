"""Sensors of few axes: a barometer, a pseudorange, a distance across a lane, a report that may lack its speed, an array."""

import numpy as np
from attrs import field, frozen

import vedette
from foreign import Foreign
from foreign.sensor_passive import towards


@frozen
class Barometer(vedette.Sensor):
    """The pressure at a target's height: p = p_0 exp(-z / H) + v, as a transponder reports it.

    dp/dz = -p / H, H = 8434 m. There is no clutter.
    U.S. Standard Atmosphere, NOAA, 1976.
    """

    kind = "barometer"
    observes = vedette.Space.of(z="m")
    measurement = vedette.Space.of(pressure="hPa")
    sigma: float = vedette.fields.quantity("hPa", "standard deviation of the pressure", default=1, above=0)
    sea_level: float = vedette.fields.quantity("hPa", "p_0", default=1013.25, at_least=900, at_most=1100)
    detection_probability: float = vedette.fields.probability("that a report arrives", default=0.98)

    def measure(self, x):
        return self.sea_level * np.exp(-x / 8434.0)

    def jacobian(self, x):
        return (-self.sea_level / 8434.0 * np.exp(-x / 8434.0))[..., None]

    def noise(self, x):
        return np.array([[self.sigma**2]])

    def detects(self, x):
        return np.array(self.detection_probability)

    def clutter(self, z):
        return np.zeros(())


@frozen
class Pseudorange(vedette.Sensor):
    """The path from a satellite plus the error of the receiver's clock: z = |p - s| + b + v.

    Kaplan, Hegarty, Understanding GPS/GNSS: Principles and Applications, 2017, chapter 2.
    """

    kind = "pseudorange"
    observes = vedette.Space.of(x="m", y="m", z="m", clock_bias="m")
    measurement = vedette.Space.of(pseudorange="m")
    sigma: float = vedette.fields.quantity("m", "standard deviation of the pseudorange", default=3, above=0)
    azimuth: float = vedette.fields.quantity("rad", "of the satellite", default=1, at_least=-3, at_most=3)
    elevation: float = vedette.fields.quantity("rad", "of the satellite", default=0.8, at_least=0.1, at_most=1.5)
    distance: float = vedette.fields.quantity("m", "of the satellite", default=2.2e7, at_least=1e6, at_most=1e8)

    def _away(self, x):
        a, e = self.azimuth, self.elevation
        place = self.distance * np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
        return towards(x[..., :3], place)

    def measure(self, x):
        return (self._away(x)[0] + x[..., 3])[..., None]

    def jacobian(self, x):
        return np.concatenate([self._away(x)[1], np.ones_like(x[..., :1])], axis=-1)[..., None, :]

    def noise(self, x):
        return np.array([[self.sigma**2]])

    def detects(self, x):
        return np.ones(())

    def clutter(self, z):
        return np.zeros(())


@frozen
class AcrossTheLane(vedette.Sensor):
    """The distance across a fairway, as cameras on its banks give it, and the velocity across: z = (n . p, n . v) + noise.

    n is the unit vector across. A linear sensor of fewer axes than the state has.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 5.2.
    """

    kind = "across_the_lane"
    linear = True
    observes = vedette.Space.of(x="m", y="m", vx="m/s", vy="m/s")
    measurement = vedette.Space.of(offset="m", drift="m/s")
    course: float = vedette.fields.quantity("rad", "of the fairway", default=0.5, at_least=-4, at_most=4)
    sigma: float = vedette.fields.quantity("m", "standard deviation of the distance", default=2, above=0)
    sigma_drift: float = vedette.fields.quantity("m/s", "standard deviation of its rate", default=0.5, above=0)
    width: float = vedette.fields.quantity("m", "of the fairway", default=400, at_least=1)
    detection_probability: float = vedette.fields.probability("that a ship is seen", default=0.9)
    clutter_per_scan: float = vedette.fields.quantity("1", "false returns in a scan", default=0.5, at_least=0)

    def measure(self, x):
        return x @ self.jacobian(x).T

    def jacobian(self, x):
        return np.kron(np.eye(2), np.array([[-np.sin(self.course), np.cos(self.course)]]))

    def noise(self, x):
        return np.diag([self.sigma**2, self.sigma_drift**2])

    def detects(self, x):
        return np.array(self.detection_probability)

    def clutter(self, z):
        return np.array(self.clutter_per_scan / (self.width * 10.0))


@frozen
class SpeedReport(vedette.Sensor):
    """A reported position, often with the speed over ground: z = (x, y, |v|) + noise. A report may lack the speed.

    ITU-R M.1371-5, Technical Characteristics for an Automatic Identification System, 2014.
    """

    kind = "speed_report"
    observes = vedette.Space.of(x="m", y="m", vx="m/s", vy="m/s")
    measurement = vedette.Space.of(x="m", y="m", speed="m/s")
    sigma: float = vedette.fields.quantity("m", "standard deviation per axis", default=5, above=0)
    sigma_speed: float = vedette.fields.quantity("m/s", "standard deviation of the speed", default=0.3, above=0)
    density: float = vedette.fields.quantity("1/m^2", "false reports", default=1e-8, at_least=0, at_most=1e-3)

    @property
    def optional(self):
        return {"speed": 50.0}

    def measure(self, x):
        return np.concatenate([x[..., :2], np.hypot(x[..., 2], x[..., 3])[..., None]], axis=-1)

    def jacobian(self, x):
        H = np.zeros((*x.shape[:-1], 3, 4))
        H[..., 0, 0] = H[..., 1, 1] = 1.0
        H[..., 2, 2:] = towards(x[..., 2:], np.zeros(2))[1]
        return H

    def noise(self, x):
        return np.diag([self.sigma, self.sigma, self.sigma_speed]) ** 2

    def detects(self, x):
        return np.array(0.9)

    def clutter(self, z):
        return np.array(self.density / 50.0)


@frozen
class PlacedArray(vedette.Sensor):
    """A towed line array at a pose; see `TowedArray`, whose `at` gives it."""

    kind = "placed_array"
    array: vedette.Sensor = vedette.fields.part("the array")
    pose: vedette.Pose = field()
    observes = vedette.Space.of(x="m", y="m")
    measurement = vedette.Space.of(cosine="1")

    def _along(self):
        heading = np.asarray(self.pose.heading, dtype=float)
        return np.stack([np.cos(heading), np.sin(heading)], axis=-1)[..., None, :]

    def measure(self, x):
        _, unit = towards(x, self.pose.position[..., None, :2])
        return np.sum(unit * self._along(), axis=-1, keepdims=True)

    def jacobian(self, x):
        distance, unit = towards(x, self.pose.position[..., None, :2])
        along = self._along()
        across = along - np.sum(unit * along, axis=-1, keepdims=True) * unit
        return (across / distance[..., None])[..., None, :]

    def noise(self, x):
        return self.array.noise(x)

    def detects(self, x):
        return self.array.detects(x)

    def clutter(self, z):
        return self.array.clutter(z)

    def at(self, pose):
        return self.array.at(pose)


@frozen
class TowedArray(vedette.Sensor):
    """A line array tells the cosine of the angle between its axis and the target, so not left from right: z = u . e + v.

    dz/dp = (e - (u . e) u) / r. False returns are even over cosines.
    Van Trees, Optimum Array Processing, 2002, section 2.3.
    """

    kind = "towed_array"
    observes = vedette.Space.of(x="m", y="m")
    measurement = vedette.Space.of(cosine="1")
    sigma: float = vedette.fields.quantity("1", "standard deviation of the cosine", default=0.02, above=0, at_most=0.5)
    detection_probability: float = vedette.fields.probability("that a target is heard", default=0.8)
    clutter_per_scan: float = vedette.fields.quantity("1", "false returns in a scan", default=1, at_least=0)

    def measure(self, x):
        return towards(x, np.zeros(2))[1][..., :1]

    def jacobian(self, x):
        distance, unit = towards(x, np.zeros(2))
        across = np.array([1.0, 0.0]) - unit[..., :1] * unit
        return (across / distance[..., None])[..., None, :]

    def noise(self, x):
        return np.array([[self.sigma**2]])

    def detects(self, x):
        return np.array(self.detection_probability)

    def clutter(self, z):
        return np.array(self.clutter_per_scan / 2)

    def at(self, pose):
        return PlacedArray(self, pose)


COMPONENTS = (
    Foreign("barometer", "sensor", Barometer),
    Foreign("pseudorange", "sensor", Pseudorange),
    Foreign("across the lane", "sensor", AcrossTheLane),
    Foreign("report with speed", "sensor", SpeedReport),
    Foreign("towed array", "sensor", TowedArray),
)
