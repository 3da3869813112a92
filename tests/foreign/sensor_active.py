"""Radars and sonars whose noise, detection or clutter depends on where the target is."""

import numpy as np
from attrs import frozen

import vedette
from foreign import Foreign
from foreign.sensor_passive import towards


def polar(x):
    """Return range and bearing (*b, 2) of x (*b, 2), and their derivative (*b, 2, 2)."""
    r, u = towards(x, np.zeros(2))
    H = np.stack([u, np.stack([-u[..., 1], u[..., 0]], axis=-1) / r[..., None]], axis=-2)
    return np.stack([r, np.arctan2(x[..., 1], x[..., 0])], axis=-1), H


@frozen
class FadingRadar(vedette.Sensor):
    """Range and bearing with errors as 1 / sqrt(SNR) and Swerling's P_D = P_FA^(1 / (1 + SNR)), SNR = (reach / r)^4.

    R = diag(s_r^2, s_b^2) (1 + (r / reach)^4). A start inverts the return to first order, with the noise at its range.
    Skolnik, Introduction to Radar Systems, 2001, chapters 2 and 6.
    """

    kind = "fading_radar"
    observes = vedette.Space.of(x="m", y="m")
    measurement = vedette.Space.of(range="m", bearing="rad mod 2pi")
    sigma_range: float = vedette.fields.quantity("m", "standard deviation nearby", default=5, above=0)
    sigma_bearing: float = vedette.fields.quantity("rad", "standard deviation nearby", default=0.005, above=0, at_most=0.1)
    reach: float = vedette.fields.quantity("m", "range at which SNR = 1", default=5000, at_least=100)
    false_alarms: float = vedette.fields.probability("of a cell", default=1e-3, above=0, at_most=0.1)
    clutter_per_scan: float = vedette.fields.quantity("1", "false returns in a scan", default=5, at_least=0)

    def _noise(self, r):
        loss = 1 + (np.maximum(r, 0.0) / self.reach) ** 4
        return loss[..., None, None] * np.diag([self.sigma_range**2, self.sigma_bearing**2])

    def measure(self, x):
        return self.measurement.canonical(polar(x)[0])

    def jacobian(self, x):
        return polar(x)[1]

    def noise(self, x):
        return self._noise(polar(x)[0][..., 0])

    def detects(self, x):
        loss = (polar(x)[0][..., 0] / self.reach) ** 4
        return self.false_alarms ** (loss / (1 + loss))

    def clutter(self, z):
        return np.array(self.clutter_per_scan / (2 * np.pi * self.reach))

    def invert(self, z, noise=None):
        r, c, s = z[..., 0], np.cos(z[..., 1]), np.sin(z[..., 1])
        J = np.stack([np.stack([c, -r * s], axis=-1), np.stack([s, r * c], axis=-1)], axis=-2)
        R = self._noise(r) if noise is None else noise
        return vedette.Gaussian(r[..., None] * np.stack([c, s], axis=-1), J @ R @ np.swapaxes(J, -1, -2))


@frozen
class ReverberatingSonar(vedette.Sensor):
    """Range and bearing; P_D falls as a logistic of the range, false returns by exp(-range / fade) as reverberation does.

    clutter = N exp(-r / fade) / (2 pi fade).
    Urick, Principles of Underwater Sound, 1983, chapter 8.
    """

    kind = "reverberating_sonar"
    observes = vedette.Space.of(x="m", y="m")
    measurement = vedette.Space.of(range="m", bearing="rad mod 2pi")
    sigma_range: float = vedette.fields.quantity("m", "standard deviation", default=10, above=0)
    sigma_bearing: float = vedette.fields.quantity("rad", "standard deviation", default=0.03, above=0, at_most=1)
    half: float = vedette.fields.quantity("m", "range at which half are detected", default=3000, at_least=10)
    width: float = vedette.fields.quantity("m", "over which the detection falls", default=500, at_least=1)
    fade: float = vedette.fields.quantity("m", "after which reverberation is down to 1/e", default=1000, at_least=10)
    clutter_per_scan: float = vedette.fields.quantity("1", "false returns in a scan", default=10, at_least=0)

    def measure(self, x):
        return self.measurement.canonical(polar(x)[0])

    def jacobian(self, x):
        return polar(x)[1]

    def noise(self, x):
        return np.diag([self.sigma_range**2, self.sigma_bearing**2])

    def detects(self, x):
        return (1 - np.tanh((polar(x)[0][..., 0] - self.half) / (2 * self.width))) / 2

    def clutter(self, z):
        return self.clutter_per_scan * np.exp(-np.maximum(z[..., 0], 0.0) / self.fade) / (2 * np.pi * self.fade)


@frozen
class DopplerRadar3d(vedette.Sensor):
    """Range, bearing, elevation and range rate of a target in space: r' = v . u, dr'/dp = (v - (v . u) u) / r.

    Bar-Shalom, Willett, Tian, Tracking and Data Fusion: A Handbook of Algorithms, 2011.
    """

    kind = "doppler_radar_3d"
    observes = vedette.Space.of(x="m", y="m", z="m", vx="m/s", vy="m/s", vz="m/s")
    measurement = vedette.Space.of(range="m", bearing="rad mod 2pi", elevation="rad", range_rate="m/s")
    sigma_range: float = vedette.fields.quantity("m", "standard deviation", default=20, above=0)
    sigma_angle: float = vedette.fields.quantity("rad", "of bearing and elevation", default=0.01, above=0, at_most=1)
    sigma_rate: float = vedette.fields.quantity("m/s", "standard deviation of the range rate", default=1, above=0)
    detection_probability: float = vedette.fields.probability("that a target is detected", default=0.9)
    max_range: float = vedette.fields.quantity("m", "beyond which nothing is detected", default=20000, at_least=100)
    clutter_per_scan: float = vedette.fields.quantity("1", "false returns in a scan", default=5, at_least=0)

    def measure(self, x):
        r, u = towards(x[..., :3], np.zeros(3))
        ground = np.hypot(x[..., 0], x[..., 1])
        rate = np.sum(x[..., 3:] * u, axis=-1)
        angles = [np.arctan2(x[..., 1], x[..., 0]), np.arctan2(x[..., 2], ground)]
        return self.measurement.canonical(np.stack([r, *angles, rate], axis=-1))

    def jacobian(self, x):
        r, u = towards(x[..., :3], np.zeros(3))
        ground = np.sqrt(x[..., 0] ** 2 + x[..., 1] ** 2 + 1e-12)
        v = x[..., 3:]
        H = np.zeros((*r.shape, 4, 6))
        H[..., 0, :3] = H[..., 3, 3:] = u
        H[..., 1, 0], H[..., 1, 1] = -x[..., 1] / ground**2, x[..., 0] / ground**2
        H[..., 2, :2] = -x[..., :2] * (x[..., 2] / (ground * r**2))[..., None]
        H[..., 2, 2] = ground / r**2
        H[..., 3, :3] = (v - np.sum(v * u, axis=-1, keepdims=True) * u) / r[..., None]
        return H

    def noise(self, x):
        return np.diag([self.sigma_range, self.sigma_angle, self.sigma_angle, self.sigma_rate]) ** 2

    def detects(self, x):
        return np.where(towards(x[..., :3], np.zeros(3))[0] <= self.max_range, self.detection_probability, 0.0)

    def clutter(self, z):
        return np.array(self.clutter_per_scan / (self.max_range * 2 * np.pi * np.pi * 600.0))


@frozen
class BistaticRadar(vedette.Sensor):
    """Passive radar: the path from transmitter over target to receiver, and its rate: r_t + r_r, v . (u_t + u_r).

    Griffiths, Baker, An Introduction to Passive Radar, 2017.
    """

    kind = "bistatic_radar"
    observes = vedette.Space.of(x="m", y="m", vx="m/s", vy="m/s")
    measurement = vedette.Space.of(path="m", path_rate="m/s")
    base: float = vedette.fields.quantity("m", "from transmitter to receiver, along x", default=1000, at_least=10)
    sigma_path: float = vedette.fields.quantity("m", "standard deviation of the path", default=15, above=0)
    sigma_rate: float = vedette.fields.quantity("m/s", "standard deviation of its rate", default=1, above=0)
    correlation: float = vedette.fields.quantity(
        "1", "of the two errors, by the chirp", default=0.5, at_least=-0.9, at_most=0.9
    )
    clutter_per_scan: float = vedette.fields.quantity("1", "false returns in a scan", default=2, at_least=0)

    def _legs(self, x):
        return [towards(x[..., :2], np.array([side * self.base / 2, 0.0])) for side in (-1, 1)]

    def measure(self, x):
        (r1, u1), (r2, u2) = self._legs(x)
        return np.stack([r1 + r2, np.sum(x[..., 2:] * (u1 + u2), axis=-1)], axis=-1)

    def jacobian(self, x):
        legs, v = self._legs(x), x[..., 2:]
        unit = legs[0][1] + legs[1][1]
        across = sum((v - np.sum(v * u, axis=-1, keepdims=True) * u) / r[..., None] for r, u in legs)
        top = np.concatenate([unit, np.zeros_like(unit)], axis=-1)
        return np.stack([top, np.concatenate([across, unit], axis=-1)], axis=-2)

    def noise(self, x):
        both = self.correlation * self.sigma_path * self.sigma_rate
        return np.array([[self.sigma_path**2, both], [both, self.sigma_rate**2]])

    def detects(self, x):
        (r1, _), (r2, _) = self._legs(x)
        return 1 / (1 + (r1 * r2 / 1e7) ** 2)  # ovals of Cassini

    def clutter(self, z):
        return np.array(self.clutter_per_scan / (2e4 * 400.0))


@frozen
class AmbiguousDoppler(vedette.Sensor):
    """Range and a range rate that wraps: a pulse Doppler radar tells it only modulo 2 v, v = wavelength * PRF / 4.

    Richards, Fundamentals of Radar Signal Processing, 2014, chapter 5.
    """

    kind = "ambiguous_doppler"
    observes = vedette.Space.of(x="m", y="m", vx="m/s", vy="m/s")
    unambiguous: float = vedette.fields.quantity("m/s", "v", default=15, at_least=1, at_most=300)
    sigma_range: float = vedette.fields.quantity("m", "standard deviation of the range", default=10, above=0)
    sigma_rate: float = vedette.fields.quantity("m/s", "standard deviation of the rate", default=0.3, above=0, at_most=1)
    clutter_per_scan: float = vedette.fields.quantity("1", "false returns in a scan", default=1, at_least=0)

    @property
    def measurement(self):
        return vedette.Space((vedette.Axis("range", "m"), vedette.Axis("folded_rate", "m/s", 2 * self.unambiguous)))

    def measure(self, x):
        r, u = towards(x[..., :2], np.zeros(2))
        return self.measurement.canonical(np.stack([r, np.sum(x[..., 2:] * u, axis=-1)], axis=-1))

    def jacobian(self, x):
        r, u = towards(x[..., :2], np.zeros(2))
        v = x[..., 2:]
        across = (v - np.sum(v * u, axis=-1, keepdims=True) * u) / r[..., None]
        top = np.concatenate([u, np.zeros_like(u)], axis=-1)
        return np.stack([top, np.concatenate([across, u], axis=-1)], axis=-2)

    def noise(self, x):
        return np.diag([self.sigma_range**2, self.sigma_rate**2])

    def detects(self, x):
        return np.array(0.85)

    def clutter(self, z):
        return np.array(self.clutter_per_scan / (1e4 * 2 * self.unambiguous))


COMPONENTS = (
    Foreign("fading radar", "sensor", FadingRadar),
    Foreign("reverberating sonar", "sensor", ReverberatingSonar),
    Foreign("Doppler radar in space", "sensor", DopplerRadar3d),
    Foreign("bistatic radar", "sensor", BistaticRadar),
    Foreign("ambiguous Doppler", "sensor", AmbiguousDoppler),
)
