"""Laws of sensors."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import combinations

import numpy as np
from attrs import NOTHING

from vedette.config.parameters import parameters
from vedette.metrics.consistency import nees
from vedette.roles import Sensor
from vedette.space import Array, Space
from vedette.testing.comparisons import closed_by, closed_if, covariance, demand, finite, frozen_copy, is_derivative, same
from vedette.testing.law import Law
from vedette.testing.laws import clutter, imaging, inversion, platforms, rates, twins
from vedette.testing.laws import space as spaces
from vedette.testing.laws.noise_units import deviations_count, mean_noise_is_a_mean, noise_has_its_units
from vedette.testing.laws.sensor_cases import Looks, full, noise_of, regular, slopes
from vedette.testing.states import size, steps_of
from vedette.types import Pose

Method = Callable[[Array], Array]
FAR = 30.0
"""How many times as far away derivatives hold, too: 240 km, farther than any radar sees."""


def _methods(sensor: Sensor) -> dict[str, tuple[Method, tuple[int, ...]]]:
    """Each method of a state, and the shape of its result beyond the batch axes."""
    m, n = len(sensor.measurement), len(sensor.observes)
    coarse = sensor.unresolved(np.zeros((1, n))) is not None
    return {
        **({"unresolved": (lambda x: np.asarray(sensor.unresolved(x)), (m, m))} if coarse else {}),
        "measure": (sensor.measure, (m,)),
        "jacobian": (sensor.jacobian, (m, n)),
        "noise": (sensor.noise, (m, m)),
        "detects": (sensor.detects, ()),
    }


def pure(sensor: Sensor, drawn: Looks) -> None:
    """Calls leave their arguments and the sensor as they were, and give the same again."""
    for name, (method, _) in _methods(sensor).items():
        first = np.array(method(drawn.x))
        method(frozen_copy(drawn.x[::-1] + 1.0))
        same(f"{name} called again", method(drawn.x), first, 0.0)
    first = np.array(sensor.clutter(drawn.z))
    same("clutter called again", sensor.clutter(drawn.z), first, 0.0)


def batches_as_it_loops(sensor: Sensor, drawn: Looks) -> None:
    """A batch of states gives what each state gives alone, whatever the number of batch axes or of states."""
    block = frozen_copy(np.stack([np.tile(drawn.x, (40, 1)), np.tile(drawn.x[::-1], (40, 1))], axis=1))
    for name, (method, shape) in _methods(sensor).items():
        alone = np.stack(40 * [full(method(x), x, shape) for x in drawn.x])
        same(name, full(method(block), block, shape), np.stack([alone, alone[::-1]], axis=1))
        method(drawn.x[:0])


def gives_finite_numbers(sensor: Sensor, drawn: Looks) -> None:
    """Ordinary states, right over the sensor too, give finite measurements, derivatives and detection probabilities."""
    for name, (method, _) in _methods(sensor).items():
        finite(name, method(drawn.x))


def noise_is_positive_definite(sensor: Sensor, drawn: Looks) -> None:
    """The noise, and its mean over a belief, are symmetric and positive definite."""
    stated, n, m = noise_of(sensor, drawn.x), drawn.x.shape[-1], len(sensor.measurement)
    covariance("noise", stated, definite=True)
    if (cells := sensor.unresolved(drawn.x)) is not None:
        covariance("unresolved", full(cells, drawn.x, (m, m)), definite=True)
    mean = sensor.mean_noise(drawn.x, np.broadcast_to(np.eye(n), (*drawn.x.shape, n)))
    covariance("mean_noise", full(mean, drawn.x, (m, m)), definite=True)


def jacobian_is_the_derivative(sensor: Sensor, drawn: Looks) -> None:
    """The jacobian is the derivative of measure, the short way round where axes wrap, near and far."""
    reach = np.where([axis.unit == "m" and axis.period is None for axis in sensor.observes.axes], FAR, 1.0)
    for x in (*drawn.x, *reach * drawn.x):
        stated = sensor.jacobian(x)
        is_derivative(sensor.measure, sensor.measurement.difference, stated, x, steps_of(sensor.observes))


def linear_as_declared(sensor: Sensor, drawn: Looks) -> None:
    """If linear: measure(x) = H x with one H for all states. The noise may still depend on the state."""
    H = full(sensor.jacobian(drawn.x), drawn.x, (len(sensor.measurement), len(sensor.observes)))
    same("jacobian elsewhere", H[1:], np.broadcast_to(H[0], H[1:].shape), 1e-9)
    same("measure", sensor.measure(drawn.x[0]), H[0] @ drawn.x[0], 1e-9, np.abs(H[0]) @ np.abs(drawn.x[0]) + 1e-12)


def measurement_lies_in_its_domain(sensor: Sensor, drawn: Looks) -> None:
    """What is measured is canonical: an angle is in [-period/2, period/2)."""
    z = sensor.measure(drawn.x)
    for i, axis in enumerate(sensor.measurement.axes):
        if axis.period is not None:
            inside = (z[..., i] >= -axis.period / 2) & (z[..., i] <= axis.period / 2)
            demand(np.all(inside), f"{axis.name}: must be in [-period/2, period/2), got {z[..., i].tolist()}")


def detection_is_a_probability(sensor: Sensor, drawn: Looks) -> None:
    """The detection probability is between 0 and 1; half of a `detection_probability`, all else as usual, makes it less."""
    p = np.asarray(sensor.detects(drawn.x))
    demand(np.all((p >= 0) & (p <= 1)), f"detects: must be in [0, 1], got {p.tolist()}")
    stated, needed = getattr(sensor, "detection_probability", None), parameters(type(sensor))
    if not isinstance(stated, float) or not stated or "detection_probability" not in {each.name for each in needed}:
        return
    given = {each.field.name: getattr(sensor, each.field.name) for each in needed if each.default is NOTHING}
    with closed_by(ValueError, "it cannot be made of the parameters that it needs alone: {}"):
        usual, half = (type(sensor)(**given | {"detection_probability": share * stated}) for share in (1.0, 0.5))
    near = np.concatenate([share * drawn.x for share in (1.0, 0.1, 0.01)])
    seen, less = (full(each.detects(near), near, ()) for each in (usual, half))
    demand(not seen.any() or np.any(less < seen), f"detects: must be less with half of detection_probability, {stated:g}")


def inverts_what_it_measures(sensor: Sensor, drawn: Looks) -> None:
    """What a return without error stands for is the state that was measured, give or take its own covariance.

    Of a sensor that measures fewer axes than it observes, that is asked of what it measures: the rest is assumed.
    """
    x = regular(sensor, drawn.x)
    found = inversion.inverted(sensor, sensor.measure(x))
    n = len(sensor.observes)
    demand(found.mean.shape == (3, n), f"invert: mean must have shape {(3, n)}, got {found.mean.shape}")
    demand(found.cov.shape == (3, n, n), f"invert: cov must have shape {(3, n, n)}, got {found.cov.shape}")
    covariance("invert", found.cov, definite=True)
    spread = getattr(sensor, "spread", None)
    for name, deviation in spread.items() if isinstance(spread, Mapping) else ():
        if name in sensor.observes:
            i = sensor.observes.names.index(name)
            same(f"invert: variance of {name}, by `spread`", found.cov[:, i, i], np.full(3, deviation**2), 1e-9)
    apart = sensor.observes.difference(x, found.mean)
    cov = found.cov
    if len(sensor.measurement) < n:
        slope = slopes(sensor, x)
        apart = sensor.measurement.difference(sensor.measure(x), sensor.measure(found.mean))
        cov = slope @ cov @ np.swapaxes(slope, -1, -2)
    worst = float(np.max(nees(apart, cov)))
    demand(worst <= 9.0, f"invert: the true state is {np.sqrt(worst):.3g} standard deviations off, allowed 3")


def standing_elsewhere_keeps_the_axes(sensor: Sensor, drawn: Looks) -> None:
    """Placed somewhere, it is a sensor over the same axes, and the one that was placed is as before."""
    before = [np.array(each(drawn.x)) for each in (sensor.measure, sensor.noise)]
    there = platforms.placed(sensor, Pose(platforms.PLACE, platforms.SPEED, platforms.HEADING))
    demand(there.measurement == sensor.measurement, f"at: measurement must be {sensor.measurement}, got {there.measurement}")
    demand(there.observes == sensor.observes, f"at: observes must be {sensor.observes}, got {there.observes}")
    pure(there, drawn)
    jacobian_is_the_derivative(there, drawn)
    for each, was in zip((sensor.measure, sensor.noise), before, strict=True):
        same(f"{each.__name__} after at", each(drawn.x), was, 0.0)


def differences_undo_steps(sensor: Sensor, drawn: Looks) -> None:
    """In the measurement space, difference and displace are inverse; speeds are in the units of what moves."""
    spaces.differences_undo_steps(sensor.measurement, drawn.z, drawn.step)
    for space in (sensor.measurement, sensor.observes):
        spaces.speeds_have_their_units(space)


def names_mean_the_same(sensor: Sensor, drawn: Looks) -> None:
    """What is measured under name and unit of an observed axis grows with it, and not as much with another one of them."""
    both = [axis.name for axis in sensor.measurement.axes if axis in sensor.observes.axes]
    closed_if(not both, "it measures under names of its own")
    H = full(sensor.jacobian(drawn.x), drawn.x, (len(sensor.measurement), len(sensor.observes)))
    for name in both:
        slope = H[:, sensor.measurement.names.index(name), sensor.observes.names.index(name)]
        demand(np.all(slope > 0), f"jacobian: {name} must grow with {name}, its slope is {slope.tolist()}")
        for other in {*both} - {name}:
            across = H[:, sensor.measurement.names.index(name), sensor.observes.names.index(other)]
            otherwise = f"jacobian: {name} grows with {other} as with {name}, by {across.tolist()}"
            demand(np.all(np.abs(across) < slope), otherwise)


def angles_wrap(sensor: Sensor, drawn: Looks) -> None:
    """Angles that turn have a period; in the measured space, whole turns change nothing and wrapped axes are canonical."""
    angles = [i for i, axis in enumerate(sensor.measurement.axes) if axis.unit == "rad" and axis.period is None]
    closed_if(not angles and all(axis.period is None for axis in sensor.measurement.axes), "no axis wraps")
    for i in angles:  # an elevation needs no period; what jumps on the way around the sensor does
        for way in _ways_around(sensor.observes, drawn.x[0]):
            with np.errstate(all="ignore"):
                jump = float(np.nanmax(np.abs(np.diff(sensor.measure(way)[:, i])), initial=0.0))
            axis, turns = sensor.measurement.axes[i], [other.name for other in sensor.measurement.axes if other.period]
            order = f", unless it is {turns[0]} that stands there: values and axes must have one order" if turns else ""
            told = f"{axis.name}: jumps by {jump:.3g} rad on the way around: it needs a period, 'rad mod 2pi'{order}"
            demand(jump < 4.0, told)
    spaces.wraps_are_canonical(sensor.measurement, drawn.z, drawn.step)


def _ways_around(space: Space, x: Array) -> list[Array]:
    """Return closed ways (s, n): circles around the origin in every two positions, and whole turns of each angle."""
    turn = np.linspace(-np.pi, np.pi, 121) + 0.01
    places = [i for i, axis in enumerate(space.axes) if axis.unit == "m" and axis.period is None]
    ways = []
    for i, j in combinations(places, 2):
        way = np.tile(x, (len(turn), 1))
        way[:, i], way[:, j] = 5 * size(space.axes[i]) * np.cos(turn), 5 * size(space.axes[j]) * np.sin(turn)
        ways.append(way)
    for i, axis in enumerate(space.axes):
        if axis.period is not None:
            way = np.tile(x, (len(turn), 1))
            way[:, i] = turn / (2 * np.pi) * axis.period
            ways.append(space.canonical(way))
    return ways


LAWS: tuple[Law, ...] = (
    *map(Law, (
        pure, batches_as_it_loops, gives_finite_numbers, noise_is_positive_definite,
        noise_has_its_units, deviations_count, mean_noise_is_a_mean, jacobian_is_the_derivative,
        measurement_lies_in_its_domain, detection_is_a_probability,
        inverts_what_it_measures, standing_elsewhere_keeps_the_axes, differences_undo_steps,
        angles_wrap, names_mean_the_same,
    )),
    Law(linear_as_declared, needs="linear"),
    *inversion.LAWS, *platforms.LAWS, *clutter.LAWS, *rates.LAWS, *imaging.LAWS, *twins.OF_SENSOR,
)  # fmt: skip
