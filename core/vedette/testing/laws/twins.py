"""Laws of compiled twins: they say what the component's own methods say."""

from __future__ import annotations

from typing import Any

import numpy as np

from vedette import kernels
from vedette.filters import predicted
from vedette.roles import Estimator, MotionModel, Sensor
from vedette.space import Array, Space
from vedette.testing.comparisons import Closed, demand, frozen_copy, same
from vedette.testing.law import Law
from vedette.testing.laws.estimator_cases import P_GATE, Scene, alike, soft
from vedette.testing.laws.motion_cases import Moves
from vedette.testing.laws.sensor_cases import Looks, full
from vedette.testing.sensors import Untwinned
from vedette.testing.strategies import usual
from vedette.types import Detections, Gaussian, Pose

AGREES = 1e-12
"""Of each row's largest entry, and of half a turn where an axis wraps."""


def _same_value(what: str, space: Space, got: Array, wanted: Array) -> None:
    """Demand the same up to whole turns."""
    half_turns = np.array([(axis.period or 0.0) / 2 for axis in space.axes])
    scale = np.maximum(np.max(np.abs(wanted), axis=tuple(range(wanted.ndim - 1)), initial=1e-30), half_turns)
    same(what, wanted + space.difference(got, wanted), wanted, AGREES, scale)
    demand(np.all(space.canonical(got) == got), f"{what}: must be canonical, got {got.tolist()}")


def _same_matrix(what: str, got: Array, wanted: Array) -> None:
    same(what, got, wanted, AGREES, np.max(np.abs(wanted), axis=-1, keepdims=True, initial=1e-30))


def says_what_the_sensor_says(sensor: Sensor, drawn: Looks) -> None:
    """A sensor's compiled twin gives its measurement, derivative, noise and detection probability, here and elsewhere."""
    _compare_looks(sensor, drawn.x)
    try:
        turned = sensor.at(Pose(np.array([120.0, -45.0]), np.array([3.0, 4.0]), 0.7))
        runs = sensor.at(Pose(np.array([[120.0, -45.0], [0.0, 3.0]]), np.zeros((2, 2)), np.array([0.7, -3.0])))
    except NotImplementedError:
        return
    _compare_looks(turned, drawn.x)
    _compare_looks(runs, frozen_copy(np.stack([drawn.x, drawn.x[::-1]])))


def _compare_looks(sensor: Sensor, x: Array) -> None:
    twin, m, n = sensor.twin, len(sensor.measurement), len(sensor.observes)
    demand(twin is not None, "twin: must be there wherever the sensor stands")
    assert twin is not None
    seen = kernels.measure_twin(x, twin.function, twin.numbers(x), m)
    if seen is None:
        raise Closed("the kernels that run call no twin")
    _same_value("measure", sensor.measurement, seen.z, sensor.measure(x))
    _same_matrix("jacobian", seen.slope, full(sensor.jacobian(x), x, (m, n)))
    _same_matrix("noise", seen.noise, full(sensor.noise(x), x, (m, m)))
    same("detects", seen.detects, full(sensor.detects(x), x, ()))
    if twin.parameters.ndim == 1:
        _alone_as_among(seen, [kernels.measure_twin(one, twin.function, twin.parameters, m) for one in x])


def _alone_as_among(all_states: Any, each: list[Any]) -> None:
    for i, alone in enumerate(each):
        for name, one, among in zip(all_states._fields, alone, all_states, strict=True):
            same(f"{name} of one state", one, among[i], 0.0)


def says_what_the_motion_says(motion: MotionModel, drawn: Moves) -> None:
    """A motion's compiled twin gives the moved state, derivative and noise."""
    twin, x, n = motion.twin, drawn.x, len(motion.state)
    assert twin is not None
    for dt in (drawn.dt, drawn.later):
        step = float(dt), twin.function, twin.numbers(x, float(dt)), motion.state.periods
        moved = kernels.move_twin(x, *step)
        if moved is None:
            raise Closed("the kernels that run call no twin")
        _same_value("move", motion.state, moved.mean, motion.state.canonical(motion.move(x, dt)))
        _same_matrix("jacobian", moved.slope, full(motion.jacobian(x, dt), x, (n, n)))
        _same_matrix("noise", moved.noise, full(motion.noise(x, dt), x, (n, n)))
        _alone_as_among(moved, [kernels.move_twin(one, *step) for one in x])


def sees_by_a_twin_as_without(estimator: Estimator[Any], drawn: Scene) -> None:
    """Through a bent sensor's compiled twin a wide belief is updated as through the sensor itself."""
    state, sensor = estimator.state, usual("sensor", "range_bearing")(sigma_range=20.0, sigma_bearing=0.02)
    if any(axis not in state.axes for axis in sensor.observes.axes) or estimator.refuses(sensor) is not None:
        raise Closed("it takes no returns of range and bearing")
    where, rng = state.locate(sensor.observes), drawn.rng()
    mean = np.array(drawn.prior.mean)
    mean[..., where] = [900.0, -500.0] + 50.0 * rng.standard_normal((2, 2, 2))
    prior = Gaussian(frozen_copy(mean), frozen_copy(9.0 * drawn.prior.cov))
    z = sensor.measure(mean[:, 0, where])[:, None] + rng.standard_normal((2, 3, 2)) * [150.0, 0.2]
    scan = Detections(frozen_copy(sensor.measurement.canonical(z)), np.ones((2, 3), dtype=bool))
    ends = []
    for seen in (sensor, Untwinned(sensor)):
        belief = predicted(estimator, estimator.start(prior, state, drawn.rng()), drawn.dt, drawn.rng())
        found = estimator.evaluate(belief, seen, scan, P_GATE)
        ends.append((found, estimator.update(belief, found, soft(found.loglik, drawn.seed))))
    (one, before), (other, after) = ends
    same("loglik through a twin", one.loglik, other.loglik, 1e-6, 1.0 + np.abs(other.loglik))
    alike(estimator, before, estimator.moments(after), 1e-6, "through a twin: ")


OF_ESTIMATORS = (Law(sees_by_a_twin_as_without, needs="not traits.draws"),)
OF_SENSOR = (Law(says_what_the_sensor_says, needs="twin"),)
OF_MOTION = (Law(says_what_the_motion_says, needs="twin"),)
