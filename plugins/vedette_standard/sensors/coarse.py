"""A sensor of limited resolution."""

from __future__ import annotations

import math
from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Pose, Sensor, WrappedSensor, fields
from vedette_standard.sensors.polar_position import PolarPosition
from vedette_standard.sensors.range_bearing import RangeBearing
from vedette_standard.sensors.station import offsets, stands

POLAR = ("range", "bearing")
LEAST = 1e-9
"""Least part of the cell in one direction that is in the other: over the radar itself a bearing's cell has no width."""

ANY = 1e9
"""The cell of an axis that does not tell targets apart, in its own unit."""


_TRIED = RangeBearing(sigma_range=5.0, sigma_bearing=0.01), PolarPosition(sigma_range=5.0, sigma_bearing=0.01)


@final
@frozen
class Coarse(WrappedSensor):
    """Two targets d apart that are detected give one return with the probability exp(-ln 2 sum_a (d_a / c_a)^2), c the cell.

    So at one cell on one axis they merge half of the time. A merged return is over the middle, with the noise of one.
    An axis without a cell does not tell them apart. A sensor that measures x and y takes cells in range and bearing, as
    seen from where it stands.
    Koch, van Keuk, Multiple Hypothesis Track Maintenance with Possibly Unresolved Measurements, IEEE T-AES 33, 1997;
    Svensson, Ulmke, Hammarstrand, Multitarget Sensor Resolution Model and JPDA, IEEE T-AES 48, 2012.

    >>> from vedette_standard import CartesianPosition, RangeBearing
    >>> sensor, x = Coarse(RangeBearing(6.0, 0.02), {"range": 20.0, "bearing": 0.05}), np.array([30.0, 40.0])
    >>> def merged(d, C):
    ...     return round(float(np.exp(-0.5 * d @ np.linalg.solve(C, d))), 6)
    >>> C = sensor.unresolved(x)
    >>> [merged(np.array(d), C) for d in ([20.0, 0.0], [0.0, 0.1], [20.0, 0.05])]  # 2^-1, 2^-4, 2^-2
    [0.5, 0.0625, 0.25]
    >>> C = Coarse(CartesianPosition(6.0), {"range": 20.0, "bearing": 0.05}).unresolved(x)  # a bearing's is 2.5 m
    >>> merged(np.array([12.0, 16.0]), C), merged(np.array([-2.0, 1.5]), C)
    (0.5, 0.5)
    >>> sensor.measure(x).tolist() == sensor.of.measure(x).tolist(), sensor.noise(x).tolist() == sensor.of.noise(x).tolist()
    (True, True)
    """

    kind: ClassVar[str] = "coarse"

    of: Sensor = fields.part("the sensor as it would be if it resolved all targets", tried=_TRIED)
    cells: dict[str, float] = fields.table(
        "measured axis, or range [m] and bearing [rad] where x and y are measured, to the size of a cell in its unit",
        at_least=0,
        tried=({"range": 20.0}, {"range": 10.0, "bearing": 0.05}),
    )

    def __attrs_post_init__(self) -> None:
        known = (*self.measurement.names, *(POLAR if self._turns() else ()))
        for name, cell in self.cells.items():
            if name not in known:
                raise ValueError(f"cells.{name}: must be one of {', '.join(known)}")
            if cell <= 0:
                raise ValueError(f"cells.{name}: must be > 0, got {cell:g}")
        if not self.cells:
            raise ValueError("cells: must state the size of a cell on one axis at least")
        if len({name in POLAR for name in self.cells}) > 1 and self._turns():
            raise ValueError("cells: must be of x and y, or of range and bearing, not of both")

    def _turns(self) -> bool:
        return self.measurement.names == ("x", "y")

    def unresolved(self, x: Array) -> Array:
        """Return C: (*b, n) -> (*b, m, m)."""
        polar = self._turns() and any(name in POLAR for name in self.cells)
        names = POLAR if polar else self.measurement.names
        size = np.array([self.cells.get(name, ANY) for name in names]) / math.sqrt(2 * math.log(2))
        if not polar:
            return np.diag(size**2)
        pose = stands(self.of) or Pose(np.zeros(2))
        dx, dy = offsets(self.of.measure(x), pose)
        square, angle = dx * dx + dy * dy, np.arctan2(dy, dx)
        along = size[0] ** 2 + LEAST * square * size[1] ** 2
        across = square * size[1] ** 2 + LEAST * size[0] ** 2
        cos, sin = np.cos(angle), np.sin(angle)
        C = np.empty((*angle.shape, 2, 2))
        C[..., 0, 0], C[..., 1, 1] = along * cos * cos + across * sin * sin, along * sin * sin + across * cos * cos
        C[..., 0, 1] = C[..., 1, 0] = (along - across) * cos * sin
        return C
