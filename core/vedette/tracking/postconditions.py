"""What the methods of components must return, as the contract says: asked only once something has failed.

A postcondition takes the component, what its method was given, and what it gave; it yields what is wrong with that.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import attrs
import numpy as np

from vedette.filters.gaussian import has_gaussian_belief
from vedette.hypotheses import Branching, HypothesisAssociator
from vedette.roles import Associator, Component, Estimator, MotionModel, Sensor
from vedette.space import Space
from vedette.supporting import Birth, ImagingSensor, Lifecycle, Preprocessor, Source
from vedette.types import Detections, Frame, Gaussian, Innovation, LazyScans, Newborn, Recording, Scan

Shape = tuple[int, ...]
Given = Sequence[Any]
Postcondition = Callable[[Any, Given, Any], Iterator[str]]


def broken(component: Component, method: str, given: Given, gave: Any) -> str | None:
    """Return what is wrong with what a method gave, None if nothing is, or if nothing is stated of it."""
    for role, methods in POSTCONDITIONS.items():
        if role in type(component).__mro__ and method in methods:
            return next(methods[method](component, given, gave), None)
    return None


def _told(value: Any) -> str:
    """Return a value in a few words: an array by its shape, anything else by its type."""
    if isinstance(value, np.ndarray | np.generic):
        return f"{value.shape}" if value.dtype.kind in "biuf" else f"{value.shape} of {value.dtype.name} values"
    if isinstance(value, tuple | list):
        return f"a {type(value).__name__} of {len(value)}"
    return "nothing" if value is None else f"a {type(value).__name__}"


def _leaves(value: Any) -> Iterator[Any]:
    """Yield what attrs values and tuples are made of, as beliefs and memories are of arrays and numbers."""
    if isinstance(value, tuple | list):
        for part in value:
            yield from _leaves(part)
    elif attrs.has(type(value)) and not isinstance(value, Component | Space):
        for field in attrs.fields(type(value)):
            yield from _leaves(getattr(value, field.name, None))
    else:
        yield value


def _is_tree(value: Any) -> bool:
    """Return whether a value is made of attrs values, tuples and arrays, as beliefs and memories are."""
    return (
        all(map(_is_tree, value))
        if isinstance(value, tuple)
        else value is None or _is_array(value) or attrs.has(type(value))
    )


def _is_array(value: Any, kinds: str = "biuf") -> bool:
    return isinstance(value, np.ndarray | np.generic | float | int) and np.asarray(value).dtype.kind in kinds


def _count(which: Callable[..., Any], value: Any) -> int:
    """Count the numbers in a value that are as `which` says: `np.isnan`, say."""
    return sum(int(np.count_nonzero(which(leaf))) for leaf in _leaves(value) if _is_array(leaf, "f"))


def _array(
    given: Given, gave: Any, batch: Shape, core: Shape = (), part: str = "", *, whole: bool = True, mask: bool = False
) -> Iterator[str]:
    """Yield what is wrong with an array (*batch, *core), whose batch axes may be missing unless it must be `whole`."""
    lead: Shape = np.shape(gave)[: np.ndim(gave) - len(core)]
    right = f"{(*batch, *core)}"
    if batch and not whole:
        right = f"{('*b', *core)} or {core}, *b being {batch} here".replace("'", "")
    right = f"must return {part} {right}" if part else f"must return {right}"
    # Batch axes of one element, or none at all, broadcast where the result does not depend on the state.
    fits = lead == batch
    if not whole:
        fits = len(lead) <= len(batch) and all(a in (1, b) for a, b in zip(lead[::-1], batch[::-1], strict=False))
    if not _is_array(gave, "b" if mask else "biuf"):
        yield f"{right}, an array of {'true or false' if mask else 'numbers'}; got {_told(gave)}"
    elif np.shape(gave)[len(lead) :] != core or not fits:
        yield f"{right}; got {np.shape(gave)}"
    elif (count := _count(np.isnan, gave)) and not _count(np.isnan, tuple(given)):
        yield f"must return numbers; got nan in {count} of {np.size(gave)}{f' of {part}' if part else ''}"


def _gaussian(given: Given, gave: Any, batch: Shape, n: int, part: str = "") -> Iterator[str]:
    """Yield what is wrong with a Gaussian, mean (*batch, n) and cov (*batch, n, n)."""
    if not isinstance(gave, Gaussian):
        yield f"must return {f'{part}, ' if part else ''}a Gaussian(mean, cov); got {_told(gave)}"
        return
    yield from _array(given, gave.mean, batch, (n,), f"{part} mean".strip())
    yield from _array(given, gave.cov, batch, (n, n), f"{part} cov".strip())


def _is(kind: type, words: str = "", then: Postcondition | None = None, count: int | None = None) -> Postcondition:
    """State that a value of this kind is returned, or a tuple of so many, of which `then` says more."""

    def postcondition(component: Any, given: Given, gave: Any) -> Iterator[str]:
        if not isinstance(gave, kind) or (isinstance(gave, tuple) and count not in (None, len(gave))):
            yield f"must return {words or f'a {kind.__name__}'}; got {_told(gave)}"
        elif then is not None:
            yield from then(component, given, gave)

    return postcondition


def _over_x(*core: str, variance: bool = False) -> Postcondition:
    """State (*b, *core) of x (*b, n), each of `core` a space of the component by its attribute; a covariance, maybe."""

    def postcondition(component: Any, given: Given, gave: Any) -> Iterator[str]:
        sizes = tuple(len(getattr(component, name)) for name in core)
        yield from _array(given, gave, np.shape(given[0])[:-1], sizes, whole=False)
        if core and (count := _count(np.isinf, gave)) and not _count(np.isinf, tuple(given)):
            yield f"must return finite numbers; got {count} of {np.size(gave)} that are not"
        if variance and np.size(gave) and (least := np.min(np.diagonal(gave, axis1=-2, axis2=-1))) < 0:
            yield f"must return a covariance; got {least:.3g} on its diagonal"

    return postcondition


def _informs(sensor: ImagingSensor, given: Given, gave: Any) -> Iterator[str]:
    m, batch = len(sensor.measurement), np.shape(given[0])[:-1]
    for part, core, name in zip(gave, ((m, m), (m,), ()), ("information", "score", "ratio"), strict=True):
        yield from _array(given, part, batch, core, name, whole=False)


def _starts(estimator: Estimator[Any], given: Given, gave: Any) -> Iterator[str]:
    if gave is None or not _is_tree(gave):
        yield f"must return a belief of attrs values, tuples and arrays; got {_told(gave)}"
    elif isinstance(gave, Gaussian) or has_gaussian_belief(estimator):
        n = len(estimator.state) if has_gaussian_belief(estimator) else np.shape(gave.mean)[-1]
        yield from _gaussian(given, gave, np.shape(given[0].mean)[:-1], n)


def _believes(estimator: Estimator[Any], given: Given, gave: Any) -> Iterator[str]:
    before = given[0]
    if before is None:
        yield "was given no belief: `start`, `predict` and `update` must return one"
    elif gave is None or not _is_tree(gave) or (isinstance(before, Gaussian) and not isinstance(gave, Gaussian)):
        yield f"must return a belief, a {type(before).__name__} as it was given; got {_told(gave)}"
    elif isinstance(before, Gaussian):
        yield from _gaussian(given, gave, np.shape(before.mean)[:-1], np.shape(before.mean)[-1])
    elif (count := _count(np.isnan, gave)) and not _count(np.isnan, tuple(given)):
        yield f"must return a belief in numbers; got nan in {count} places"


def _evaluates(estimator: Estimator[Any], given: Given, gave: Innovation) -> Iterator[str]:
    belief, observed = given[0], given[2]
    batch = np.shape(belief.mean if isinstance(belief, Gaussian) else gave.loglik)[:-1]
    k = 1 if isinstance(observed, Frame) else observed.z.shape[-2]
    yield from _array(given, gave.loglik, batch, (1 + k,), "loglik")
    if not isinstance(observed, Frame):
        yield from _array(given, gave.distance, batch, (k,), "distance")
        yield from _array(given, gave.log_volume, batch, (), "log_volume", whole=False)
        yield from _array(given, gave.nis, batch, (k,), "nis")


def _moments(estimator: Estimator[Any], given: Given, gave: Any) -> Iterator[str]:
    mean: Any = given[0].mean if isinstance(given[0], Gaussian) else getattr(gave, "mean", None)
    yield from _gaussian(given, gave, np.shape(mean)[:-1], len(estimator.state))


def _per_track(given: Given, gave: Any, tracks: Shape) -> Iterator[str]:
    if not _is_tree(gave):
        yield f"must return a memory of attrs values, tuples and arrays; got {_told(gave)}"
    for leaf in _leaves(gave):
        if isinstance(leaf, np.ndarray | np.floating | float) and np.shape(leaf)[: len(tracks)] != tracks:
            yield f"must return a memory whose arrays lead with the tracks, {tracks}; got one of {np.shape(leaf)}"


def _reviews(lifecycle: Lifecycle, given: Given, gave: Any) -> Iterator[str]:
    tracks = np.shape(given[1].existence)
    yield from _per_track(given, gave[0], tracks)
    yield from _array(given, gave[1], tracks, (), "confirmed", mask=True)
    yield from _array(given, gave[2], tracks, (), "alive", mask=True)


def _reveals(birth: Birth, given: Given, gave: Any) -> Iterator[str]:
    if gave[0] is not None:
        yield from _array(given, gave[0], (given[3].z.shape[-2],), (), "density", whole=False)


def _begins(birth: Birth, given: Given, gave: Newborn) -> Iterator[str]:
    k, returns = given[4].z.shape[-2], gave.returns
    if not _is_array(returns, "iu") or np.ndim(returns) != 1 or np.any((returns < 0) | (returns >= k)):
        yield f"must return returns (j,), whole numbers below {k}, as there are {k}; got {_told(returns)}"
    yield from _gaussian(given, gave.prior, np.shape(returns), len(given[1].state), "prior")
    yield from _array(given, gave.existence, np.shape(returns), (), "existence")


def _branches(associator: HypothesisAssociator, given: Given, gave: Branching) -> Iterator[str]:
    if np.shape(gave.parent) != np.shape(gave.choice) or np.ndim(gave.parent) != 1:
        yield f"must return parent (l,) and choice (l,); got {_told(gave.parent)} and {_told(gave.choice)}"


def _processes(preprocessor: Preprocessor, given: Given, gave: Detections) -> Iterator[str]:
    batch, m = np.shape(gave.z)[:-1], len(preprocessor.measurement)
    yield from _array(given, gave.z, batch, (m,), "z")
    yield from _array(given, gave.valid, batch, (), "valid", mask=True)
    if gave.noise is not None:
        yield from _array(given, gave.noise, batch, (m, m), "noise")


def _opens(source: Source, given: Given, gave: Recording) -> Iterator[str]:
    if not isinstance(gave.scans, Sequence):
        yield f"must return a Recording with a sequence of scans; got {_told(gave.scans)}"
    elif not isinstance(gave.scans, LazyScans):
        yield from (f"must return scans; got {_told(scan)}" for scan in gave.scans if not isinstance(scan, Scan))


def _weighs(associator: Associator, given: Given, gave: Any) -> Iterator[str]:
    yield from _array(given, gave, np.shape(given[0]), (), "weights")


_SPACE, _GAUSSIAN = _is(Space), _is(Gaussian)
POSTCONDITIONS: dict[type[Component], dict[str, Postcondition]] = {
    MotionModel: {
        "state": _SPACE,
        "move": _over_x("state"),
        "jacobian": _over_x("state", "state"),
        "noise": _over_x("state", "state", variance=True),
        "reframe": _GAUSSIAN,
    },
    ImagingSensor: {
        "information": _is(tuple, "three arrays: information, score, log-likelihood ratio", _informs, 3),
        "seek": _over_x("observes"),
        "learn": _over_x("observes"),
    },
    Sensor: {
        "observes": _SPACE,
        "measurement": _SPACE,
        "measure": _over_x("measurement"),
        "jacobian": _over_x("measurement", "observes"),
        "noise": _over_x("measurement", "measurement", variance=True),
        "detects": _over_x(),
        "clutter": _over_x(),
        "invert": lambda it, given, gave: _gaussian(given, gave, np.shape(given[0])[:-1], len(it.observes)),
        "at": _is(Sensor),
    },
    HypothesisAssociator: {
        "branch": _is(Branching, "a Branching(parent, choice, hypotheses)", _branches),
        "keep": _is(tuple, "the hypotheses and the rows of the leaves that stay", count=2),
        "associate": _weighs,
    },
    Associator: {
        "associate": _weighs,
        "approximated": lambda it, given, gave: _array(given, gave, np.shape(given[0])[:-1], whole=False, mask=True),
    },
    Estimator: {
        "state": _SPACE,
        "start": _starts,
        "reframe": _believes,
        "predict": _believes,
        "evaluate": _is(Innovation, "an Innovation", _evaluates),
        "update": _believes,
        "moments": _moments,
    },
    Birth: {
        "begin": _is(Newborn, "a Newborn(returns, prior, existence)", _begins),
        "reveal": _is(tuple, "the density of each return, or None, and what `begin` needs", _reveals, 2),
    },
    Lifecycle: {
        "start": lambda it, given, gave: _per_track(given, gave, np.shape(given[0])),
        "predict": lambda it, given, gave: _array(given, gave, np.shape(given[0])),
        "review": _is(tuple, "memory, confirmed and alive", _reviews, 3),
    },
    Preprocessor: {"measurement": _SPACE, "process": _is(Detections, "Detections", _processes)},
    Source: {"open": _is(Recording, "", _opens)},
}
"""By role, what its methods must return."""

METHODS = frozenset(name for methods in POSTCONDITIONS.values() for name in methods)
