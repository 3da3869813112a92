"""Free parameters: which number, in which range, on which scale it is searched."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from attrs import frozen

from vedette import Array, ConfigError, Experiment, Problem
from vedette.units import in_unit, say, spellings
from vedette_tools.tuning.config_paths import Place, changed, find, whole

NEAREST = 1e-6
"""Probabilities are searched no nearer to 0 and 1 than this."""
FACTOR = 10.0
"""Without a range, a number is searched from so many times less to so many times more; a probability by its odds."""


@frozen
class Free:
    """A parameter to be tuned, from `low` to `high`; `start`: the config's own value, within them.

    `scale` is that on which it is searched: "log", "logit" or "linear". `kept` says what else changes with a number of a
    matrix: "mirror", the number across the diagonal; "row", the diagonal of its row, whose sum stays; "": nothing.
    """

    path: str
    place: Place
    low: float
    high: float
    scale: str
    kept: str = ""

    @property
    def start(self) -> float:
        """The config's value, or if it has none the middle of the range."""
        if self.place.value is None:
            return float(self.value(np.asarray(0.5)))
        return min(max(self.place.value, self.low), self.high)

    def position(self, value: Array | float) -> Array:
        """Return where values are in the range, on the scale: 0 at its lower end and 1 at its upper one."""
        low, high = self._bent(self.low), self._bent(self.high)
        return (self._bent(value) - low) / (high - low)

    def value(self, position: Array) -> Array:
        """Return the values at positions in the range."""
        low, high = self._bent(self.low), self._bent(self.high)
        bent = low + np.asarray(position) * (high - low)
        if self.scale == "linear":
            return bent
        return np.exp(bent) if self.scale == "log" else 1.0 / (1.0 + np.exp(-bent))

    def slope(self, position: float) -> float:
        """Return by how much the value grows with its position."""
        value, width = float(self.value(np.asarray(position))), float(self._bent(self.high) - self._bent(self.low))
        return width * {"linear": 1.0, "log": value, "logit": value * (1.0 - value)}[self.scale]

    def _bent(self, value: Array | float) -> Array:
        if self.scale == "linear":
            return np.asarray(value, dtype=float)
        if self.scale == "log":
            return np.log(value)
        p = np.clip(value, NEAREST, 1.0 - NEAREST)
        return np.log(p / (1.0 - p))

    def told(self, value: float) -> str:
        """Return a value with its unit, to four digits."""
        return say(float(f"{value:.4g}"), self.place.unit)


def read_free(experiment: Experiment, written: Sequence[str]) -> tuple[Free, ...]:
    """Return the parameters that `path=low..high` or `path` name; ConfigError with all that is wrong."""
    free, problems = list[Free](), list[Problem]()
    for one in written:
        path, _, bounds = one.partition("=")
        try:
            place = find(experiment, path.strip())
            if any(place.path == each.place.path for each in free):
                raise ValueError("is given twice")
            free.append(_free(experiment, path.strip(), place, bounds.strip()))
        except ValueError as error:
            problems.append(Problem(f"--free {path.strip()}", str(error)))
    if not problems:
        problems = [Problem(f"--free {each.path}", text) for each in free if (text := _refused(experiment, each))]
    if problems:
        raise ConfigError(problems)
    if not free:
        raise ConfigError.at("--free", "names nothing to be tuned: give it as --free path.to.key=low..high")
    return tuple(free)


def applied(experiment: Experiment, free: Sequence[Free], values: Sequence[float]) -> Experiment:
    """Return the experiment with the values of the free parameters; ValueError if a part refuses them."""
    for path, value in changes(experiment, free, values).items():
        experiment = changed(experiment, path, value)
    return experiment


def changes(experiment: Experiment, free: Sequence[Free], values: Sequence[float]) -> dict[tuple[str | int, ...], Any]:
    """Return path to value; of a matrix with free numbers, the path and all of its numbers."""
    changed_values: dict[tuple[str | int, ...], Any] = {}
    for each, value in zip(free, values, strict=True):
        inside = each.place.inside
        path = each.place.path[: len(each.place.path) - len(inside)]
        if not inside:
            changed_values[path] = float(value)
            continue
        array = changed_values[path] = np.array(changed_values.get(path, whole(experiment, each.place)))
        grown = value - array[inside]
        array[inside] = value
        if each.kept == "mirror":
            array[inside[::-1]] = value
        elif each.kept == "row":
            array[inside[0], inside[0]] = round(array[inside[0], inside[0]] - grown, 15)
    return {path: value.tolist() if isinstance(value, np.ndarray) else value for path, value in changed_values.items()}


def _free(experiment: Experiment, path: str, place: Place, bounds: str) -> Free:
    probable = place.unit == "1" and "at_most" in place.limits and place.limits["at_most"] <= 1
    kept = _kept(experiment, path, place) if place.inside else ""
    low, high = _range(bounds, place, probable or kept == "row")
    positive = any(place.limits.get(name, -1.0) >= 0 for name in ("above", "at_least"))
    if (probable and positive) or (
        kept == "row" and place.value is not None and high < 1 and _sums_to_one(experiment, place)
    ):
        scale = "logit"
    elif positive or low > 0:
        scale = "log"
    else:
        scale = "linear"
    if not low < high:
        raise ValueError(f"the range must go up, got {say(low, place.unit)} to {say(high, place.unit)}")
    if scale == "log" and low <= 0:
        raise ValueError(f"the range must begin above 0, as it is searched by its logarithm, got {say(low, place.unit)}")
    return Free(path, place, low, high, scale, kept)


def _range(bounds: str, place: Place, probable: bool) -> tuple[float, float]:
    if not bounds:
        value = place.value
        if value is None or value <= 0 or (probable and value >= 1):
            now = "nothing" if value is None else say(value, place.unit)
            raise ValueError(f"is {now}: state the range, as in =low..high")
        if probable:
            odds = value / (1.0 - value)
            return odds / (FACTOR + odds), FACTOR * odds / (1.0 + FACTOR * odds)
        return value / FACTOR, value * FACTOR
    first, dots, last = (part.strip() for part in bounds.partition(".."))
    if not dots or not first or not last:
        like = "0.01..1" if place.unit == "1" else f"0.01..1 {spellings(place.unit)[0]}"
        raise ValueError(f"the range must be written low..high, as in {like!r}, got {bounds!r}")
    unit = last.lstrip("+-.0123456789eE").strip()
    if unit and not first.lstrip("+-.0123456789eE").strip():
        first = f"{first} {unit}"
    return in_unit(first, place.unit), in_unit(last, place.unit)


def _kept(experiment: Experiment, path: str, place: Place) -> str:
    """Return what must change with a number of an array, as its component takes no other; ValueError if nothing helps."""
    assert place.value is not None
    ways = [""] if len(place.inside) < 2 or place.inside[0] == place.inside[1] else ["", "mirror", "row"]
    moved, reason = place.value * 0.9 if place.value else 1e-3, ""
    for way in ways:
        try:
            applied(experiment, [Free(path, place, 0.0, 1.0, "linear", way)], [moved])
        except ValueError as error:
            reason = reason or str(error)
        else:
            return way
    other = ": free the others of its row" if len(place.inside) == 2 and place.inside[0] == place.inside[1] else ""
    raise ValueError(f"cannot change alone{other} ({reason})")


def _sums_to_one(experiment: Experiment, place: Place) -> bool:
    return abs(float(np.sum(whole(experiment, place)[place.inside[0]])) - 1.0) < 1e-6


def _refused(experiment: Experiment, free: Free) -> str:
    """Return why an end of the range is refused, or ""."""
    for value in (free.low, free.high):
        try:
            applied(experiment, [free], [value])
        except ValueError as error:
            return str(error)
    return ""
