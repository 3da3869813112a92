"""What a user's hand gave a tracker: a time, looked at at once; a state and returns of many runs, once a step has failed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import attrs
import numpy as np

from vedette.errors import ScanRefused
from vedette.fields import ABSURD
from vedette.tracking.state import State
from vedette.types import Detections, Frame, Gaussian
from vedette.units import short
from vedette.values import held


def time_of_start(time: Any) -> float:
    """Return the time of a first state in s, -inf for that of its first scan; ValueError for any other."""
    if _is_number(time) and (time == -np.inf or abs(time) <= ABSURD):
        return float(time)
    raise ValueError(f"time: must be a finite number of s, or -inf for that of the first scan, got {short(time)}")


def time_from(state: State, time: Any) -> float:
    """Return a time in s at which the tracks of a state can be estimated; ValueError for one before it."""
    check_state(state)
    if _is_number(time) and state.time <= time <= ABSURD:
        return float(time)
    raise ValueError(f"time: must be a number of s, not before the state's {state.time:.6f} s, got {short(time)}")


def check_predicted(state: Any, time: Any) -> None:
    """Raise TypeError for what is no state at all, ValueError for what is no time."""
    check_state(state)
    if not _is_number(time):
        raise ValueError(f"time: must be a number of s, got {short(time)}")


def _is_number(value: Any) -> bool:
    return np.ndim(value) == 0 and np.asarray(value).dtype.kind in "iufb"


def check_state(state: Any) -> None:
    """Raise TypeError for what is no state at all."""
    if not isinstance(state, State):
        told = f"as `start` and `step` of a tracker return it, got {type(state).__name__}"
        raise TypeError(f"a state: must be the first argument, {told}")


def check_given(state: State, start: Callable[[], State], observed: Detections | Frame) -> None:
    """Raise ValueError for a state unlike those with which a tracker starts, ScanRefused for returns of other runs."""
    check_state(state)
    try:
        first: Any = start().rows
    except Exception:  # it needs what only a user can give, or that is what failed
        first = None
    for what in () if first is None else ("belief", "memory"):
        its, mine = getattr(state.rows, what), getattr(first, what)
        axes, wanted = set(_axes(its)), set(_axes(mine))
        if unlike := _unlike(its, mine) or (axes and wanted and axes != wanted and (its, mine)):
            told = f"its {what} is of {_said(unlike[0], axes)}, where this one starts with {_said(unlike[1], wanted)}"
            raise ValueError(f"state: is one of another tracker: {told}")
    _check_runs(state, observed)


def _check_runs(state: State, observed: Detections | Frame) -> None:
    """Raise ScanRefused for returns or a frame of other runs than the state's."""
    runs = state.existence.shape[:-1]
    name, given = ("pixels", observed.pixels) if isinstance(observed, Frame) else ("z", observed.z)
    try:
        fits = np.broadcast_shapes(given.shape[:-2], runs) == runs
    except ValueError:
        fits = False
    if not fits:
        last = ("height", "width") if name == "pixels" else ("returns", str(given.shape[-1]))
        wanted = ", ".join([*map(str, runs), *last])
        of = f"{' x '.join(map(str, runs))} runs" if runs else "one run"
        raise ScanRefused(f"{name}: must have shape ({wanted}) as the state is of {of}, got {given.shape}")


def _unlike(one: Any, other: Any) -> tuple[Any, Any] | None:
    """Return the first values of different classes within two attrs values, None if there are none."""
    if one is None or other is None:
        return None
    if type(one) is not type(other):
        return one, other
    parts = zip(held(one), held(other), strict=True) if attrs.has(type(one)) else ()
    return next((pair for its, mine in parts if (pair := _unlike(its, mine))), None)


def _axes(value: Any) -> Iterator[int]:
    """Yield the number of axes of each Gaussian that a belief holds."""
    if isinstance(value, Gaussian):
        yield value.mean.shape[-1]
    else:
        for part in held(value):
            yield from _axes(part)


def _said(value: Any, axes: set[int]) -> str:
    over = f" over {', '.join(map(str, sorted(axes)))} axes" if axes else ""
    return f"{type(value).__name__}{over}"
