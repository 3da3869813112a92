"""Stone Soup's transition and measurement models as motion models and sensors.

They are Stone Soup's own objects, called for every state: right for what has no kind here, slow beside the kinds there are.
"""

from __future__ import annotations

from copy import copy
from datetime import timedelta
from typing import Any, ClassVar, final

import numpy as np
from attrs import Factory, evolve, field, frozen

from vedette import Array, Gaussian, InputError, MotionModel, Pose, Sensor, Space, fields
from vedette_adapters.libraries import foreign, needed

MEASURED = {
    "CartesianToBearingRange": Space.of(bearing="rad mod 2pi", range="m"),
    "CartesianToElevationBearingRange": Space.of(elevation="rad", bearing="rad mod 2pi", range="m"),
    "Cartesian2DToBearing": Space.of(bearing="rad mod 2pi"),
    "CartesianToElevationBearing": Space.of(elevation="rad", bearing="rad mod 2pi"),
}
"""What these models of Stone Soup measure, in their order."""


def _linear(model: Any) -> bool:
    return isinstance(model, needed("stonesoup.models.base").LinearModel)


def _called(method: Any, x: Array, **how: Any) -> Array:
    """Return what a model makes of states (*b, n), all at once: (*b, m)."""
    states = needed("stonesoup.types.array").StateVectors(np.ascontiguousarray(x.reshape(-1, x.shape[-1]).T))
    made = np.asarray(method(needed("stonesoup.types.state").State(states), **how), dtype=float)
    return made.T.reshape(*x.shape[:-1], len(made))


def _stated(model: Any, x: Array, m: int, **how: Any) -> Array | None:
    """Return the derivatives (*b, m, n) that a model itself states at states (*b, n), one after another.

    None where Stone Soup takes differences of 1e-8, which are right to a few digits: ours are better, and all at once.
    """
    if getattr(model.jacobian, "__func__", None) is needed("stonesoup.models.base").Model.jacobian:
        return None
    State = needed("stonesoup.types.state").State
    slopes = [np.asarray(model.jacobian(State(row[:, None]), **how), dtype=float) for row in x.reshape(-1, x.shape[-1])]
    return np.array(slopes).reshape(*x.shape[:-1], m, x.shape[-1])


@final
@frozen(eq=False)
class StoneSoupMotion(MotionModel):
    """A Gaussian transition model of Stone Soup. Its time steps are whole microseconds, as Stone Soup's are."""

    kind: ClassVar[str] = "stonesoup"

    model: Any = foreign("the transition model")
    state: Space = fields.part("its axes, in the order of its states")

    def __attrs_post_init__(self) -> None:
        if len(self.state) != self.model.ndim_state:
            raise ValueError(f"state: must have {self.model.ndim_state} axes, as the model has, got {self.state}")

    @property
    def linear(self) -> bool:
        """Whether the model is."""
        return _linear(self.model)

    def move(self, x: Array, dt: float) -> Array:
        moved = _called(self.model.function, x, time_interval=timedelta(seconds=dt), noise=False)
        return self.state.canonical(moved) if dt > 0 else x

    def jacobian(self, x: Array, dt: float) -> Array:
        """Return F: (*b, n) -> (*b, n, n), or (n, n) of a linear model."""
        if self.linear:
            return np.asarray(self.model.matrix(time_interval=timedelta(seconds=dt)), dtype=float)
        stated = _stated(self.model, x, len(self.state), time_interval=timedelta(seconds=dt))
        return super().jacobian(x, dt) if stated is None else stated

    def noise(self, x: Array, dt: float) -> Array:
        n = len(self.state)
        return np.asarray(self.model.covar(time_interval=timedelta(seconds=dt)), dtype=float) if dt > 0 else np.zeros((n, n))


def _observed(sensor: StoneSoupSensor) -> Space:
    model, axes = sensor.model, sensor.state.axes
    used = [*model.mapping, *(getattr(model, "velocity_mapping", None) or ())]
    return Space(tuple(axes[int(i)] for i in used if i is not None))


def _measured(sensor: StoneSoupSensor) -> Space:
    if sensor.measures is not None:
        return sensor.measures
    if _linear(sensor.model):
        return sensor.observes
    name = type(sensor.model).__name__
    if name not in MEASURED:
        raise InputError(f"measures: must name what {name} measures; known are {', '.join(MEASURED)} and linear models")
    return MEASURED[name]


def own_model(detection: Any, sensor: Sensor | None) -> tuple[Pose | None, Array | None]:
    """Return the place and the noise (m, m) that a detection's own measurement model states, None as the sensor has them.

    InputError if its model is another one otherwise: Stone Soup's updaters would use it, and the sensor cannot.
    """
    model = getattr(detection, "measurement_model", None)
    own = sensor.model if isinstance(sensor, StoneSoupSensor) else None
    if model is None or sensor is None or model is own:
        return None, None
    name, wanted = type(model).__name__, sensor.kind if own is None else type(own).__name__
    if own is not None and (type(model) is not type(own) or any(_part(model, at) != _part(own, at) for at in _SAME)):
        told = f"must be a {wanted} with the sensor's {', '.join(_SAME)}: it may differ in place, yaw and noise"
        raise InputError(f"a detection at {detection.timestamp} has a measurement_model of its own, a {name}; {told}")
    pose = _pose(model)
    if pose is not None and own is not None and pose == _pose(own):
        pose = None
    noise = np.asarray(model.covar(), dtype=float) if hasattr(model, "covar") else None
    if noise is not None and own is not None and np.array_equal(noise, np.asarray(own.covar(), dtype=float)):
        noise = None
    return None if pose is None else Pose(*pose), noise


_SAME = ("ndim_state", "mapping", "velocity_mapping")


def _part(model: Any, name: str) -> Any:
    value = getattr(model, name, None)
    return None if value is None else np.ravel(value).tolist()


def _pose(model: Any) -> tuple[list[float], list[float] | None, float] | None:
    """Return place, velocity and yaw of a model; None if it has no place. InputError if it is tilted."""
    if not hasattr(model, "translation_offset"):
        return None
    place, turned, moving = (_part(model, name) for name in ("translation_offset", "rotation_offset", "velocity"))
    *tilt, yaw = (float(angle) for angle in turned or (0.0, 0.0, 0.0))
    if any(tilt):
        raise InputError(f"the measurement_model of a detection is tilted by {tilt} rad, and a pose has a heading alone")
    return [float(number) for number in place], moving, yaw


@final
@frozen(eq=False)
class StoneSoupSensor(Sensor):
    """A Gaussian measurement model of Stone Soup, with the P_D and the clutter that Stone Soup keeps elsewhere."""

    kind: ClassVar[str] = "stonesoup"

    model: Any = foreign("the measurement model")
    state: Space = fields.part("the axes of its states, in their order")
    measures: Space | None = fields.part("what it measures; default: as known of the model", default=None)
    detection_probability: float = fields.probability("probability that a target gives a return", default=1.0)
    clutter_density: float = fields.quantity("1", "false returns per scan and unit of volume", default=0.0, at_least=0)
    observes: Space = field(init=False, default=Factory(_observed, takes_self=True))
    measurement: Space = field(init=False, default=Factory(_measured, takes_self=True))

    def __attrs_post_init__(self) -> None:
        if len(self.state) != self.model.ndim_state:
            raise ValueError(f"state: must have {self.model.ndim_state} axes, as the model has, got {self.state}")

    @property
    def linear(self) -> bool:
        """Whether the model is."""
        return _linear(self.model)

    def at(self, pose: Pose) -> StoneSoupSensor:
        """Return the sensor with a model of this one place, speed and yaw; NotImplementedError where the model has none."""
        if not hasattr(self.model, "translation_offset"):
            return super().at(pose)  # type: ignore[return-value]
        if np.ndim(pose.heading):
            raise NotImplementedError("a model of Stone Soup stands at one place, and runs in lockstep each have their own")
        column = needed("stonesoup.types.array").StateVector
        model = copy(self.model)
        model.translation_offset = column(pose.position)
        model.rotation_offset = column([0.0, 0.0, float(pose.heading)])
        if hasattr(model, "velocity") and pose.velocity is not None:
            model.velocity = column(pose.velocity)
        return evolve(self, model=model)

    def _whole(self, x: Array) -> Array:
        """Return whole states of the model (*b, n) from their observed axes, 0 elsewhere."""
        whole = np.zeros((*x.shape[:-1], len(self.state)))
        whole[..., self.state.locate(self.observes)] = x
        return whole

    def measure(self, x: Array) -> Array:
        return self.measurement.canonical(_called(self.model.function, self._whole(x), noise=False))

    def jacobian(self, x: Array) -> Array:
        """Return H: (*b, n) -> (*b, m, n), or (m, n) of a linear model."""
        where = self.state.locate(self.observes)
        if self.linear:
            return np.asarray(self.model.matrix(), dtype=float)[:, where]
        stated = _stated(self.model, self._whole(x), len(self.measurement))
        return super().jacobian(x) if stated is None else stated[..., where]

    def noise(self, x: Array) -> Array:
        return np.asarray(self.model.covar(), dtype=float)

    def detects(self, x: Array) -> Array:
        return np.asarray(self.detection_probability)

    def clutter(self, z: Array) -> Array:
        return np.asarray(self.clutter_density)

    def invert(self, z: Array, noise: Array | None = None) -> Gaussian:
        """Return where a return puts its target, by the model's own inverse: (*b, m) -> mean (*b, n), cov (*b, n, n)."""
        reversible = isinstance(self.model, needed("stonesoup.models.base").ReversibleModel)
        where = self.state.locate(self.observes)
        if self.linear:
            H = self.jacobian(np.zeros(len(where)))
            if H.shape[0] != H.shape[1] or np.linalg.matrix_rank(H) < len(H):
                raise NotImplementedError("H cannot be inverted, so one return of this sensor does not start a track")
            x = z @ np.linalg.inv(H).T
        elif reversible and len(where) == len(self.measurement):
            detection = needed("stonesoup.types.detection").Detection
            rows = [self.model.inverse_function(detection(row[:, None])) for row in z.reshape(-1, z.shape[-1])]
            x = np.array([np.asarray(row, dtype=float).ravel()[where] for row in rows]).reshape(*z.shape[:-1], len(where))
        else:
            return super().invert(z, noise)
        back = np.linalg.inv(np.broadcast_to(self.jacobian(x), (*x.shape[:-1], len(where), len(where))))
        cov = back @ (self.noise(x) if noise is None else noise) @ np.swapaxes(back, -1, -2)
        return Gaussian(x, (cov + np.swapaxes(cov, -1, -2)) / 2)
