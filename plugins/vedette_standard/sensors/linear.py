"""A linear sensor from its matrices: positions in any axes, with any covariance."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import Factory, field, frozen

from vedette import Array, Gaussian, Pose, Sensor, Space, fields
from vedette_standard.matrices import covariance_fault, named_space


def _observed(sensor: LinearSensor) -> Space:
    """Return the axes that H looks at: those with a column that is not 0."""
    whole = named_space(sensor.axes, sensor.units)
    if not sensor.H.size or sensor.H.shape[1] != len(whole):
        return whole
    return Space(tuple(axis for axis, used in zip(whole.axes, np.any(sensor.H != 0, axis=0), strict=True) if used))


def _of_observed(sensor: LinearSensor) -> Array:
    """Return H over the axes that it looks at."""
    return sensor.H[:, np.any(sensor.H != 0, axis=0)] if sensor.H.size else np.eye(len(sensor.axes))


def _measured(sensor: LinearSensor) -> Space:
    """Return the space of z: the named axes; else those observed, where z are these as they are; else z1, z2 and so on."""
    names = sensor.measures or (sensor.observes.names if sensor.direct else [f"z{i + 1}" for i in range(len(sensor.R))])
    if sensor.direct and tuple(names) == sensor.observes.names:
        return sensor.observes
    return Space.of(**dict.fromkeys(names, "1"))


@final
@frozen
class LinearSensor(Sensor):
    """z = H x + v, v ~ N(0, R), over the state axes `axes`: by default these axes themselves, in one to any dimensions.

    A return starts tracks where H gives as many numbers as it looks at axes: x = H^-1 z.
    Kalman, A New Approach to Linear Filtering and Prediction Problems, J. Basic Engineering 82, 1960.

    >>> H, R, x = np.array([[2.0, 1.0], [0.0, 4.0]]), np.array([[4.0, 1.0], [1.0, 9.0]]), np.array([[10.0, 3.0]])
    >>> sensor = LinearSensor(("x", "p"), R, H, detection_probability=0.8, clutter_density=2e-6, units={"p": "K"})
    >>> sensor.measure(x).tolist(), sensor.jacobian(x).tolist(), sensor.noise(x).tolist(), str(sensor.observes)
    ([[23.0, 12.0]], [[2.0, 1.0], [0.0, 4.0]], [[4.0, 1.0], [1.0, 9.0]], '(x [m], p [K])')
    >>> float(sensor.detects(x)), float(sensor.clutter(x)), sensor.measurement.names
    (0.8, 2e-06, ('z1', 'z2'))
    >>> found, back = sensor.invert(sensor.measure(x)), np.array([[0.5, -0.125], [0.0, 0.25]])
    >>> np.allclose(found.mean, x), np.allclose(found.cov, back @ R @ back.T)
    (True, True)
    >>> LinearSensor(("x", "vx", "y"), R, [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]).measurement.names
    ('x', 'y')
    """

    kind: ClassVar[str] = "linear"
    linear: ClassVar[bool] = True

    axes: tuple[str, ...] = fields.words("the state axes that H has columns for")
    R: Array = fields.array("1", "covariance of the noise, a row a measured axis", ndim=2)
    H: Array = fields.array("1", "a row a measured axis; default: the axes as they are", ndim=2, default=np.zeros((0, 0)))
    measures: tuple[str, ...] = fields.words("names of the measured axes; default: the axes' own, or z1, z2, ..", default=())
    detection_probability: float = fields.probability("probability that a target gives a return", default=1.0)
    clutter_density: float = fields.quantity("1", "false returns per scan and unit of volume of z", default=0.0, at_least=0)
    units: dict[str, str] = fields.names("axis to its unit where the name does not say it: x m, vx m/s, ax m/s^2, others 1")
    observes: Space = field(init=False, repr=False, eq=False, default=Factory(_observed, takes_self=True))
    _matrix: Array = field(init=False, repr=False, eq=False, default=Factory(_of_observed, takes_self=True))
    measurement: Space = field(init=False, repr=False, eq=False, default=Factory(_measured, takes_self=True))

    def __attrs_post_init__(self) -> None:
        n, m = len(self.axes), len(self.R)
        if self.H.size and self.H.shape != (m, n):
            shape = f"{self.H.shape[0]} x {self.H.shape[1]}"
            raise ValueError(f"H: must be {m} x {n}, a row for each of R, a column for each of `axes`, got {shape}")
        if fault := covariance_fault(self.R, definite=True):
            raise ValueError(f"R: {fault}")
        if not self.H.size and m != n:
            raise ValueError(f"R: must be {n} x {n}, as `axes` has {n}, got {m} x {m}")
        if len(self.measures) not in (0, m):
            raise ValueError(f"measures: must name {m} axes, as R has {m}, got {len(self.measures)}")
        if not len(self.observes):
            raise ValueError("H: must look at an axis at least, got only zeros")

    @property
    def direct(self) -> bool:
        """Whether z are axes of the state as they are, in their order."""
        return not self.H.size or np.array_equal(self._matrix, np.eye(len(self.observes)))

    def measure(self, x: Array) -> Array:
        return x @ self._matrix.T

    def jacobian(self, x: Array) -> Array:
        """Return H (m, n) over the observed axes."""
        return self._matrix

    def noise(self, x: Array) -> Array:
        return self.R

    def detects(self, x: Array) -> Array:
        return np.asarray(self.detection_probability)

    def clutter(self, z: Array) -> Array:
        return np.asarray(self.clutter_density)

    def invert(self, z: Array, noise: Array | None = None) -> Gaussian:
        """Return H^-1 z and its covariance: (*b, m) -> (*b, n), (*b, n, n)."""
        H, cov = self._matrix, self.R if noise is None else noise
        if H.shape[0] != H.shape[1] or np.linalg.matrix_rank(H) < len(H):
            raise NotImplementedError("H cannot be inverted, so one return of this sensor does not start a track")
        back = np.linalg.inv(H)
        return Gaussian(z @ back.T, np.broadcast_to(back @ cov @ back.T, (*z.shape, z.shape[-1])))

    def at(self, pose: Pose) -> Sensor:
        """Return the same sensor, whose report is absolute, if it is of axes as they are; H is in the tracker's frame."""
        return self if self.direct else super().at(pose)
