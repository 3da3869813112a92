"""Hypothesis strategies for components, inferred from their fields: type, unit, limits, options, default.

A parameter that is a component is drawn from a small catalogue of its role. A value that the class refuses in
combination with others (a minimum above its maximum) is drawn again.
"""

from __future__ import annotations

import re
from collections.abc import Container, Mapping
from functools import cache
from inspect import isabstract
from typing import Any

import numpy as np
from attrs import NOTHING
from hypothesis import reject
from hypothesis import strategies as st

from vedette.config.parameters import Leaf, Many, Maybe, Names, Parameter, Part, Shape, Table, holds_parts, parameters
from vedette.config.registry import Registry
from vedette.config.suggestions import did_you_mean
from vedette.roles import Component
from vedette.testing.comparisons import Misuse

Given = Mapping[str, st.SearchStrategy[Any]]

PARAMETER_SIZES = {
    "m": (1.0, 100.0),
    "s": (0.5, 60.0),
    "m/s": (0.1, 30.0),
    "m/s^2": (0.01, 5.0),
    "m/s^3": (0.01, 5.0),
    "m/s^1.5": (0.01, 5.0),
    "m/s^2.5": (0.01, 5.0),
    "rad": (1e-3, 0.05),
    "rad/s": (1e-3, 0.2),
    "rad/s^2": (1e-4, 0.02),
    "rad/s^1.5": (1e-4, 0.02),
    "1/m^2": (1e-9, 1e-5),
}
"""Usual range of a positive parameter in a unit."""

CATALOGUE = {
    "motion": ("constant_velocity", "coordinated_turn"),
    "sensor": ("cartesian_position", "range_bearing"),
    "estimator": ("kalman", "ekf"),
    "associator": ("pda", "gnn"),
    "birth": ("given",),
    "lifecycle": ("single_target",),
    "source": ("simulation",),
}
"""What is used where a component holds others and no strategy was given for them."""

SENSOR = "radar"
"""Name of the one entry in an inferred table of names."""

DIRECTION = {"heading", "course", "bearing", "azimuth", "direction", "orientation", "rotation", "yaw", "from", "to"}
"""Words in the name of a parameter in rad that is no deviation nor a width, but may be any angle of the circle."""
TURN = {"above": -np.pi, "below": np.pi}

_AXES = ("x", "y", "vx", "vy")
_MATRICES: dict[int, tuple[Any, ...]] = {
    1: ([0.5, 0.5], [0.2, 0.8], [0.0, 1.0]),
    2: ([[0.9, 0.1], [0.2, 0.8]], [[0.5, 0.5], [0.5, 0.5]], [[-0.1, 0.1], [0.3, -0.3]], [[2.0, 0.5], [0.5, 1.0]]),
}


@cache
def usual(role: str, kind: str) -> Any:
    """Return the class of a built-in component with which the laws try others."""
    return Registry.installed().get(role, kind).cls


def components(cls: type, given: Given | None = None, registry: Registry | None = None) -> st.SearchStrategy[Any]:
    """Return components of a class, with the strategies `given` for some parameters and inferred ones for the rest.

    Misuse if a strategy is for no parameter, is not a strategy, or cannot be inferred.
    """
    given = given or {}
    known = {parameter.name: parameter for parameter in parameters(cls)}
    for name, strategy in given.items():
        if name not in known:
            names = ", ".join(known) or "none"
            raise Misuse(f"{name}: {cls.__name__} has no such parameter;{did_you_mean(name, known)} it has {names}")
        if not isinstance(strategy, st.SearchStrategy):
            raise Misuse(f"{name}: must be a Hypothesis strategy, got {strategy!r}: write st.just(...) for a fixed value")
    registry = Registry.installed() if registry is None else registry
    parts = {name: given[name] if name in given else _parameter(known[name], cls, registry) for name in known}
    return _built(cls, parts, {name for name, parameter in known.items() if not parameter.required})


@st.composite
def _built(draw: st.DrawFn, cls: type, parts: Given, optional: Container[str]) -> Any:
    values = {name: draw(strategy) for name, strategy in parts.items()}
    while True:
        try:
            return cls(**values)
        except ValueError as refusal:  # of two parameters that exclude one another, the one that is named has its default
            name = re.split(r"[.:\[]", str(refusal), maxsplit=1)[0]
            if name not in values or name not in optional:
                return reject()
            del values[name]


def _parameter(parameter: Parameter, cls: type, registry: Registry) -> st.SearchStrategy[Any]:
    place = f"{cls.__name__}.{parameter.name}"
    if tried := parameter.field.metadata.get("tried"):
        return st.sampled_from(tried)
    try:
        found = _of(parameter.shape, parameter, place, registry)
    except Misuse:
        if parameter.default is NOTHING:
            raise
        return st.just(parameter.default)
    usual = parameter.default is NOTHING or "pairs" in parameter.field.metadata
    return found if usual else st.one_of(st.just(parameter.default), found)


def _of(shape: Shape, parameter: Parameter, place: str, registry: Registry) -> st.SearchStrategy[Any]:
    if not holds_parts(shape):
        return _leaf(shape, parameter, place)
    match shape:
        case Maybe(item):
            return _of(item, parameter, place, registry)
        case Part(role, base):
            return catalogue(role, place, base, registry)
        case Table(cls):
            return components(cls, registry=registry)
        case Many(item):
            one = _of(item, parameter, place, registry)
            return st.tuples(one, one)
        case Names(item):
            return st.fixed_dictionaries({SENSOR: _of(item, parameter, place, registry)})
        case Leaf():
            raise AssertionError("a leaf holds no parts")


def catalogue(
    role: str, place: str = "", base: type = Component, registry: Registry | None = None
) -> st.SearchStrategy[Any]:
    """Return components of a role from the small catalogue; Misuse at `place` if none is installed."""
    registry = Registry.installed() if registry is None else registry
    entries = [entry for kind in CATALOGUE.get(role, ()) if (entry := registry.find(role, kind)) is not None]
    fitting = [components(entry.cls, registry=registry) for entry in entries if issubclass(entry.cls, base)]
    if not fitting and base is not Component:  # a field that names one class, or the base of a few
        named = [entry.cls for entry in registry if entry.role == role and issubclass(entry.cls, base)]
        fitting = [components(cls, registry=registry) for cls in named or ([] if isabstract(base) else [base])]
    if not fitting:
        raise Misuse(f"{place}: no {role} of the kit's catalogue fits; pass a strategy for it")
    return st.one_of(fitting)


def _leaf(shape: Shape, parameter: Parameter, place: str) -> st.SearchStrategy[Any]:
    metadata = parameter.field.metadata
    inner = shape.item if isinstance(shape, Maybe) else shape
    hint = inner.hint if isinstance(inner, Leaf) else None
    if "options" in metadata:
        return st.sampled_from(metadata["options"])
    if "pairs" in metadata:
        return _tables(metadata["pairs"])
    if "ndim" in metadata:
        fitting = [matrix for matrix in _MATRICES.get(metadata["ndim"], ()) if _accepts(parameter, matrix)]
        if fitting:
            return st.sampled_from(fitting).map(np.array)
    elif hint is bool:
        return st.booleans()
    elif "limits" in metadata and hint is int:
        low, high = int(metadata["limits"].get("at_least", 0)), int(metadata["limits"].get("at_most", 10**9))
        return st.integers(low, min(high, low + 20))
    elif "limits" in metadata:
        if parameter.unit == "rad" and DIRECTION & set(parameter.name.split("_")) and "sigma" not in parameter.name:
            return st.one_of(numbers("", {**metadata["limits"], **TURN}), st.sampled_from([0.0, 3.0, -3.0, np.pi / 2]))
        return numbers(parameter.unit, metadata["limits"])
    raise Misuse(f"{place}: no strategy can be inferred for it; pass one: {parameter.name}=st.just(...)")


def _accepts(parameter: Parameter, value: Any) -> bool:
    try:
        parameter.field.metadata["read"](value)
    except ValueError:
        return False
    return True


def _tables(pairs: bool) -> st.SearchStrategy[dict[str, Any]]:
    """Return an empty table, or one with an entry for every axis of a planar state."""
    deviation = st.floats(0.1, 10.0)
    entry = st.tuples(st.floats(-100.0, 100.0), deviation) if pairs else deviation
    return st.one_of(st.fixed_dictionaries(dict.fromkeys(_AXES, entry)), st.just({}))


def numbers(unit: str, limits: Mapping[str, float]) -> st.SearchStrategy[float]:
    """Return numbers of usual size for a parameter in `unit` within its limits; allowed end points are drawn too."""
    least, most = PARAMETER_SIZES.get(unit, (0.1, 10.0))
    low = max((limits[name] for name in ("above", "at_least") if name in limits), default=-most)
    high = min((limits[name] for name in ("below", "at_most") if name in limits), default=most)
    ends = [limits[name] for name in ("at_least", "at_most") if name in limits]
    if low < least < high and low >= 0:
        low = least
    if not low < high:  # the limits lie outside the usual range
        high = low + most if low >= most else high
        low = low if low < high else high - most
    if max(abs(low), abs(high)) > 100 * most and high > most:
        high = low + most
    inset = 0.01 * (high - low)
    inside = st.floats(low + inset, high - inset)
    return st.one_of(inside, st.sampled_from(ends)) if ends else inside
