"""Sensors of directions: pairs of angles, a camera's image plane, an axis without a front."""

import numpy as np
from attrs import frozen

import vedette
from foreign import Foreign


def directions(x):
    """Return the range, the range on the ground, azimuth and elevation of x (*b, 3)."""
    ground = np.sqrt(np.sum(x[..., :2] ** 2, axis=-1) + 1e-12)
    slant = np.sqrt(ground**2 + x[..., 2] ** 2)
    return slant, ground, np.arctan2(x[..., 1], x[..., 0]), np.arctan2(x[..., 2], ground)


@frozen
class AnglePair(vedette.Sensor):
    """Azimuth and elevation of a target in space, seen passively from the origin; the azimuth's error grows as 1 / cos(e).

    R = s^2 diag(1 / cos^2 e, 1): equal errors on the sky. False returns lie evenly on the sphere, cos(e) / (4 pi).
    Blackman, Popoli, Design and Analysis of Modern Tracking Systems, 1999, chapter 3.
    """

    kind = "angle_pair"
    observes = vedette.Space.of(x="m", y="m", z="m")
    measurement = vedette.Space.of(azimuth="rad mod 2pi", elevation="rad")
    sigma: float = vedette.fields.quantity("rad", "standard deviation on the sky", default=0.003, above=0, at_most=0.2)
    detection_probability: float = vedette.fields.probability("that a target is seen", default=0.95)
    clutter_per_scan: float = vedette.fields.quantity("1", "false returns in a scan", default=2, at_least=0)

    def measure(self, x):
        _, _, azimuth, elevation = directions(x)
        return self.measurement.canonical(np.stack([azimuth, elevation], axis=-1))

    def jacobian(self, x):
        slant, ground, _, _ = directions(x)
        zero = np.zeros_like(ground)
        lift = -x[..., 2] / (ground * slant**2)
        rows = [-x[..., 1] / ground**2, x[..., 0] / ground**2, zero, x[..., 0] * lift, x[..., 1] * lift, ground / slant**2]
        return np.stack(rows, axis=-1).reshape(*ground.shape, 2, 3)

    def noise(self, x):
        slant, ground, _, _ = directions(x)
        R = np.zeros((*ground.shape, 2, 2))
        R[..., 0, 0] = self.sigma**2 * np.minimum((slant / ground) ** 2, 1e4)
        R[..., 1, 1] = self.sigma**2
        return R

    def detects(self, x):
        return np.array(self.detection_probability)

    def clutter(self, z):
        return self.clutter_per_scan * np.maximum(np.cos(z[..., 1]), 0.0) / (4 * np.pi)


@frozen
class RefractedElevation(vedette.Sensor):
    """Bearing and elevation over a round Earth whose air bends rays down: e = atan2(z - r^2 / (2 k R), r), r on the ground.

    k R is the Earth's radius times 4/3. With u = z - r^2 / (2 k R): de/dr = (r u_r - u) / (r^2 + u^2), u_r = -r / (k R).
    Skolnik, Radar Handbook, 2008, chapter 26.
    """

    kind = "refracted_elevation"
    observes = vedette.Space.of(x="m", y="m", z="m")
    measurement = vedette.Space.of(bearing="rad mod 2pi", elevation="rad")
    sigma_bearing: float = vedette.fields.quantity("rad", "standard deviation", default=0.005, above=0, at_most=1)
    sigma_elevation: float = vedette.fields.quantity("rad", "standard deviation", default=0.01, above=0, at_most=1)
    factor: float = vedette.fields.quantity("1", "k", default=4 / 3, at_least=0.5, at_most=10)
    lowest: float = vedette.fields.quantity(
        "rad", "elevation below which nothing is seen", default=-0.2, at_least=-1, at_most=1
    )
    clutter_per_scan: float = vedette.fields.quantity("1", "false returns in a scan", default=1, at_least=0)

    def _ray(self, x):
        radius = self.factor * 6371e3
        ground = np.sqrt(np.sum(x[..., :2] ** 2, axis=-1) + 1e-12)
        height = x[..., 2] - ground**2 / (2 * radius)
        return ground, height, -ground / radius

    def measure(self, x):
        ground, height, _ = self._ray(x)
        both = [np.arctan2(x[..., 1], x[..., 0]), np.arctan2(height, ground)]
        return self.measurement.canonical(np.stack(both, axis=-1))

    def jacobian(self, x):
        ground, height, fall = self._ray(x)
        square = ground**2 + height**2
        by_ground = (ground * fall - height) / square
        H = np.zeros((*ground.shape, 2, 3))
        H[..., 0, 0], H[..., 0, 1] = -x[..., 1] / ground**2, x[..., 0] / ground**2
        H[..., 1, :2] = x[..., :2] * (by_ground / ground)[..., None]
        H[..., 1, 2] = ground / square
        return H

    def noise(self, x):
        return np.diag([self.sigma_bearing**2, self.sigma_elevation**2])

    def detects(self, x):
        return np.where(self.measure(x)[..., 1] > self.lowest, 0.9, 0.0)

    def clutter(self, z):
        return np.array(self.clutter_per_scan / (2 * np.pi * np.pi))


@frozen
class PinholeCamera(vedette.Sensor):
    """A camera on a mast: z = f (right . d, down . d) / depth + the middle of the image, depth = forward . d, d = p - place.

    dz/dp = f / depth (right - (right . d / depth) forward), likewise down. Nothing nearer than `near` or outside the image
    is seen; there the projection is continued with the depth `near`.
    Hartley, Zisserman, Multiple View Geometry in Computer Vision, 2004, section 6.1.
    """

    kind = "pinhole_camera"
    observes = vedette.Space.of(x="m", y="m", z="m")
    measurement = vedette.Space.of(column="px", row="px")
    focal: float = vedette.fields.quantity("px", "f", default=1000, at_least=100, at_most=10000)
    height: float = vedette.fields.quantity("m", "of the mast, which stands at the origin", default=30, at_most=1000)
    pan: float = vedette.fields.quantity("rad", "from +x towards +y", default=0.3, at_least=-3, at_most=3)
    tilt: float = vedette.fields.quantity("rad", "downwards", default=0.1, at_least=-1, at_most=1)
    near: float = vedette.fields.quantity("m", "least depth", default=5, at_least=1)
    size: float = vedette.fields.quantity("px", "side of the image", default=2000, at_least=100)
    sigma: float = vedette.fields.quantity("px", "standard deviation, per axis", default=1.5, above=0)
    clutter_per_scan: float = vedette.fields.quantity("1", "false returns in a scan", default=3, at_least=0)

    def _frame(self, x):
        c, s, ct, st = np.cos(self.pan), np.sin(self.pan), np.cos(self.tilt), np.sin(self.tilt)
        forward, right = np.array([c * ct, s * ct, -st]), np.array([s, -c, 0.0])
        plane = np.stack([right, np.cross(forward, right)])
        away = x - np.array([0.0, 0.0, self.height])
        return away @ plane.T, away @ forward, plane, forward

    def measure(self, x):
        sides, depth, _, _ = self._frame(x)
        return self.size / 2 + self.focal * sides / np.maximum(depth, self.near)[..., None]

    def jacobian(self, x):
        sides, depth, plane, forward = self._frame(x)
        far = np.maximum(depth, self.near)[..., None, None]
        tip = np.where(depth > self.near, 1.0, 0.0)[..., None, None] * sides[..., None] / far * forward
        return self.focal / far * (plane - tip)

    def noise(self, x):
        return self.sigma**2 * np.eye(2)

    def detects(self, x):
        _, depth, _, _ = self._frame(x)
        inside = np.all((self.measure(x) >= 0) & (self.measure(x) <= self.size), axis=-1)
        return np.where(inside & (depth > self.near), 0.9, 0.0)

    def clutter(self, z):
        return np.array(self.clutter_per_scan / self.size**2)


@frozen
class HullAxis(vedette.Sensor):
    """The axis of a ship's hull in a picture, which does not tell bow from stern: z = heading + v, modulo pi.

    Mardia, Jupp, Directional Statistics, 2000, section 1.1 (axial data).
    """

    kind = "hull_axis"
    observes = vedette.Space.of(heading="rad mod 2pi")
    measurement = vedette.Space((vedette.Axis("axis", "rad", np.pi),))
    sigma: float = vedette.fields.quantity("rad", "standard deviation of the axis", default=0.05, above=0, at_most=0.5)
    detection_probability: float = vedette.fields.probability("that the hull is resolved", default=0.7)
    clutter_per_scan: float = vedette.fields.quantity("1", "false returns in a scan", default=0.1, at_least=0)

    def measure(self, x):
        return self.measurement.canonical(x)

    def jacobian(self, x):
        return np.eye(1)

    def noise(self, x):
        return np.array([[self.sigma**2]])

    def detects(self, x):
        return np.array(self.detection_probability)

    def clutter(self, z):
        return np.array(self.clutter_per_scan / np.pi)


COMPONENTS = (
    Foreign("angle pair", "sensor", AnglePair),
    Foreign("refracted elevation", "sensor", RefractedElevation),
    Foreign("pinhole camera", "sensor", PinholeCamera),
    Foreign("hull axis", "sensor", HullAxis),
)
