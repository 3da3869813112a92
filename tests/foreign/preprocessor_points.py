"""Preprocessors that carry returns to the plane by sigma points, leave out what is far, and fuse two sensors."""

import numpy as np
from attrs import frozen

import vedette
from foreign import Foreign
from foreign.preprocessor_clusters import noises, nothing
from foreign.sensor_active import FadingRadar
from vedette_standard.sensors.cartesian_position import CartesianPosition

PLANE = vedette.Space.of(x="m", y="m")


@frozen
class SigmaPoints(vedette.Preprocessor):
    """Range and bearing to x and y by the unscented transform of each return's noise.

    Julier, Uhlmann, Consistent debiased method for converting between polar and Cartesian coordinates, 1997.
    """

    kind = "sigma_points"
    sensors: dict[str, FadingRadar] = vedette.fields.part("the one radar, under the name that its scans bear")
    measurement = PLANE

    def __attrs_post_init__(self):
        if len(self.sensors) != 1:
            raise ValueError(f"sensors: must be one, got {len(self.sensors)}")

    def process(self, scans):
        ((name, sensor),) = self.sensors.items()
        if name not in scans:
            return nothing(PLANE)
        found, pose = scans[name].detections, scans[name].pose
        turn, place = (0.0, np.zeros(2)) if pose is None else (np.asarray(pose.heading), pose.position)
        root = np.linalg.cholesky(noises(sensor, found)) * np.sqrt(3.0)
        arms = np.swapaxes(root, -1, -2)
        points = found.z[..., None, :] + np.concatenate([np.zeros((*arms.shape[:-2], 1, 2)), arms, -arms], axis=-2)
        angle = points[..., 1] + np.reshape(turn, np.shape(turn) + (1, 1) if np.ndim(turn) else ())
        at = points[..., :1] * np.stack([np.cos(angle), np.sin(angle)], axis=-1) + np.asarray(place)[..., None, None, :]
        weights = np.array([1 / 3, 1 / 6, 1 / 6, 1 / 6, 1 / 6])
        mean = np.einsum("p,...pa->...a", weights, at)
        off = at - mean[..., None, :]
        cov = np.einsum("p,...pa,...pb->...ab", weights, off, off)
        return vedette.Detections(mean, found.valid, found.evidence, cov + 1e-9 * np.eye(2))


@frozen
class Within(vedette.Preprocessor):
    """Leaves out returns beyond `reach` from the origin, of whose noise the sensor is not sure; passes the others on.

    Richards, Scheer, Holm, Principles of Modern Radar: Basic Principles, 2010, chapter 3 (range gates).
    """

    kind = "within"
    sensors: dict[str, CartesianPosition] = vedette.fields.part("the one sensor, under the name that its scans bear")
    reach: float = vedette.fields.quantity("m", "beyond which returns are left out", default=5e4, at_least=100)
    measurement = PLANE

    def __attrs_post_init__(self):
        if len(self.sensors) != 1:
            raise ValueError(f"sensors: must be one, got {len(self.sensors)}")

    def process(self, scans):
        ((name, sensor),) = self.sensors.items()
        if name not in scans:
            return nothing(PLANE)
        found = scans[name].detections
        near = found.valid & (np.linalg.norm(found.z, axis=-1) <= self.reach)
        return vedette.Detections(found.z, near, found.evidence, noises(sensor, found), found.missing)


@frozen
class Pairs(vedette.Preprocessor):
    """Of two sensors of positions: each return of the first with the nearest of the second within `threshold`.

    z = P (R1^-1 z1 + R2^-1 z2), P = (R1^-1 + R2^-1)^-1. Each return is used once, the nearest pair first.
    Bar-Shalom, Willett, Tian, Tracking and Data Fusion, 2011, chapter 9.
    """

    kind = "pairs"
    sensors: dict[str, CartesianPosition] = vedette.fields.part("two sensors, under the names that their scans bear")
    threshold: float = vedette.fields.quantity("m", "distance of a pair", default=200, at_least=1)
    measurement = PLANE

    def __attrs_post_init__(self):
        if len(self.sensors) != 2:
            raise ValueError(f"sensors: must be two, got {len(self.sensors)}")

    def process(self, scans):
        if not set(self.sensors) <= set(scans):
            return nothing(PLANE)
        one, other = (scans[name].detections for name in self.sensors)
        R, Q = (noises(sensor, scans[name].detections) for name, sensor in self.sensors.items())
        lead, k = one.valid.shape[:-1], one.valid.shape[-1]
        z, valid, noise = np.zeros((*lead, k, 2)), np.zeros((*lead, k), dtype=bool), np.zeros((*lead, k, 2, 2)) + np.eye(2)
        for run in np.ndindex(*lead):
            apart = np.linalg.norm(one.z[run][:, None] - other.z[run][None], axis=-1)
            apart[~(one.valid[run][:, None] & other.valid[run][None])] = np.inf
            while apart.size and apart.min() < self.threshold:
                i, j = np.unravel_index(np.argmin(apart), apart.shape)
                A, B = np.linalg.inv(R[run][i]), np.linalg.inv(Q[run][j])
                noise[run][i] = np.linalg.inv(A + B)
                z[run][i], valid[run][i] = noise[run][i] @ (A @ one.z[run][i] + B @ other.z[run][j]), True
                apart[i], apart[:, j] = np.inf, np.inf
        return vedette.Detections(z, valid, None, noise)


COMPONENTS = (
    Foreign("sigma points", "preprocessor", lambda: SigmaPoints({"raw": FadingRadar()})),
    Foreign("within reach", "preprocessor", lambda: Within({"raw": CartesianPosition(5.0)})),
    Foreign("pairs", "preprocessor", lambda: Pairs({"one": CartesianPosition(5.0), "two": CartesianPosition(9.0)})),
)
