"""Laws of noises, a model's Q and a sensor's R: their variances are squares of what parameters' units say."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

import numpy as np
from attrs import evolve

from vedette.config.parameters import Parameter, holds_parts, parameters
from vedette.roles import Component, MotionModel, Sensor
from vedette.space import Array, Space
from vedette.testing.comparisons import Closed, closed_if, demand
from vedette.testing.laws.motion_cases import Moves
from vedette.testing.laws.sensor_cases import Looks

LENGTHS, _ANGLES = ("m", "km", "NM", "ft", "px"), ("rad", "deg", "mrad")
_PART = re.compile(r"(m|km|NM|ft|px|rad|deg|mrad|1)(?:\^([\d.]+))?$")
Noise = Callable[[Any, Array], Array]
DEVIATION = "standard deviation"
"""What is said of a parameter that is one."""


def power(unit: str, words: tuple[str, ...]) -> float:
    """Return the power of lengths, or of angles, in a unit: -2 of lengths in "1/m^2"."""
    found, sign = 0.0, 1.0
    for part in unit.partition(" mod ")[0].split("/"):
        match = _PART.match(part)
        if match and match[1] in words:
            found += sign * float(match[2] or 1.0)
        sign = -1.0
    return found


def _alone(component: Any, known: Mapping[str, Parameter]) -> Any:
    """Return a component without the others that it holds and may do without; Closed if some are left."""
    held = [name for name, p in known.items() if holds_parts(p.shape) and getattr(component, name)]
    if not held:
        return component
    left = {name: getattr(component, name) for name in known if name not in held}
    with suppress(ValueError, TypeError):  # it cannot do without
        alone = type(component)(**left)
        if not any(getattr(alone, name) for name in held):
            return alone
    raise Closed("it holds other components, whose parameters count too")


def _noise(component: Any, drawn: Moves | Looks) -> tuple[Space, Space, Noise]:
    """Return the axes of a component's noise, those of its states, and the noise of such a component there."""
    if isinstance(drawn, Moves):
        return component.state, component.state, lambda other, x: other.noise(x, drawn.dt)
    return component.measurement, component.observes, lambda other, x: other.noise(x)


def variances_are_squares(component: MotionModel | Sensor, drawn: Moves | Looks) -> None:
    """A deviation is squared: no variance grows as a parameter does that is a length or an angle, as the axis is.

    Such as sigma * dt for sigma^2 dt; unless other parameters, or the state, make it a square.
    """
    x, (space, states, noise) = drawn.x, _noise(component, drawn)
    known = {p.name: p for p in parameters(type(component))}
    component = _alone(component, known)
    numbers = {
        name: value for name in known if isinstance(value := getattr(component, name), float) and 0 < abs(value) < np.inf
    }
    usual = _variances(component, x, noise)
    judged = False
    for name, value in numbers.items():
        unit = known[name].unit
        lengths, angles = power(unit, LENGTHS), power(unit, _ANGLES)
        if (lengths, angles) not in ((1.0, 0.0), (0.0, 1.0)):
            continue
        words = LENGTHS if lengths else _ANGLES
        doubled = changed(component, {name: 2.0 * value})
        if doubled is None:
            continue
        judged = True
        after = _variances(doubled, x, noise)
        for i, axis in enumerate(space.axes):
            grown = (usual[:, i] > 0) & (np.abs(after[:, i] - 2.0 * usual[:, i]) <= 1e-9 * usual[:, i])
            demand(
                power(axis.unit, words) != 1.0
                or not np.all(grown)
                or _made_square(component, known, name, i, states, x, noise),
                f"noise: the variance of {axis.name}, in ({axis.unit})^2, grows as {name}, in {unit}, and not as its square",
            )
    closed_if(not judged, "no parameter is a length or an angle")


def noise_has_its_units(component: MotionModel | Sensor, drawn: Moves | Looks) -> None:
    """In half the unit of length, with all parameters and states in it, variances are what their units say.

    What the code holds as a number of its own makes it no whole power: that is not judged, nor what does not change at all.
    """
    x, (space, states, noise) = drawn.x, _noise(component, drawn)
    known = {p.name: p for p in parameters(type(component))}
    component = _alone(component, known)
    powers = {name: power(p.unit, LENGTHS) for name, p in known.items()}
    values = {name: getattr(component, name) for name, p in powers.items() if p}
    values = {name: value for name, value in values.items() if value is not None and not isinstance(value, Mapping)}
    if not values or not all(isinstance(value, float | int) for value in values.values()):
        raise Closed("no parameter is a length, or not each is a number")
    other = changed(component, {name: value * 2.0 ** powers[name] for name, value in values.items()})
    closed_if(other is None, "it refuses parameters twice as large")
    scale = np.array([2.0 ** power(axis.unit, LENGTHS) for axis in states.axes])
    usual, there = _variances(component, x, noise), _variances(other, x * scale, noise)
    for i, axis in enumerate(space.axes):
        wanted = 2 * power(axis.unit, LENGTHS)
        if not wanted or not np.all((usual[:, i] > 0) & (there[:, i] > 0)):
            continue
        found = np.log2(there[:, i] / usual[:, i])
        k = float(np.round(np.mean(found)))
        demand(
            k in (0.0, wanted) or not np.all(np.abs(found - k) < 1e-6),
            f"noise: the variance of {axis.name} must be {2.0**wanted:g} times as large in half the unit of length, "
            f"is {2.0**k:g} times",
        )


_OTHER_POWERS = {1: 1.0, 3: 19 / 7, 4: 65 / 15}
"""Of a power of a parameter, how much more it grows from twice to three times than up to twice; of a square 5/3."""


def deviations_count(component: MotionModel | Sensor, drawn: Moves | Looks) -> None:
    """The noise grows as the square of `sigma`, of any `sigma_...`, and of what is called a standard deviation.

    One alone must count, and an axis' own; others may be of what is not in the noise.
    """
    x, (space, _, noise) = drawn.x, _noise(component, drawn)
    names = space.names
    known = {"sigma", *(f"sigma_{axis}" for axis in names)}
    told = {p.name: p.field.metadata.get("doc", "") for p in parameters(type(component))}
    said = [name for name, doc in told.items() if name.startswith("sigma_") or DEVIATION in doc]
    judged = False
    for name in [*said, *sorted(known.difference(said))]:
        value = getattr(component, name, None)
        if not isinstance(value, float) or not 0 < value < np.inf:
            continue
        more = [changed(component, {name: factor * value}) for factor in (2.0, 3.0)]
        if any(one is None for one in more):
            continue
        judged = True
        usual, twice, thrice = (_variances(one, x, noise) for one in (component, *more))
        axis = name.removeprefix("sigma_")
        own = [names.index(axis)] if axis in names else list(range(len(names)))
        counts = np.any(twice[:, own] > usual[:, own]) or (name not in known and len(said) > 1)
        demand(counts, f"noise: must grow with {name}, stays {usual[0]}")
        for i in own:
            first, then = twice[:, i] - usual[:, i], thrice[:, i] - twice[:, i]
            for power, ratio in _OTHER_POWERS.items():
                wrong = (first > 1e-6 * usual[:, i]) & (np.abs(then - ratio * first) < 1e-6 * first)
                demand(not np.all(wrong), f"noise: the variance of {names[i]} grows as {name}^{power}, not as its square")
    closed_if(not judged, "no parameter is a `sigma` or called a standard deviation")


def _made_square(
    component: Component, known: Mapping[str, Any], name: str, i: int, states: Space, x: Array, noise: Noise
) -> bool:
    """Tell whether other parameters, or the state, make variance `i` a square: in half the unit of length all have it."""
    words = LENGTHS if power(known[name].unit, LENGTHS) else _ANGLES
    others = {n: power(p.unit, words) for n, p in known.items()}
    if words is _ANGLES:  # a state cannot be given another unit of angle: does any other angle matter?
        return any(_matters(component, n, i, x, noise) for n, p in others.items() if p and n != name)
    values = {n: getattr(component, n) for n, p in others.items() if p}
    if not all(isinstance(value, float | int | np.ndarray) or value is None for value in values.values()):
        return True
    other = changed(component, {n: None if v is None else v * 2.0 ** others[n] for n, v in values.items()})
    if other is None:
        return True
    scale = np.array([2.0 ** power(axis.unit, LENGTHS) for axis in states.axes])
    usual, there = _variances(component, x, noise)[:, i], _variances(other, x * scale, noise)[:, i]
    return bool(np.any(np.abs(there - 2.0 * usual) > 1e-6 * usual))


def _matters(component: Component, name: str, i: int, x: Array, noise: Noise) -> bool:
    value = getattr(component, name)
    other = changed(component, {name: 1.5 * value + 0.01}) if isinstance(value, float) else None
    return other is None or not np.array_equal(_variances(other, x, noise)[:, i], _variances(component, x, noise)[:, i])


def _variances(component: Any, x: Array, noise: Noise) -> Array:
    full = np.asarray(noise(component, x))
    return np.broadcast_to(np.diagonal(full, axis1=-2, axis2=-1), (len(x), full.shape[-1]))


def changed(component: Any, values: Mapping[str, Any]) -> Any:
    try:
        return evolve(component, **values)
    except (TypeError, ValueError):
        return None
