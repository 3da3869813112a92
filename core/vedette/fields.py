"""Parameters of components: an attrs field with a unit, limits and a sentence. The class is the only schema.

>>> from attrs import frozen
>>> @frozen
... class Example:
...     sigma_accel: float = quantity("m/s^1.5", "acceleration noise", above=0)
>>> Example(-3)
Traceback (most recent call last):
    ...
ValueError: sigma_accel: must be > 0, got -3 m/s^1.5

A number is a `quantity`, of the unit "1" without one, a `probability` or an `integer`; several are an `array`, a `pair` or a
`table`. A `choice`, a `text` and a `flag` are one value; `words` and `names` many; a `part` is a component.

`field.metadata["read"]` turns a raw value into the parameter or raises ValueError without the name: configs use it.
A default of None makes a parameter optional: it may then be None. The conformance kit draws values within the limits, or,
if most of these make no sense, takes those of `tried`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from operator import ge, gt, le, lt
from typing import Any

import numpy as np
from attrs import NOTHING, Converter, Factory, cmp_using, field

from vedette.space import Array
from vedette.units import in_unit, say

ABSURD = 1e15
"""The largest allowed number: no physical quantity of a tracker is larger, and products of larger ones could overflow."""

_LIMITS: dict[str, tuple[str, Callable[[float, float], bool]]] = {
    "above": (">", gt),
    "at_least": (">=", ge),
    "below": ("<", lt),
    "at_most": ("<=", le),
}


def _field(read: Callable[[Any], Any], default: Any, unit: str, doc: str, eq: Any = None, **more: Any) -> Any:
    """Return an attrs field whose every value is converted by `read`."""

    def read_optional(value: Any) -> Any:
        return None if value is None and default is None else read(value)

    def convert(value: Any, attribute: Any) -> Any:
        try:
            return read_optional(value)
        except ValueError as error:
            raise ValueError(f"{attribute.name}: {error}") from None

    return field(
        default=default,
        converter=Converter(convert, takes_field=True),
        eq=eq,
        metadata={"unit": unit, "doc": doc, "read": read_optional, **more},
    )


def _within(value: float, unit: str, limits: Mapping[str, float]) -> None:
    if not all(_LIMITS[name][1](value, bound) for name, bound in limits.items()):
        text = " and ".join(f"{_LIMITS[name][0]} {say(bound)}" for name, bound in limits.items())
        raise ValueError(f"must be {text}, got {say(value, unit)}")


def quantity(
    unit: str,
    doc: str,
    *,
    default: Any = NOTHING,
    above: float | None = None,
    at_least: float | None = None,
    below: float | None = None,
    at_most: float | None = None,
    tried: Sequence[float | None] = (),
) -> Any:
    """Declare a number in `unit` within bounds; a config may write it with a unit of the same kind: "1.5 deg"."""
    bounds = {"above": above, "at_least": at_least, "below": below, "at_most": at_most}
    limits = {name: bound for name, bound in bounds.items() if bound is not None}

    def read(value: Any) -> float:
        number = in_unit(value, unit, ABSURD)
        _within(number, unit, limits)
        return number

    return _field(read, default, unit, doc, limits=limits, tried=tried)


def probability(doc: str, *, default: Any = NOTHING, tried: Sequence[float] = (), **limits: float) -> Any:
    """Declare a number in [0, 1], or in the narrower `limits` of `quantity`."""
    wide = {} if "above" in limits else {"at_least": 0.0}
    wide |= {} if "below" in limits else {"at_most": 1.0}
    return quantity("1", doc, default=default, tried=tried, **(wide | limits))


def integer(doc: str, *, default: Any = NOTHING, at_least: int = 0, at_most: int = 10**9) -> Any:
    """Declare a whole number within bounds."""
    limits = {"at_least": at_least, "at_most": at_most}

    def read(value: Any) -> int:
        number = in_unit(value, "1", ABSURD)
        if number != int(number):
            raise ValueError(f"must be a whole number, got {say(number)}")
        _within(number, "1", limits)
        return int(number)

    return _field(read, default, "1", doc, limits=limits)


def _stated(fits: Callable[[Any], bool], what: str, make: Callable[[Any], Any], default: Any, doc: str, **more: Any) -> Any:
    """Return an attrs field without unit whose values must be `what`, as `fits` tells."""

    def read(value: Any) -> Any:
        if not fits(value):
            raise ValueError(f"must be {what}, got {value!r}")
        return make(value)

    return _field(read, default, "", doc, **more)


def _are_strings(values: Any) -> bool:
    return all(isinstance(item, str) for item in values)


def choice(doc: str, options: Sequence[str], *, default: Any = NOTHING) -> Any:
    """Declare a string that is one of `options`."""
    allowed = tuple(options)
    return _stated(allowed.__contains__, f"one of {', '.join(map(repr, allowed))}", str, default, doc, options=allowed)


def text(doc: str, *, default: Any = NOTHING) -> Any:
    """Declare a string: a path, a column's name."""
    return _stated(lambda value: isinstance(value, str), "a string", str, default, doc)


def words(doc: str, *, default: Any = NOTHING) -> Any:
    """Declare a list of strings."""

    def fits(value: Any) -> bool:
        return isinstance(value, Sequence) and not isinstance(value, str) and _are_strings(value)

    return _stated(fits, "a list of strings", tuple, default, doc)


def names(doc: str) -> Any:
    """Declare a table of names to strings, empty by default."""

    def fits(value: Any) -> bool:
        return isinstance(value, Mapping) and _are_strings(value.values())

    def make(value: Mapping[Any, str]) -> dict[str, str]:
        return {str(key): item for key, item in value.items()}

    return _stated(fits, "a table of names to strings", make, Factory(dict), doc)


def flag(doc: str, *, default: Any = NOTHING) -> Any:
    """Declare a value that is true or false."""
    return _stated(lambda value: isinstance(value, bool), "true or false", bool, default, doc)


def array(
    unit: str, doc: str, *, ndim: int, default: Any = NOTHING, check: Callable[[Array], str | None] | None = None
) -> Any:
    """Declare numbers in `unit` with `ndim` axes, read-only; `check` returns what is wrong with them, or None."""
    numbers_of = "numbers" if unit == "1" else f"numbers in {unit}"
    wanted = f"a list of {numbers_of}" if ndim == 1 else f"{numbers_of} with {ndim} axes and rows of one length"

    def read(value: Any) -> Array:
        try:
            if not _numeric(value):
                raise TypeError
            numbers = np.array(value, dtype=float)
        except (TypeError, ValueError, OverflowError):
            raise ValueError(f"must be {wanted}, got {value!r}") from None
        if not numbers.size and not np.size(default) and isinstance(default, np.ndarray):
            numbers = default.copy()  # a list does not say that there are no rows of no numbers
        if numbers.ndim != ndim and ndim == 1:
            raise ValueError(f"must be {wanted}, got {value!r}")
        if numbers.ndim != ndim:
            raise ValueError(f"must have {ndim} axes, got {numbers.ndim}: {value!r}")
        if not np.all(np.abs(numbers) <= ABSURD):  # also False for NaN
            raise ValueError(f"must be finite numbers of at most {ABSURD:g}, got {value!r}")
        if check is not None and (problem := check(numbers)):
            raise ValueError(problem)
        numbers.flags.writeable = False
        return numbers

    return _field(read, default, unit, doc, eq=cmp_using(eq=np.array_equal), ndim=ndim)


def pair(unit: str, doc: str, *, of: str = "x, y", default: Any = NOTHING) -> Any:
    """Declare two numbers in `unit`; `of` names them."""

    def problem(values: Array) -> str | None:
        return None if len(values) == 2 else f"must be [{of}], got {len(values)} numbers"

    return array(unit, doc, ndim=1, default=default, check=problem)


def _numeric(value: Any) -> bool:
    """Tell whether nested lists hold neither booleans nor strings, which numpy would convert to numbers."""
    if isinstance(value, list | tuple):
        return all(map(_numeric, value))
    return np.asarray(value).dtype.kind in "iufO"  # O: an integer too large for numpy, judged next


def table(
    doc: str, *, unit: str = "1", pairs: bool = False, at_least: float | None = None, tried: Sequence[Any] = ()
) -> Any:
    """Declare names to numbers in `unit`, empty by default; with `pairs`, names to [mean, standard deviation >= 0]."""

    def one(key: str, item: Any) -> Any:
        if not pairs:
            number = in_unit(item, unit, ABSURD, key)
            if at_least is not None and number < at_least:
                raise ValueError(f"{key}: must be >= {say(at_least)}, got {say(number, unit)}")
            return number
        if isinstance(item, str) or not isinstance(item, Sequence) or len(item) != 2:
            raise ValueError(f"{key}: must be [mean, standard deviation], got {item!r}")
        mean, deviation = (in_unit(number, "1", ABSURD, key) for number in item)
        if deviation < 0:
            raise ValueError(f"{key}: the standard deviation must be >= 0, got {say(deviation)}")
        return mean, deviation

    def read(value: Any) -> dict[str, Any]:
        if not isinstance(value, Mapping):
            raise ValueError(f"must be a table of names, got {value!r}")
        return {str(key): one(str(key), item) for key, item in value.items()}

    return _field(read, Factory(dict), unit, doc, pairs=pairs, tried=tried)


def part(doc: str, *, default: Any = NOTHING, tried: Sequence[Any] = ()) -> Any:
    """Declare another component, a tuple or a table of them, of the annotation's role; or a plain attrs class."""
    return field(default=default, metadata={"unit": "", "doc": doc, "tried": tried})
