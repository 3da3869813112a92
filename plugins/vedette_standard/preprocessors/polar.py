"""The common part of conversions from polar returns to positions: they differ in how they treat the bearing's error."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from attrs import frozen

from vedette import Array, Detections, Pose, Preprocessor, Scan, Space, fields
from vedette_standard.sensors.range_bearing import RangeBearing
from vedette_standard.sensors.station import POSITION, leading


@frozen
class PolarConversion(Preprocessor):
    """Converts each return of one radar to a position with its own covariance; which returns are valid stays as it is.

    z = factor * r (cos b, sin b) from the radar's position, R = T [along cross; cross across] T' with T the
    rotation to the line of sight and cross = r cov(r, b).
    """

    measurement: ClassVar[Space] = POSITION

    sensors: dict[str, RangeBearing] = fields.part("the one radar, under the name that its scans bear")

    def __attrs_post_init__(self) -> None:
        if len(self.sensors) != 1:
            raise ValueError(f"sensors: must hold one radar, got {len(self.sensors)}")

    @abstractmethod
    def moments(self, r: Array, range_variance: Array, bearing_variance: Array) -> tuple[Array, Array, Array]:
        """Return the factor of the range r (*b) in m, and the variances along and across the line of sight, (*b) each."""

    def process(self, scans: Mapping[str, Scan]) -> Detections:
        """Map range and bearing (*b, k, 2) to x and y (*b, k, 2) with their noise (*b, k, 2, 2)."""
        ((name, radar),) = self.sensors.items()
        seen, pose = scans[name].detections, scans[name].pose
        if pose is None:
            pose = Pose(np.array([radar.x, radar.y]), heading=radar.heading)
        R = radar.noise(seen.z) if seen.noise is None else seen.noise
        r, angle = seen.z[..., 0], seen.z[..., 1] + leading(pose.heading, seen.z.ndim - 1)
        factor, along, across = self.moments(r, R[..., 0, 0], R[..., 1, 1])
        cross = r * R[..., 0, 1]
        cos, sin = np.cos(angle), np.sin(angle)
        z = np.empty(seen.z.shape)
        z[..., 0] = leading(pose.position[..., 0], r.ndim) + factor * r * cos
        z[..., 1] = leading(pose.position[..., 1], r.ndim) + factor * r * sin
        noise = np.empty((*z.shape, 2))
        noise[..., 0, 0] = along * cos**2 - 2 * cross * sin * cos + across * sin**2
        noise[..., 1, 1] = along * sin**2 + 2 * cross * sin * cos + across * cos**2
        noise[..., 0, 1] = noise[..., 1, 0] = (along - across) * sin * cos + cross * (cos**2 - sin**2)
        return Detections(z, seen.valid, seen.evidence, noise, None, seen.identity, seen.time)
