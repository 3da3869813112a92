"""Sensors that only listen: differences of arrival, retarded bearings, fields that fall off with distance."""

import numpy as np
from attrs import frozen

import vedette
from foreign import Foreign


def towards(x, place):
    """Return the distance (*b) of x (*b, d) from a place and the unit vector (*b, d) from there to x."""
    away = x - place
    distance = np.sqrt(np.sum(away**2, axis=-1) + 1e-12)
    return distance, away / distance[..., None]


@frozen
class Tdoa(vedette.Sensor):
    """Differences of the paths to three receivers, both to the first: z_i = |p - r_i| - |p - r_0| + v_i - v_0, i = 1, 2.

    The first receiver's error is common to both: R = s^2 [2 1; 1 2].
    Foy, Position-Location Solutions by Taylor-Series Estimation, IEEE T-AES 12, 1976.
    """

    kind = "tdoa"
    observes = vedette.Space.of(x="m", y="m")
    measurement = vedette.Space.of(path_1="m", path_2="m")
    sigma: float = vedette.fields.quantity("m", "standard deviation of one path", default=5, above=0)
    side: float = vedette.fields.quantity("m", "of the triangle of receivers around the origin", default=800, at_least=10)
    detection_probability: float = vedette.fields.probability("that a target is heard", default=0.9)
    clutter_per_scan: float = vedette.fields.quantity("1", "false returns in a scan", default=0.5, at_least=0)

    def _paths(self, x):
        angles = 2 * np.pi * np.arange(3) / 3
        places = self.side / np.sqrt(3) * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        return towards(x[..., None, :], places)

    def measure(self, x):
        distance, _ = self._paths(x)
        return distance[..., 1:] - distance[..., :1]

    def jacobian(self, x):
        _, unit = self._paths(x)
        return unit[..., 1:, :] - unit[..., :1, :]

    def noise(self, x):
        return self.sigma**2 * np.array([[2.0, 1.0], [1.0, 2.0]])

    def detects(self, x):
        return np.array(self.detection_probability)

    def clutter(self, z):
        return np.array(self.clutter_per_scan / (2 * self.side) ** 2)


@frozen
class Fdoa(vedette.Sensor):
    """The difference of the range rates at two receivers, by their Doppler shifts: z = v . u_1 - v . u_2 + noise.

    With unit vectors u_i from receiver to target: dz/dp = sum +- (v - (v . u) u) / r, dz/dv = u_1 - u_2.
    Ho, Xu, An Accurate Algebraic Solution for Moving Source Location Using TDOA and FDOA, IEEE T-SP 52, 2004.
    """

    kind = "fdoa"
    observes = vedette.Space.of(x="m", y="m", vx="m/s", vy="m/s")
    measurement = vedette.Space.of(rate_difference="m/s")
    sigma: float = vedette.fields.quantity("m/s", "standard deviation of the difference", default=0.5, above=0)
    base: float = vedette.fields.quantity("m", "distance of the receivers, along x", default=500, at_least=10)
    largest: float = vedette.fields.quantity("m/s", "largest difference of a false return", default=100, above=0)
    detection_probability: float = vedette.fields.probability("that a target is heard", default=0.8)
    clutter_per_scan: float = vedette.fields.quantity("1", "false returns in a scan", default=0.5, at_least=0)

    def _units(self, x):
        return [towards(x[..., :2], np.array([side * self.base / 2, 0.0])) for side in (-1, 1)]

    def measure(self, x):
        (_, first), (_, second) = self._units(x)
        return np.sum(x[..., 2:] * (first - second), axis=-1, keepdims=True)

    def jacobian(self, x):
        v = x[..., 2:]
        across = [(v - np.sum(v * u, axis=-1, keepdims=True) * u) / r[..., None] for r, u in self._units(x)]
        (_, first), (_, second) = self._units(x)
        return np.concatenate([across[0] - across[1], first - second], axis=-1)[..., None, :]

    def noise(self, x):
        return np.array([[self.sigma**2]])

    def detects(self, x):
        return np.array(self.detection_probability)

    def clutter(self, z):
        return np.array(self.clutter_per_scan / (2 * self.largest))


@frozen
class RetardedBearing(vedette.Sensor):
    """The bearing at which a target is heard: that of where it was when the sound left it, |p - v t| = c t.

    t = p^2 / (p . v + sqrt((p . v)^2 + (c^2 - v^2) p^2)); dt = u . (dp - t dv) / (c + u . v). Faster than sound: not heard.
    Morse, Ingard, Theoretical Acoustics, 1968, chapter 11 (sources that move).
    """

    kind = "retarded_bearing"
    observes = vedette.Space.of(x="m", y="m", vx="m/s", vy="m/s")
    measurement = vedette.Space.of(bearing="rad mod 2pi")
    sigma: float = vedette.fields.quantity("rad", "standard deviation of the bearing", default=0.02, above=0, at_most=1)
    sound: float = vedette.fields.quantity("m/s", "c", default=1500, at_least=1000, at_most=7000)
    detection_probability: float = vedette.fields.probability("that a target is heard", default=0.9)
    clutter_per_scan: float = vedette.fields.quantity("1", "false returns in a scan", default=1, at_least=0)

    def _heard(self, x):
        p, v = x[..., :2], x[..., 2:]
        square, along, fast = np.sum(p**2, -1), np.sum(p * v, -1), np.sum(v**2, -1)
        root = np.sqrt(np.maximum(along**2 + (self.sound**2 - fast) * square, 0.0))
        late = square / np.maximum(along + root, 1e-9)
        return late, *towards(p - late[..., None] * v, np.zeros(2))

    def measure(self, x):
        _, _, unit = self._heard(x)
        return self.measurement.canonical(np.arctan2(unit[..., 1], unit[..., 0])[..., None])

    def jacobian(self, x):
        late, distance, unit = self._heard(x)
        v = x[..., 2:]
        by_place = unit / np.maximum(self.sound + np.sum(unit * v, -1), 1e-9)[..., None]  # of the delay
        left = np.stack([-unit[..., 1], unit[..., 0]], axis=-1)
        drift = left - np.sum(left * v, -1)[..., None] * by_place
        both = np.concatenate([drift, -late[..., None] * drift], axis=-1)
        return (both / distance[..., None])[..., None, :]

    def noise(self, x):
        return np.array([[self.sigma**2]])

    def detects(self, x):
        return np.where(np.sum(x[..., 2:] ** 2, -1) < self.sound**2, self.detection_probability, 0.0)

    def clutter(self, z):
        return np.array(self.clutter_per_scan / (2 * np.pi))


@frozen
class SignalStrength(vedette.Sensor):
    """Received power in decibels: z = power - 5 n log10(1 + r^2 / d^2) + shadowing, n the exponent of path loss.

    At r = 0 it is the power at the distance d, the height of the mast.
    Rappaport, Wireless Communications: Principles and Practice, 2002, section 4.9.
    """

    kind = "signal_strength"
    observes = vedette.Space.of(x="m", y="m")
    measurement = vedette.Space.of(strength="1")
    power: float = vedette.fields.quantity("1", "decibels over 1 mW below the mast", default=-40, at_least=-150, at_most=50)
    exponent: float = vedette.fields.quantity("1", "n, of the path loss", default=2.7, at_least=1.5, at_most=6)
    height: float = vedette.fields.quantity("m", "d, of the mast", default=20, at_least=1)
    sigma: float = vedette.fields.quantity("1", "standard deviation of the shadowing in decibels", default=4, above=0)
    weakest: float = vedette.fields.quantity("1", "decibels at which half are heard", default=-100, at_most=0)

    def measure(self, x):
        ratio = np.sum(x**2, axis=-1, keepdims=True) / self.height**2
        return self.power - 5 * self.exponent / np.log(10) * np.log1p(ratio)

    def jacobian(self, x):
        square = self.height**2 + np.sum(x**2, axis=-1, keepdims=True)
        return (-10 * self.exponent / np.log(10) * x / square)[..., None, :]

    def noise(self, x):
        return np.array([[self.sigma**2]])

    def detects(self, x):
        return (1 + np.tanh((self.measure(x)[..., 0] - self.weakest) / 6)) / 2

    def clutter(self, z):
        return np.zeros(())


@frozen
class MagneticAnomaly(vedette.Sensor):
    """The vertical field of a vertical dipole at depth d below the sensor: B = k M (2 d^2 - r^2) / (r^2 + d^2)^(5/2).

    k = mu_0 / (4 pi) = 100 nT m^3 / (A m^2). False returns are Laplace-distributed around 0.
    Blakely, Potential Theory in Gravity and Magnetic Applications, 1995, chapter 4.
    """

    kind = "magnetic_anomaly"
    observes = vedette.Space.of(x="m", y="m")
    measurement = vedette.Space.of(field="nT")
    moment: float = vedette.fields.quantity("A m^2", "M, the ship's", default=1e6, at_least=1e5, at_most=1e8)
    depth: float = vedette.fields.quantity("m", "d, of the ship below the sensor", default=100, at_least=20, at_most=1000)
    sigma: float = vedette.fields.quantity("nT", "standard deviation of the field", default=0.5, above=0)
    clutter_per_scan: float = vedette.fields.quantity("1", "false returns in a scan", default=0.2, at_least=0)

    def measure(self, x):
        square = np.sum(x**2, axis=-1, keepdims=True)
        return 100 * self.moment * (2 * self.depth**2 - square) / (square + self.depth**2) ** 2.5

    def jacobian(self, x):
        square = np.sum(x**2, axis=-1, keepdims=True)
        whole = square + self.depth**2
        slope = -(whole**-2.5) - 2.5 * (2 * self.depth**2 - square) * whole**-3.5
        return (100 * self.moment * slope * 2 * x)[..., None, :]

    def noise(self, x):
        return np.array([[self.sigma**2]])

    def detects(self, x):
        return 1 - np.exp(-np.abs(self.measure(x)[..., 0]) / (3 * self.sigma))

    def clutter(self, z):
        return self.clutter_per_scan * np.exp(-np.abs(z[..., 0]) / (5 * self.sigma)) / (10 * self.sigma)


COMPONENTS = (
    Foreign("time differences of arrival", "sensor", Tdoa),
    Foreign("frequency difference of arrival", "sensor", Fdoa),
    Foreign("retarded bearing", "sensor", RetardedBearing),
    Foreign("signal strength", "sensor", SignalStrength),
    Foreign("magnetic anomaly", "sensor", MagneticAnomaly),
)
