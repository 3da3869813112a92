"""What is compiled of this plugin, where it was built: the twins of sensors and motions, the work of lifecycles, and
joint association of pairs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from types import ModuleType
from typing import Any, TypeVar

import numpy as np

from vedette import Array, MotionModel, Pose, Twin, filters, kernels

F = TypeVar("F", bound=Callable[..., Any])

_module: ModuleType | None
try:
    import vedette_standard._compiled as _module
except ModuleNotFoundError:
    _module = None

TWINS: Mapping[str, Mapping[str, Any]] = _module.twins() if _module else {}
"""By instruction set, best last, the function of each kind that has one."""
_BEST = [*TWINS.values()][-1] if TWINS else {}


def twin(kind: str, *parameters: float) -> Twin | None:
    """Return the twin of a kind with these parameters, or None where none was built."""
    return _twin(kind, np.array(parameters, dtype=float))


def placed(kind: str, pose: Pose, *parameters: float | Array) -> Twin | None:
    """Return the twin of a sensor: its parameters follow x, y and heading of the pose, of which any may lead with runs."""
    place = pose.position
    numbers = (place[..., 0], place[..., 1], pose.heading, *parameters)
    runs = place.ndim > 1 or np.ndim(pose.heading) > 0
    return _twin(kind, np.stack(np.broadcast_arrays(*numbers), axis=-1) if runs else np.array(numbers, dtype=float))


def _twin(kind: str, parameters: Array) -> Twin | None:
    return Twin(_BEST[kind], parameters) if _BEST else None


def biased(own: Twin | None, carried: Array, *axes: Any) -> Twin | None:
    """Return the twin of a sensor with biases around its `own` twin, whose platform moves at `carried` (*b, n).

    axes: as the function of that name takes them, before the number of the own twin's parameters.
    """
    if own is None or _module is None:
        return None
    batch = np.broadcast_shapes(own.parameters.shape[:-1], carried.shape[:-1])
    parameters = [np.broadcast_to(each, (*batch, each.shape[-1])) for each in (own.parameters, carried)]
    function = _module.biased(own.function, *axes, own.parameters.shape[-1])
    return Twin(function, np.concatenate(parameters, axis=-1))


def product(parts: Sequence[tuple[MotionModel, Twin | None]]) -> Twin | None:
    """Return the twin of motions side by side, of each its twin, or None where it is linear: then by F and Q of a step."""
    if _module is None:
        return None
    known: dict[float, Array] = {}
    still = [np.zeros(len(model.state)) for model, _ in parts]

    def of_step(dt: float) -> list[list[Array]]:
        return [
            [own.numbers(x, dt)] if own else [model.jacobian(x, dt).ravel(), model.noise(x, dt).ravel()]
            for (model, own), x in zip(parts, still, strict=True)
        ]

    def over(dt: float) -> Array:
        found = known.get(dt)
        if found is None:
            found = np.concatenate([row for part in of_step(dt) for row in part])
            filters.keep(known, dt, found)
        return found

    functions, sizes = (own and own.function for _, own in parts), (sum(map(len, part)) for part in of_step(1.0))
    return Twin(_module.product(tuple(functions), tuple(map(len, still)), tuple(sizes)), over(1.0), over)


def fastest(reference: F) -> F:
    """Return the compiled function of the same name, which gives None for what it does not take, or the one in numpy."""
    kernel = getattr(_module, reference.__name__, None)
    if kernel is None or not kernels.RUNNING.startswith("compiled"):
        return reference

    @wraps(reference)
    def call(*args: Any) -> Any:
        result = kernel(*args)
        return reference(*args) if result is None else result

    return call  # type: ignore[return-value]
