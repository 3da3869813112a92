"""Models and sensors that no plugin has, and a scene of two ships and a drawn boat."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from attrs import evolve, frozen

import vedette_sim as sim
from vedette import Array, Gaussian, MotionModel, Pose, Sensor, Space
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.sensors.cartesian_position import CartesianPosition


@frozen
class PulledVelocity(MotionModel):
    """Acceleration constant over each step: a noise of rank 2 over 4 axes."""

    kind: ClassVar[str] = "test_pulled"
    sigma: float = 0.5

    @property
    def state(self) -> Space:
        return Space.of(x="m", y="m", vx="m/s", vy="m/s")

    def move(self, x: Array, dt: float) -> Array:
        return x + dt * np.concatenate([x[..., 2:], np.zeros_like(x[..., 2:])], axis=-1)

    def noise(self, x: Array, dt: float) -> Array:
        gain = np.kron(np.array([[dt**2 / 2], [dt]]), np.eye(2))
        return self.sigma**2 * gain @ gain.T


@frozen
class Weaving(MotionModel):
    """A velocity that turns by an axis of its own, in another order of axes, with noise that grows with the turn rate."""

    kind: ClassVar[str] = "test_weaving"

    @property
    def state(self) -> Space:
        return Space.of(turn_rate="rad/s", vx="m/s", vy="m/s", x="m", y="m")

    def move(self, x: Array, dt: float) -> Array:
        w, vx, vy, px, py = np.moveaxis(x, -1, 0)
        c, s = np.cos(w * dt), np.sin(w * dt)
        return np.stack([w, c * vx - s * vy, s * vx + c * vy, px + dt * vx, py + dt * vy], axis=-1)

    def noise(self, x: Array, dt: float) -> Array:
        return dt * np.abs(x[..., :1, None]) * np.diag([1e-4, 0.1, 0.1, 0.0, 0.0])


@frozen
class Polar(Sensor):
    """Range and bearing from where it stands, relative to its heading; clutter uniform over the ground."""

    kind: ClassVar[str] = "test_polar"
    sigma_range: float = 5.0
    sigma_bearing: float = 0.05
    p_detect: float = 0.9
    density: float = 0.0
    place: tuple[float, float] = (0.0, 0.0)
    heading: float = 0.0

    @property
    def observes(self) -> Space:
        return Space.of(x="m", y="m")

    @property
    def measurement(self) -> Space:
        return Space.of(range="m", bearing="rad mod 2pi")

    def measure(self, x: Array) -> Array:
        d = x - np.array(self.place)
        return np.stack([np.hypot(d[..., 0], d[..., 1]), np.arctan2(d[..., 1], d[..., 0]) - self.heading], axis=-1)

    def noise(self, x: Array) -> Array:
        return np.diag([self.sigma_range**2, self.sigma_bearing**2])

    def detects(self, x: Array) -> Array:
        return np.where(np.hypot(x[..., 0], x[..., 1]) < 1000.0, self.p_detect, 0.0)

    def clutter(self, z: Array) -> Array:
        return self.density * z[..., 0]

    def invert(self, z: Array, noise: Array | None = None) -> Gaussian:
        raise NotImplementedError

    def at(self, pose: Pose) -> Sensor:
        return evolve(self, place=tuple(pose.position), heading=float(pose.heading))


class Peaked(Polar):
    """Clutter in one spot, narrower than any grid."""

    def clutter(self, z: Array) -> Array:
        return 1e-3 + 1.0 * (np.abs(z[..., 0] - 512.3) < 0.4)


REGION = {"range": sim.Bounds(100, 1000)}
SHIPS = {
    "ferry": sim.Ship(
        start=[-500, 0], course=0.3, speed=8, legs=(sim.Leg("straight", 10), sim.Leg("turn", 20, rate=0.05)), disappears=44.2
    ),
    "tug": sim.Ship(start=[300, 300], course=-2, speed=3, appears=11.0),
}
START = {"x": [0, 100], "y": [0, 100], "vx": [0, 5], "vy": [0, 5]}
DRAWN = {"boat": sim.Drawn((ConstantVelocity(0.3),), START)}


def scene(**changes: object) -> sim.Simulation:
    looks = {"radar": sim.Look(interval=2.5, clutter=REGION), "lidar": sim.Look(interval=0.7, first=0.3, jitter=0.2)}
    return sim.Simulation(**({"duration": 60, "looks": looks, "ships": SHIPS, "drawn": DRAWN} | changes))


SENSORS = {"radar": Polar(density=2e-6), "lidar": CartesianPosition(sigma=0.5, detection_probability=0.8)}


def rows(recording, sensor):
    return {(scan.time, *z) for scan in recording.scans if scan.sensor == sensor for z in scan.detections.z.tolist()}
