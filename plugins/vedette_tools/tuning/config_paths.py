"""Numbers within an experiment by their config paths: found, told what is wrong with a path, and changed."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping
from functools import cache
from typing import Any, cast

import attrs
import numpy as np
from attrs import field, frozen

from vedette import Component, Experiment, Tracker
from vedette.config import KeyPath, Parameter, below, did_you_mean, parameters, path_of

TUNED = ("estimator", "sensors", "associator", "birth", "lifecycle", "gate")
"""The parts of a config that hold what can be tuned."""
NAMED = 6
"""Of a component that is no number, so many of its numbers are named."""


@frozen
class Place:
    """A number of an experiment: its value, None if it has none yet, its unit and its declared limits.

    `inside` is an index into the matrix or list that holds it: () where it is a parameter by itself.
    """

    path: KeyPath
    value: float | None
    unit: str
    limits: Mapping[str, float] = field(factory=dict)
    inside: tuple[int, ...] = ()


def find(experiment: Experiment, written: str) -> Place:
    """Return the number at a config path; ValueError says why there is none."""
    path = path_of(written)
    if not path:
        raise ValueError("must be a path.to.key, with [0] for the first of a list")
    if path[0] not in TUNED:
        known = did_you_mean(str(path[0]), TUNED)
        raise ValueError(f"is not in what can be tuned;{known} that is {', '.join(TUNED)}")
    for depth, (value, parameter, here) in enumerate(_way(experiment, path), 1):
        if depth < len(path) and (isinstance(value, np.ndarray) or (parameter is not None and _is_pair(value))):
            return _in_array(np.asarray(value), parameter, path, depth, here)
    return _number(value, parameter, path, here)


def at(experiment: Experiment, written: str) -> Any:
    """Return what is at a config path of an experiment's tracker; ValueError says why there is nothing."""
    path = path_of(written)
    if not path or path[0] not in TUNED:
        raise ValueError(f"must begin with one of {', '.join(TUNED)}")
    *_, (value, _, _) = _way(experiment, path)
    return value


def _way(experiment: Experiment, path: KeyPath) -> Iterator[tuple[Any, Parameter | None, str]]:
    """Yield what is along a path, the parameter that declares it, and where that is; ValueError where nothing is."""
    value, parameter, here = getattr(experiment.tracker, str(path[0])), None, str(path[0])
    yield value, parameter, here
    for step in path[1:]:
        value, parameter = _below(value, parameter, step, here)
        here = below(here, step)
        yield value, parameter, here


def changed(experiment: Experiment, path: KeyPath, value: Any) -> Experiment:
    """Return the experiment with another value at a path that was found in it; ValueError if a part refuses it."""
    return attrs.evolve(experiment, tracker=_changed(experiment.tracker, path, value))


def whole(experiment: Experiment, place: Place) -> Any:
    """Return a copy of the array that holds the number at a place."""
    value: Any = experiment.tracker
    for step in place.path[: len(place.path) - len(place.inside)]:
        value = _stepped(value, step)
    return np.array(value, dtype=float)


def _own(value: Any) -> dict[str, Parameter]:
    """Return the parameters of a component or table by their names."""
    return _of_class(cast(Hashable, type(value)))


@cache
def _of_class(cls: Hashable) -> dict[str, Parameter]:
    return {each.name: each for each in parameters(cast(type, cls))}


def _stepped(value: Any, step: str | int) -> Any:
    if isinstance(value, Mapping) or isinstance(step, int):
        return value[step]
    return getattr(value, _own(value)[str(step)].field.name)


def _changed(value: Any, path: KeyPath, new: Any) -> Any:
    if not path:
        return new
    step, rest = path[0], path[1:]
    after = _changed(_stepped(value, step), rest, new)
    if isinstance(value, Mapping):
        return {**value, step: after}
    if isinstance(value, tuple | list):
        return tuple(after if i == step else each for i, each in enumerate(value))
    return attrs.evolve(value, **{str(step): after})


def _is_pair(value: Any) -> bool:
    return isinstance(value, tuple | list) and len(value) > 0 and all(isinstance(each, int | float) for each in value)


def _what(value: Any) -> str:
    if isinstance(value, Component):
        return f"the component {value.kind!r}"
    if isinstance(value, bool):
        return "true or false"
    if isinstance(value, str):
        return f"the word {value!r}"
    return "nothing" if value is None else "a list" if isinstance(value, tuple | list) else "a table"


def _below(value: Any, parameter: Parameter | None, step: str | int, here: str) -> tuple[Any, Parameter | None]:
    """Return what is one step below a value, and the parameter that declares it; ValueError if nothing is."""
    if isinstance(step, int):
        if not isinstance(value, tuple | list):
            raise ValueError(f"{here} is {_what(value)}, not a list: there is no [{step}] in it")
        if step >= len(value):
            raise ValueError(f"{here} has [0] to [{len(value) - 1}], there is no [{step}] in it")
        return value[step], parameter
    if isinstance(value, Mapping):
        if step not in value:
            raise ValueError(f"there is no {below(here, step)};{_or(step, value)}")
        return value[step], parameter
    if not attrs.has(type(value)):
        raise ValueError(f"{here} is {_what(value)}, so there is no {step!r} in it")
    parameters_of = _own(value)
    if step not in parameters_of:
        raise ValueError(f"there is no {below(here, step)};{_or(step, parameters_of)}")
    return getattr(value, parameters_of[step].field.name), parameters_of[step]


def _or(step: str, known: Mapping[Any, Any]) -> str:
    names = [str(name) for name in known]
    return f"{did_you_mean(step, names)} there {'is' if len(names) == 1 else 'are'} {', '.join(names) or 'nothing'}"


def _in_array(array: Any, parameter: Parameter | None, path: KeyPath, depth: int, here: str) -> Place:
    index = path[depth:]
    shape = " x ".join(map(str, array.shape))
    if len(index) != array.ndim or not all(isinstance(each, int) for each in index):
        one = f"{here}{'[0]' * array.ndim}"
        raise ValueError(f"{here} holds {shape} numbers: name one, as {one}")
    inside = tuple(int(each) for each in index)
    if any(i >= size for i, size in zip(inside, array.shape, strict=True)):
        raise ValueError(f"{here} holds {shape} numbers, counted from 0: there is no {list(inside)} in it")
    unit = "1" if parameter is None else parameter.unit
    return Place(path, float(array[inside]), unit, {}, inside)


def _number(value: Any, parameter: Parameter | None, path: KeyPath, here: str) -> Place:
    if isinstance(value, np.ndarray) or _is_pair(value):
        return _in_array(np.asarray(value), parameter, path, len(path), here)
    metadata: Mapping[str, Any] = {} if parameter is None else parameter.field.metadata
    optional = parameter is not None and "limits" in metadata and value is None
    if not optional and (isinstance(value, bool) or not isinstance(value, int | float)):
        inner = _numbers_in(value)
        names = f": free a number in it, such as {', '.join(below(here, name) for name in inner)}" if inner else ""
        raise ValueError(f"is {_what(value)}, not a number{names}")
    if isinstance(value, int):
        raise ValueError("is a whole number, which has no likelihood's slope: compare its values with `vedette study`")
    assert parameter is not None
    return Place(path, value, parameter.unit, metadata.get("limits", {}))


def _numbers_in(value: Any) -> list[str]:
    """Return the names of the numbers within a component or table."""
    if isinstance(value, Mapping):
        return [str(name) for name, each in value.items() if isinstance(each, float)]
    if not attrs.has(type(value)) or isinstance(value, Tracker):
        return []
    return [each.name for each in _own(value).values() if isinstance(getattr(value, each.field.name), float)][:NAMED]
