"""Parameters of components: an attrs field with a unit, a range and a sentence. The class is the only schema.

>>> from attrs import frozen
>>> @frozen
... class Example:
...     sigma_accel: float = quantity("m/s^2", "acceleration noise", above=0)
>>> Example(-3)
Traceback (most recent call last):
    ...
ValueError: sigma_accel: must be > 0, got -3 m/s^2
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from attrs import NOTHING, Attribute, cmp_using, field

from vedette.space import Array
from vedette.units import in_unit, say

ABSURD = 1e15
"""No physical quantity of a tracker is larger: beyond it squares of squares overflow."""


def _bounds(unit: str, **limits: float | None) -> tuple[Callable[[float], str | None], dict[str, Any]]:
    tests: dict[str, tuple[str, Callable[[float, float], bool]]] = {
        "above": ("> {}", lambda v, b: v > b),
        "at_least": (">= {}", lambda v, b: v >= b),
        "below": ("< {}", lambda v, b: v < b),
        "at_most": ("<= {}", lambda v, b: v <= b),
    }
    active = [
        (tests[name][0].format(say(bound)), tests[name][1], bound) for name, bound in limits.items() if bound is not None
    ]

    def complain(value: float) -> str | None:
        if not all(test(value, bound) for _, test, bound in active):
            return f"must be {' and '.join(text for text, _, _ in active)}, got {say(value, unit)}"
        return None

    return complain, {name: bound for name, bound in limits.items() if bound is not None}


def quantity(
    unit: str,
    doc: str,
    *,
    default: Any = NOTHING,
    above: float | None = None,
    at_least: float | None = None,
    below: float | None = None,
    at_most: float | None = None,
) -> Any:
    """A number in `unit` within bounds; a config may write it with a unit of the same kind: "1.5 deg"."""
    complain, limits = _bounds(unit, above=above, at_least=at_least, below=below, at_most=at_most)

    def convert(value: Any) -> float:
        return in_unit(value, unit, ABSURD)

    def validate(_: object, attribute: Attribute[Any], value: float) -> None:
        if problem := complain(value):
            raise ValueError(f"{attribute.name}: {problem}")

    return field(
        default=default, converter=convert, validator=validate, metadata={"unit": unit, "doc": doc, "limits": limits}
    )


def probability(doc: str, *, default: Any = NOTHING, **limits: float) -> Any:
    """A number in [0, 1], or in the narrower `limits` of `quantity`."""
    return quantity("1", doc, default=default, **({"at_least": 0.0, "at_most": 1.0} | limits))


def integer(doc: str, *, default: Any = NOTHING, at_least: int = 0, at_most: int = 10**9) -> Any:
    """A whole number within bounds."""

    def convert(value: Any) -> int:
        number = in_unit(value, "1", ABSURD)
        if number != int(number):
            raise ValueError(f"must be a whole number, got {say(number)}")
        return int(number)

    complain, limits = _bounds("1", at_least=at_least, at_most=at_most)

    def validate(_: object, attribute: Attribute[Any], value: int) -> None:
        if problem := complain(value):
            raise ValueError(f"{attribute.name}: {problem}")

    return field(
        default=default, converter=convert, validator=validate, metadata={"unit": "1", "doc": doc, "limits": limits}
    )


def choice(doc: str, options: Sequence[str], *, default: Any = NOTHING) -> Any:
    """One of a few words."""

    def validate(_: object, attribute: Attribute[Any], value: object) -> None:
        if value not in options:
            raise ValueError(f"{attribute.name}: must be one of {', '.join(map(repr, options))}, got {value!r}")

    return field(default=default, validator=validate, metadata={"unit": "", "doc": doc, "options": tuple(options)})


def text(doc: str, *, default: Any = NOTHING) -> Any:
    """A string: a path, a column's name."""

    def validate(_: object, attribute: Attribute[Any], value: object) -> None:
        if value is not None and not isinstance(value, str):
            raise ValueError(f"{attribute.name}: must be a string, got {value!r}")

    return field(default=default, validator=validate, metadata={"unit": "", "doc": doc})


def flag(doc: str, *, default: Any = NOTHING) -> Any:
    """True or false."""

    def validate(_: object, attribute: Attribute[Any], value: object) -> None:
        if not isinstance(value, bool):
            raise ValueError(f"{attribute.name}: must be true or false, got {value!r}")

    return field(default=default, validator=validate, metadata={"unit": "", "doc": doc})


def array(
    unit: str,
    doc: str,
    *,
    ndim: int,
    default: Any = NOTHING,
    check: Callable[[Array], str | None] | None = None,
) -> Any:
    """Numbers in `unit` with `ndim` axes, read-only; `check` returns what is wrong with them, or None."""

    def convert(value: Any) -> Array:
        try:
            numbers = np.array(value, dtype=float)
        except (TypeError, ValueError):
            raise ValueError(f"must be numbers with {ndim} axes and rows of one length, got {value!r}") from None
        if numbers.ndim != ndim:
            raise ValueError(f"must have {ndim} axes, got {numbers.ndim}: {value!r}")
        if not np.all(np.abs(numbers) <= ABSURD):  # also False for NaN
            raise ValueError(f"must be finite numbers, got {value!r}")
        numbers.flags.writeable = False
        return numbers

    def validate(_: object, attribute: Attribute[Any], value: Array) -> None:
        if check is not None and (problem := check(value)):
            raise ValueError(f"{attribute.name}: {problem}")

    return field(
        default=default,
        converter=convert,
        validator=validate,
        eq=cmp_using(eq=np.array_equal),
        metadata={"unit": unit, "doc": doc},
    )


def part(doc: str, *, default: Any = NOTHING, factory: Callable[[], Any] | None = None) -> Any:
    """Another component, a tuple or a table of them: the annotation says which role."""
    metadata = {"unit": "", "doc": doc}
    if factory is not None:
        return field(factory=factory, metadata=metadata)
    return field(default=default, metadata=metadata)


def table(doc: str, *, unit: str = "1", default: Any = NOTHING, pairs: bool = False) -> Any:
    """Names to numbers in `unit`; with `pairs`, names to [mean, standard deviation >= 0]."""

    def convert(value: Any) -> dict[str, Any]:
        if not isinstance(value, Mapping):
            raise ValueError(f"must be a table of names, got {value!r}")
        read = _pair if pairs else (lambda key, item: in_unit(item, unit, ABSURD, key))
        return {str(key): read(str(key), item) for key, item in value.items()}

    return field(default=default, converter=convert, metadata={"unit": unit, "doc": doc, "pairs": pairs})


def _pair(key: str, item: Any) -> tuple[float, float]:
    if not isinstance(item, Sequence) or isinstance(item, str) or len(item) != 2:
        raise ValueError(f"{key}: must be [mean, standard deviation], got {item!r}")
    mean, deviation = (in_unit(number, "1", ABSURD, key) for number in item)
    if deviation < 0:
        raise ValueError(f"{key}: the standard deviation must be >= 0, got {say(deviation)}")
    return mean, deviation
