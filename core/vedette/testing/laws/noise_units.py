"""Laws of noises, a model's Q and a sensor's R: their variances are squares of what parameters' units say."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

import attrs
import numpy as np
from attrs import evolve

from vedette.config.parameters import parameters
from vedette.roles import Component, MotionModel, Sensor, components_in
from vedette.space import Array, Space
from vedette.testing.comparisons import Closed, closed_by, closed_if, demand, deviations, products, same
from vedette.testing.laws.motion_cases import Moves
from vedette.testing.laws.sensor_cases import Looks, full
from vedette.testing.states import sizes

LENGTHS, _ANGLES, _TIMES = ("m", "km", "NM", "ft", "px"), ("rad", "deg", "mrad"), ("s", "min", "h")
_PART = re.compile(r"(m|km|NM|ft|px|rad|deg|mrad|s|min|h|1)(?:\^([\d.]+))?$")
Noise = Callable[[Any, Array], Array]
DEVIATION = "standard deviation"
"""What is said of a parameter that is one."""
NEAR, NEARLY = 0.3, 0.02
"""How much of what the noise at the mean is off by, and beside it of the noise, a mean noise may be off: formulas to second
order are by .01, of headings that err by .3 rad and ranges by .2 of their own (`target_oriented`, `decorrelated_position`).
"""


def power(unit: str, words: tuple[str, ...]) -> float:
    """Return the power of lengths, of angles or of times in a unit: -2 of lengths in "1/m^2"."""
    parts = map(_PART.match, unit.partition(" mod ")[0].replace("kn", "NM/h").split("/"))
    over, *under = (float(part[2] or 1.0) if part and part[1] in words else 0.0 for part in parts)
    return over - sum(under)


def _noise(component: Any, drawn: Moves | Looks, pace: float = 1.0) -> tuple[Space, Space, Noise]:
    """Return the axes of a component's noise, those of its states, and the noise of such a component there, after `pace`
    times as long.
    """
    if isinstance(drawn, Moves):
        return component.state, component.state, lambda other, x: other.noise(x, pace * drawn.dt)
    return component.measurement, component.observes, lambda other, x: other.noise(x)


def in_half_the_unit(value: Any, axes: Mapping[str, str], words: tuple[str, ...] = LENGTHS, unit: str = "1") -> Any:
    """Return a parameter, or what holds some, in half the unit of length, or of what has the units `words`; `axes` to their
    units, as tables name them.
    """
    if attrs.has(type(value)):
        known = [
            (p.name, getattr(value, p.field.name), unit if p.unit in ("", "1") else p.unit) for p in parameters(type(value))
        ]
        return evolve(value, **{name: in_half_the_unit(each, axes, words, its) for name, each, its in known})
    if isinstance(value, Mapping):
        if unknown := [name for name in value if name not in axes]:
            raise Closed(f"it has a table by {unknown[0]!r}, which is no axis")
        return {name: in_half_the_unit(each, axes, words, axes[name]) for name, each in value.items()}
    if isinstance(value, tuple):
        return tuple(in_half_the_unit(each, axes, words, unit) for each in value)
    return value * 2.0 ** power(unit, words) if isinstance(value, float | np.ndarray) else value


def factors(space: Space, words: tuple[str, ...] = LENGTHS) -> Array:
    """Return how many times as large each axis (n,) is in half the unit."""
    return 2.0 ** np.array([power(axis.unit, words) for axis in space.axes])


def noise_has_its_units(component: MotionModel | Sensor, drawn: Moves | Looks) -> None:
    """In half the unit of length, or of a motion's time, with all that is given in it, variances are what their units say.

    What the code holds as a number of its own makes it no whole power: that is not judged, nor what does not change at all.
    """
    space, states, noise = _noise(component, drawn)
    axes, judged, still, grown = {axis.name: axis.unit for axis in states.axes}, False, False, ""
    known = {p.name: p.unit for p in parameters(type(component))}
    plain = [name for name, unit in known.items() if unit in ("", "1")]
    bare = [name for name in plain if isinstance(getattr(component, name), float | np.ndarray | Component)]
    for what, words in (("length", LENGTHS), ("time", _TIMES))[: 1 + isinstance(drawn, Moves)]:
        timed, x = words is _TIMES, drawn.x  # of times no variance is judged in which a parameter without a unit counts
        if timed:  # not at a velocity at which the code ends a division by 0
            x = np.where(np.abs(x) < 0.1 * sizes(states), 0.3 * sizes(states), x)
        with closed_by((TypeError, ValueError), "it refuses parameters twice as large: {}"):
            other = in_half_the_unit(component, axes, words)
        usual = _variances(component, x, noise)
        there = _variances(other, x * factors(states, words), _noise(component, drawn, 1.0 + timed)[2])
        for i, wanted in enumerate(2 * np.log2(factors(space, words))):
            unsaid = timed and any(_matters(component, name, i, x, noise) for name in bare)
            if unsaid or not np.all((usual[:, i] > 0) & (there[:, i] > 0)):
                continue
            found = np.log2(there[:, i] / usual[:, i])
            k = float(np.round(np.mean(found)))
            if np.all(np.abs(found - k) < 1e-6):
                told = f"the variance of {space.names[i]} must be {2.0**wanted:g} times as large in half the unit of {what}"
                if timed or wanted:
                    demand(k in (0.0, wanted), f"noise: {told}, is {2.0**k:g} times")
                    judged, still = judged or k == wanted, still or not (timed or k)
                elif k and any(_matters(component, n, i, x, noise) for n, unit in known.items() if power(unit, LENGTHS)):
                    grown = f"{told}, is {2.0**k:g} times, and that of what is in lengths stays the same"
    demand(not (still and grown), f"noise: {grown}")
    closed_if(not judged, "no variance changes by a whole power")


def mean_noise_is_a_mean(component: MotionModel | Sensor, drawn: Moves | Looks) -> None:
    """The mean noise of a sure belief is the noise; over a wide one, it is nearer to the mean than that is.

    By default, that is the noise at the mean; so nothing is asked of one that defines no `mean_noise`, or holds others.
    """
    (space, states, noise), rng = _noise(component, drawn), np.random.default_rng(drawn.seed)
    time, n, m = [drawn.dt] if isinstance(drawn, Moves) else [], len(states), len(space)
    sure = full(component.mean_noise(drawn.x, np.zeros((3, n, n)), *time), drawn.x, (m, m))
    same("mean_noise of a sure belief", sure, full(noise(component, drawn.x), drawn.x, (m, m)), 1e-9)
    if type(component).mean_noise in (MotionModel.mean_noise, Sensor.mean_noise) or components_in(component):
        return
    x = np.abs(drawn.x) + sizes(states)  # nothing that is a length ends below 0
    spread = sizes(states) * rng.uniform(0.02, 0.3, n)
    off = rng.standard_normal((1000, 3, n)) * spread
    each = sum(full(noise(component, there), there, (m, m)) for there in (x + off, x - off)) / 2
    mean, doubt = np.mean(each, axis=0), 6.0 / np.sqrt(len(off)) * np.std(each, axis=0)
    found = full(component.mean_noise(x, np.broadcast_to(np.diag(spread**2), (3, n, n)), *time), x, (m, m))
    scale = products(deviations(mean)) + 1e-300
    off_by, of_one = (np.abs(one - mean) / scale for one in (found, full(noise(component, x), x, (m, m))))
    told = (
        f"of a belief with deviations {spread.tolist()}, the noise has in the mean deviations {deviations(mean)[0].tolist()}"
    )
    worst = np.max(off_by - doubt / scale, axis=(-1, -2)) - NEAR * np.max(of_one, axis=(-1, -2))
    demand(np.all(worst <= NEARLY), f"mean_noise: {told}, got {deviations(found)[0].tolist()}")


_OTHER_POWERS = {1: 1.0, 3: 19 / 7, 4: 65 / 15}
"""Of a power of a parameter, how much more it grows from twice to three times than up to twice; of a square 5/3."""


def deviations_count(component: MotionModel | Sensor, drawn: Moves | Looks) -> None:
    """The noise grows as the square of `sigma`, of any `sigma_...`, and of what is called a standard deviation.

    One alone must count, and an axis' own; others may be of what is not in the noise. Where nothing else makes the variance
    of what a sensor measures, it is the square.
    """
    x, (space, _, noise) = drawn.x, _noise(component, drawn)
    names = space.names
    known = {"sigma", *(f"sigma_{axis}" for axis in names)}
    declared = parameters(type(component))
    units = {p.name: p.unit for p in declared if p.unit}
    told = {p.name: p.field.metadata.get("doc", "") for p in declared}
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
        if axis in names and isinstance(drawn, Looks) and units.get(name) == space.axes[own[0]].unit:
            others = any(_matters(component, other, own[0], x, noise) for other in units if other != name)
            if not others and np.ptp(usual[:, own]) == 0.0:
                same(f"noise: the variance of {axis}, by {name}", usual[:, own[0]], np.full(3, value**2), 1e-9)
        for i in own:
            first, then = twice[:, i] - usual[:, i], thrice[:, i] - twice[:, i]
            for power, ratio in _OTHER_POWERS.items():
                wrong = (first > 1e-6 * usual[:, i]) & (np.abs(then - ratio * first) < 1e-6 * first)
                demand(not np.all(wrong), f"noise: the variance of {names[i]} grows as {name}^{power}, not as its square")
    closed_if(not judged, "no parameter is a `sigma` or called a standard deviation")


def _matters(component: Component, name: str, i: int, x: Array, noise: Noise) -> bool:
    value = getattr(component, name)
    if value is None or (isinstance(value, tuple | Mapping) and not value):  # what is not there
        return False
    tried = (1.5 * value + 0.01, 0.5 * value) if isinstance(value, float) else ()  # a probability of 1 is not made more
    other = next((one for each in tried if (one := changed(component, {name: each})) is not None), None)
    return other is None or not np.array_equal(_variances(other, x, noise)[:, i], _variances(component, x, noise)[:, i])


def _variances(component: Any, x: Array, noise: Noise) -> Array:
    full = np.asarray(noise(component, x))
    return np.broadcast_to(np.diagonal(full, axis1=-2, axis2=-1), (len(x), full.shape[-1]))


def changed(component: Any, values: Mapping[str, Any]) -> Any:
    try:
        return evolve(component, **values)
    except (TypeError, ValueError):
        return None
