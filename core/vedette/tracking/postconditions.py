"""What the methods of components must return, as the contract says: asked only once something has failed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import attrs
import numpy as np

from vedette import hypotheses, roles, supporting, types
from vedette.filters.gaussian import has_gaussian_belief
from vedette.space import Space
from vedette.tracking.pytrees import Common
from vedette.types import Detections, Frame, Gaussian, Innovation, LazyScans, Newborn, Recording, Review, Scan

Shape = tuple[int, ...]
Given = Sequence[Any]

_RETURNS = """
MotionModel          state        Space
MotionModel          move         * rows state
MotionModel          jacobian     * rows state state
MotionModel          noise|mean_noise covariance * rows state
MotionModel          reframe      Gaussian
ImagingSensor        information  tuple: information * rows measurement measurement, score * rows measurement, ratio * rows
ImagingSensor        seek|learn   * rows observes
Sensor               observes|measurement Space
Sensor               measure      * rows measurement
Sensor               jacobian     * rows measurement observes
Sensor               noise|mean_noise covariance * rows measurement
Sensor               detects|clutter * ! + rows
Sensor               covers       ? * rows
Sensor               invert       gaussian rows observes
Sensor               at           Sensor
HypothesisAssociator branch       Branching: parent leaves, choice leaves, hypotheses any
HypothesisAssociator keep         tuple: hypotheses any, rows any
Associator           associate    + all
Associator           approximated ? * rows
Estimator            state        Space
Estimator            start|reframe|predict|update belief
Estimator            evaluate     Innovation: loglik tracks 1+k, distance tracks k, log_volume * tracks, nis tracks k
Estimator            moments      gaussian tracks state
Birth                begin        Newborn: returns begun, prior gaussian begun other, existence begun
Birth                reveal       tuple: density ~ * k, sources any
Lifecycle            start        memory all
Lifecycle            predict      ! + all
Lifecycle            review       tuple: memory memory tracks, confirmed ? tracks, alive ? tracks
Preprocessor         measurement  Space
Preprocessor         process      Detections: z k measurement, valid ? k, noise ~ k measurement measurement
Source               open         Recording
"""
"""Role, methods, and what they must return: a type and what its parts are, or what the value is. An array has the axes that
are named, as `_AXES` knows them or of a space of the component; `*`: the first may be missing, where nothing depends on it;
`?`: it is of true or false; `!`: of finite numbers; `+`: of none that is negative; `~`: it may be None."""


def broken(component: roles.Component, method: str, given: Given, gave: Any) -> str | None:
    """Return what is wrong with what a method gave, None if nothing is, or if nothing is stated of it."""
    for role, name, kind, parts in _TABLE:
        if name == method and role in type(component).__mro__:
            return next(_faults(component, given, gave, kind, parts), None)
    return None


def _parsed(line: str) -> Iterator[tuple[type, str, type | None, list[list[str]]]]:
    """Yield role, method, the type of what it returns if that is stated, and the name and the words of each part."""
    known: dict[str, Any] = (
        vars(hypotheses) | vars(roles) | vars(supporting) | vars(types) | {"Space": Space, "tuple": tuple}
    )
    role, methods, text = line.split(maxsplit=2)
    name, _, parts = text.partition(": ")
    kind = known.get(name)
    words = [["", *text.split()]] if kind is None else [part.split() for part in parts.split(", ") if part]
    yield from ((known[role], method, kind, words) for method in methods.split("|"))


_TABLE = [row for line in _RETURNS.strip().splitlines() for row in _parsed(line)]
METHODS = frozenset(method for _, method, _, _ in _TABLE)


def _faults(component: Any, given: Given, gave: Any, kind: type | None, parts: list[list[str]]) -> Iterator[str]:
    if kind is not None and (not isinstance(gave, kind) or (isinstance(gave, tuple) and len(gave) != len(parts))):
        told = f"{kind.__name__}({', '.join(part[0] for part in parts)})" if parts else f"a {kind.__name__}"
        yield f"must return {told.removeprefix('tuple')}; got {_told(gave)}"
        return
    for i, (name, *words) in enumerate(parts):
        part = gave[i] if kind is tuple else getattr(gave, name) if name else gave
        if "any" in words or ("~" in words and part is None):
            continue
        axes = [_axes(word, component, given, gave) for word in words if word not in _OTHER]
        batch, core = axes[0] if axes else (), tuple(size for axis in axes[1:] for size in axis)
        if "belief" in words:
            yield from _believes(component, given, part)
        elif "gaussian" in words:
            yield from _gaussian(given, part, batch, core, name)
        elif "memory" in words:
            yield from _memory(part, batch)
        elif "covariance" in words:
            yield from _array(given, part, batch, core * 2, loose=True)
            if least := _negative(part):
                yield f"must return a covariance; got {least:.3g} on its diagonal"
        else:
            yield from _array(given, part, batch, core, name, loose="*" in words, mask="?" in words, finite="!" in words)
            if "+" in words and (least := np.min(part, initial=0.0)) < -1e-9:
                yield f"must return no negative numbers; got {least:.3g}"
    if isinstance(gave, Innovation) and (many := np.count_nonzero(np.isposinf(gave.loglik))):
        yield f"must return loglik below infinity; got inf in {many} of {np.size(gave.loglik)}"
    if isinstance(gave, Newborn):
        returns, (k, *_) = np.asarray(gave.returns), _seen(given, gave)
        if returns.dtype.kind not in "iu" or returns.ndim != 1 or np.any((returns < 0) | (returns >= k)):
            yield f"must return returns (j,), whole numbers below {k}, as there are {k}; got {_told(gave.returns)}"
    if isinstance(gave, Recording) and not isinstance(gave.scans, LazyScans):
        for scan in gave.scans if isinstance(gave.scans, Sequence) else [gave.scans]:
            if not isinstance(scan, Scan):
                yield f"must return a Recording with a sequence of scans; got {_told(scan)}"


def _seen(given: Given, gave: Any) -> Shape:
    """Return the number of returns that a method was given, or gave."""
    scan = next((value for value in (*given, gave) if isinstance(value, Detections | Frame)), None)
    return np.shape(scan.z)[-2:-1] if isinstance(scan, Detections) else (1,)


def _tracks(given: Given, gave: Any) -> Shape:
    """Return the tracks (*b, t) that a method was given, or gave."""
    if review := next((value for value in given if isinstance(value, Review)), None):
        return np.shape(review.existence)
    known: Any = given[0] if isinstance(given[0], Gaussian) else gave
    return np.shape(known.loglik if isinstance(known, Innovation) else known.mean)[:-1]


_AXES: dict[str, Callable[[Given, Any], Shape]] = {
    "all": lambda given, gave: np.shape(given[0]),
    "rows": lambda given, gave: np.shape(given[0])[:-1],
    "tracks": _tracks,
    "k": _seen,
    "1+k": lambda given, gave: (1 + _seen(given, gave)[0],),
    "begun": lambda given, gave: np.shape(gave.returns),
    "leaves": lambda given, gave: np.shape(gave.parent),
    "other": lambda given, gave: (len(given[1].state),),
}
_OTHER = ("*", "?", "!", "+", "~", "belief", "covariance", "gaussian", "memory")


def _axes(word: str, component: Any, given: Given, gave: Any) -> Shape:
    return _AXES[word](given, gave) if word in _AXES else (len(getattr(component, word)),)


def _told(value: Any) -> str:
    """Return a value in a few words: an array by its shape, anything else by its type."""
    if isinstance(value, np.ndarray | np.generic):
        return f"{value.shape}" if value.dtype.kind in "biuf" else f"{value.shape} of {value.dtype.name} values"
    many = f" of {len(value)}" if isinstance(value, tuple | list) else ""
    return "nothing" if value is None else f"a {type(value).__name__}{many}"


def _leaves(value: Any) -> Iterator[Any]:
    """Yield what attrs values and tuples are made of, as beliefs and memories are of arrays and numbers."""
    parts: Any = () if isinstance(value, Common) else value if isinstance(value, tuple | list) else None
    if attrs.has(type(value)) and not isinstance(value, roles.Component | Space | Common):
        parts = [getattr(value, field.name, None) for field in attrs.fields(type(value))]
    yield from [value] if parts is None else (leaf for part in parts for leaf in _leaves(part))


def _is_tree(value: Any) -> bool:
    """Return whether a value is made of attrs values, tuples and arrays, as beliefs and memories are."""
    simple = value is None or _is_array(value) or attrs.has(type(value))
    return simple or (isinstance(value, tuple) and all(map(_is_tree, value)))


def _is_array(value: Any, kinds: str = "biuf") -> bool:
    return isinstance(value, np.ndarray | np.generic | float | int) and np.asarray(value).dtype.kind in kinds


def _not_numbers(given: Given, gave: Any, part: str = "", *, finite: bool = False) -> Iterator[str]:
    """Yield that a value holds nan, or infinities where it must be finite, and what the method was given did not.

    What must be finite is made of what is: nan of infinities is then the fault of whoever gave these.
    """
    gives, had = ([leaf for leaf in _leaves(one) if _is_array(leaf, "f")] for one in (gave, tuple(given)))
    if not all(np.all(np.isfinite(leaf) if finite else ~np.isnan(leaf)) for leaf in had):
        return
    for which, name in ((np.isnan, "nan"), (np.isinf, "inf"))[: 1 + finite]:
        if many := sum(np.count_nonzero(which(leaf)) for leaf in gives):
            count = f"{many} of {sum(map(np.size, gives))}{part and f' of {part}'}"
            yield f"must return {'finite ' * finite}numbers; got {name} in {count}"


def _array(
    given: Given,
    gave: Any,
    batch: Shape,
    core: Shape,
    part: str = "",
    *,
    loose: bool = False,
    mask: bool = False,
    finite: bool = False,
) -> Iterator[str]:
    """Yield what is wrong with an array (*batch, *core), whose batch axes may be missing if it is `loose`."""
    shape: Shape = np.shape(gave) if _is_array(gave) else ()
    lead = shape[: len(shape) - len(core)]
    right = f"{('*b', *core)} or {core}, *b being {batch} here".replace("'", "") if batch and loose else f"{(*batch, *core)}"
    right = f"must return {part and f'{part} '}{right}"
    # Batch axes of one element, or none at all, broadcast where the result does not depend on the state.
    ends = zip(lead[::-1], batch[::-1], strict=False)
    broadcasts = loose and len(lead) <= len(batch) and all(a in (1, b) for a, b in ends)
    if not _is_array(gave, "b" if mask else "biuf"):
        yield f"{right}, an array of {'true or false' if mask else 'numbers'}; got {_told(gave)}"
    elif shape[len(lead) :] != core or not (lead == batch or broadcasts):
        yield f"{right}; got {shape}"
    yield from _not_numbers(given, gave, part, finite=finite or (loose and bool(core)))


def _gaussian(given: Given, gave: Any, batch: Shape, core: Shape, part: str = "") -> Iterator[str]:
    """Yield what is wrong with a Gaussian, mean (*batch, *core) and cov (*batch, *core, *core)."""
    if not isinstance(gave, Gaussian):
        yield f"must return {part and f'{part}, '}a Gaussian(mean, cov); got {_told(gave)}"
        return
    yield from _array(given, gave.mean, batch, core, f"{part} mean".strip(), finite=True)
    yield from _array(given, gave.cov, batch, core * 2, f"{part} cov".strip(), finite=True)
    if (least := _negative(gave.cov, 1e-12)) and not any(_negative(one.cov) for one in given if isinstance(one, Gaussian)):
        yield f"must return {part and f'{part} '}cov without negative variances; got {least:.3g}"


def _negative(cov: Any, rounding: float = 0.0) -> float:
    """Return the least variance if it is negative, beyond so much `rounding` of the largest number beside it; else 0."""
    least = float(np.min(np.diagonal(cov, axis1=-2, axis2=-1), initial=0.0))
    return least if least < -rounding * np.max(np.abs(cov), initial=0.0) else 0.0


def _memory(gave: Any, tracks: Shape, what: str = "memory") -> Iterator[str]:
    if not _is_tree(gave):
        yield f"must return a {what} of attrs values, tuples and arrays; got {_told(gave)}"
    for leaf in _leaves(gave):
        if isinstance(leaf, np.ndarray | np.floating | float) and np.shape(leaf)[: len(tracks)] != tracks:
            yield f"must return a {what} whose arrays lead with the tracks, {tracks}; got one of {np.shape(leaf)}"


def _believes(estimator: Any, given: Given, gave: Any) -> Iterator[str]:
    """Yield what is wrong with a belief: that of `start`, which is given a prior and its axes, or one that changes."""
    before, begins, plain = given[0], isinstance(given[1], Space), has_gaussian_belief(estimator)
    must_be_gaussian = plain or (isinstance(before, Gaussian) and not begins)
    if gave is None or not _is_tree(gave) or (must_be_gaussian and not isinstance(gave, Gaussian)):
        yield f"must return a belief{'' if begins else f', a {type(before).__name__} as it was given'}; got {_told(gave)}"
    elif isinstance(gave, Gaussian) and isinstance(before, Gaussian):
        n = len(estimator.state) if plain else np.shape((gave if begins else before).mean)[-1]
        yield from _gaussian(given, gave, np.shape(before.mean)[:-1], (n,))
    if not begins or any(_not_numbers(given, estimator.moments(gave))):  # nan may stand for what is not known yet
        yield from _not_numbers(given, gave)
    if not isinstance(gave, Gaussian):
        yield from _memory(gave, np.shape((before if begins else estimator.moments(before)).mean)[:-1], "belief")
