"""What the methods of components must return, as the contract says: asked only once something has failed.

A promise takes the component, what its method was given, and what it gave; it yields what is wrong with that, in words.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from vedette.filters.gaussian import has_gaussian_belief
from vedette.hypotheses import Branching, HypothesisAssociator
from vedette.roles import Associator, Component, Estimator, MotionModel, Sensor
from vedette.space import Space
from vedette.supporting import Birth, ImagingSensor, Lifecycle, Preprocessor, Source
from vedette.tracking.returned import Shape, array_flaws, arrays, gaussian_flaws, infinite, is_tree, told, undefined
from vedette.types import Detections, Frame, Gaussian, Innovation, LazyScans, Newborn, Recording, Scan

Promise = Callable[[Any, Sequence[Any], Any], Iterator[str]]


def broken(component: Component, method: str, given: Sequence[Any], gave: Any) -> str | None:
    """Return what is wrong with what a method gave, None if nothing is, or if it promises nothing."""
    bases = type(component).__mro__
    for role, promises in PROMISES.items():
        if role in bases and method in promises:
            return next(promises[method](component, given, gave), None)
    return None


def _over_x(*core: str) -> Promise:
    """Promise (*b, *core) of x (*b, n), each of `core` a space of the component by its attribute."""

    def promise(component: Any, given: Sequence[Any], gave: Any) -> Iterator[str]:
        sizes = tuple(len(getattr(component, name)) for name in core)
        yield from array_flaws(given, gave, np.shape(given[0])[:-1], sizes)
        if core and (count := infinite(gave)) and not infinite(tuple(given)):
            yield f"must return finite numbers; got {count} of {np.size(gave)} that are not"

    return promise


def _noise(*core: str) -> Promise:
    """Promise a covariance (*b, *core) of x (*b, n)."""
    shaped = _over_x(*core)

    def promise(component: Any, given: Sequence[Any], gave: Any) -> Iterator[str]:
        yield from shaped(component, given, gave)
        if np.size(gave) and (least := np.min(np.diagonal(gave, axis1=-2, axis2=-1))) < 0:
            yield f"must return a covariance; got {least:.3g} on its diagonal"

    return promise


def _a(kind: type) -> Promise:
    def promise(component: Any, given: Sequence[Any], gave: Any) -> Iterator[str]:
        if not isinstance(gave, kind):
            yield f"must return a {kind.__name__}; got {told(gave)}"

    return promise


def _inverts(sensor: Sensor, given: Sequence[Any], gave: Any) -> Iterator[str]:
    yield from gaussian_flaws(given, gave, np.shape(given[0])[:-1], len(sensor.observes))


def _informs(sensor: ImagingSensor, given: Sequence[Any], gave: Any) -> Iterator[str]:
    m, batch = len(sensor.measurement), np.shape(given[0])[:-1]
    if not isinstance(gave, tuple) or len(gave) != 3:
        yield f"must return three arrays: information, score, log-likelihood ratio; got {told(gave)}"
        return
    for part, core, name in zip(gave, ((m, m), (m,), ()), ("information", "score", "ratio"), strict=True):
        yield from array_flaws(given, part, batch, core, name)


def _weighs(associator: Associator, given: Sequence[Any], gave: Any) -> Iterator[str]:
    yield from array_flaws(given, gave, np.shape(given[0]), (), "weights", whole=True)


def _approximated(associator: Associator, given: Sequence[Any], gave: Any) -> Iterator[str]:
    yield from array_flaws(given, gave, np.shape(given[0])[:-1], (), mask=True)


def _starts(estimator: Estimator[Any], given: Sequence[Any], gave: Any) -> Iterator[str]:
    if gave is None or not is_tree(gave):
        yield f"must return a belief of attrs values, tuples and arrays; got {told(gave)}"
    elif isinstance(gave, Gaussian) or has_gaussian_belief(estimator):
        n = len(estimator.state) if has_gaussian_belief(estimator) else np.shape(gave.mean)[-1]
        yield from gaussian_flaws(given, gave, np.shape(given[0].mean)[:-1], n)


def _believes(estimator: Estimator[Any], given: Sequence[Any], gave: Any) -> Iterator[str]:
    before = given[0]
    if before is None:
        yield "was given no belief: `start`, `predict` and `update` must return one"
    elif type(gave) is not type(before) and not _is_another_belief(estimator, before, gave):
        yield f"must return a belief, a {type(before).__name__} as it was given; got {told(gave)}"
    elif isinstance(before, Gaussian):
        yield from gaussian_flaws(given, gave, np.shape(before.mean)[:-1], np.shape(before.mean)[-1])
    elif (count := undefined(gave)) and not undefined(tuple(given)):
        yield f"must return a belief in numbers; got nan in {count} places"


def _is_another_belief(estimator: Estimator[Any], before: Any, gave: Any) -> bool:
    """Return whether the estimator, whose beliefs are no Gaussians, has several types of beliefs, and this is one."""
    if isinstance(before, Gaussian) or gave is None or not is_tree(gave):
        return False
    try:
        return isinstance(estimator.moments(gave), Gaussian)
    except Exception:
        return False


def _evaluates(estimator: Estimator[Any], given: Sequence[Any], gave: Any) -> Iterator[str]:
    belief, observed = given[0], given[2]
    if not isinstance(gave, Innovation):
        yield f"must return an Innovation; got {told(gave)}"
        return
    k = 1 if isinstance(observed, Frame) else observed.z.shape[-2]
    tracks = belief.mean if isinstance(belief, Gaussian) else gave.loglik
    batch = np.shape(tracks)[:-1]
    yield from array_flaws(given, gave.loglik, batch, (1 + k,), "loglik", whole=True)
    if not isinstance(observed, Frame):
        yield from array_flaws(given, gave.distance, batch, (k,), "distance", whole=True)
        yield from array_flaws(given, gave.log_volume, batch, (), "log_volume")
        yield from array_flaws(given, gave.nis, batch, (k,), "nis", whole=True)


def _moments(estimator: Estimator[Any], given: Sequence[Any], gave: Any) -> Iterator[str]:
    belief, n = given[0], len(estimator.state)
    mean: Any = belief.mean if isinstance(belief, Gaussian) else getattr(gave, "mean", None)
    yield from gaussian_flaws(given, gave, np.shape(mean)[:-1], n)


def _per_track(given: Sequence[Any], gave: Any, shape: Shape) -> Iterator[str]:
    if not is_tree(gave):
        yield f"must return a memory of attrs values, tuples and arrays; got {told(gave)}"
    for each in arrays(gave):
        if each.shape[: len(shape)] != shape:
            yield f"must return a memory whose arrays lead with the tracks, {shape}; got one of {each.shape}"


def _remembers(lifecycle: Lifecycle, given: Sequence[Any], gave: Any) -> Iterator[str]:
    yield from _per_track(given, gave, np.shape(given[0]))


def _fades(lifecycle: Lifecycle, given: Sequence[Any], gave: Any) -> Iterator[str]:
    yield from array_flaws(given, gave, np.shape(given[0]), (), whole=True)


def _reviews(lifecycle: Lifecycle, given: Sequence[Any], gave: Any) -> Iterator[str]:
    if not isinstance(gave, tuple) or len(gave) != 3:
        yield f"must return memory, confirmed and alive; got {told(gave)}"
        return
    tracks = np.shape(given[1].existence)
    yield from _per_track(given, gave[0], tracks)
    yield from array_flaws(given, gave[1], tracks, (), "confirmed", whole=True, mask=True)
    yield from array_flaws(given, gave[2], tracks, (), "alive", whole=True, mask=True)


def _reveals(birth: Birth, given: Sequence[Any], gave: Any) -> Iterator[str]:
    if not isinstance(gave, tuple) or len(gave) != 2:
        yield f"must return the density of each return, or None, and what `begin` needs; got {told(gave)}"
    elif gave[0] is not None:
        yield from array_flaws(given, gave[0], (given[3].z.shape[-2],), (), "density")


def _begins(birth: Birth, given: Sequence[Any], gave: Any) -> Iterator[str]:
    if not isinstance(gave, Newborn):
        yield f"must return a Newborn(returns, prior, existence); got {told(gave)}"
        return
    estimator, k = given[1], given[4].z.shape[-2]
    if np.ndim(gave.returns) != 1 or np.asarray(gave.returns).dtype.kind not in "iu":
        yield f"must return returns (j,), an array of whole numbers; got {told(gave.returns)}"
    elif len(gave.returns) and not 0 <= np.min(gave.returns) <= np.max(gave.returns) < k:
        yield f"must return returns from 0 to {k - 1}, as there are {k}; got {np.max(gave.returns)}"
    else:
        j = np.shape(gave.returns)
        yield from gaussian_flaws(given, gave.prior, j, len(estimator.state), "prior")
        yield from array_flaws(given, gave.existence, j, (), "existence", whole=True)


def _branches(associator: HypothesisAssociator, given: Sequence[Any], gave: Any) -> Iterator[str]:
    if not isinstance(gave, Branching):
        yield f"must return a Branching(parent, choice, hypotheses); got {told(gave)}"
    elif np.shape(gave.parent) != np.shape(gave.choice) or np.ndim(gave.parent) != 1:
        yield f"must return parent (l,) and choice (l,); got {told(gave.parent)} and {told(gave.choice)}"


def _keeps(associator: HypothesisAssociator, given: Sequence[Any], gave: Any) -> Iterator[str]:
    if not isinstance(gave, tuple) or len(gave) != 2:
        yield f"must return the hypotheses and the rows of the leaves that stay; got {told(gave)}"


def _processes(preprocessor: Preprocessor, given: Sequence[Any], gave: Any) -> Iterator[str]:
    if not isinstance(gave, Detections):
        yield f"must return Detections; got {told(gave)}"
        return
    m = len(preprocessor.measurement)
    batch = np.shape(gave.z)[:-1]
    yield from array_flaws(given, gave.z, batch, (m,), "z", whole=True)
    yield from array_flaws(given, gave.valid, batch, (), "valid", whole=True, mask=True)
    if gave.noise is not None:
        yield from array_flaws(given, gave.noise, batch, (m, m), "noise", whole=True)


def _opens(source: Source, given: Sequence[Any], gave: Any) -> Iterator[str]:
    if not isinstance(gave, Recording):
        yield f"must return a Recording; got {told(gave)}"
    elif not isinstance(gave.scans, Sequence):
        yield f"must return a Recording with a sequence of scans; got {told(gave.scans)}"
    elif not isinstance(gave.scans, LazyScans):
        yield from (f"must return scans; got {told(each)}" for each in gave.scans if not isinstance(each, Scan))


_SPACE, _GAUSSIAN = _a(Space), _a(Gaussian)
PROMISES: dict[type[Component], dict[str, Promise]] = {
    MotionModel: {
        "state": _SPACE,
        "move": _over_x("state"),
        "jacobian": _over_x("state", "state"),
        "noise": _noise("state", "state"),
        "reframe": _GAUSSIAN,
    },
    ImagingSensor: {"information": _informs, "seek": _over_x("observes"), "learn": _over_x("observes")},
    Sensor: {
        "observes": _SPACE,
        "measurement": _SPACE,
        "measure": _over_x("measurement"),
        "jacobian": _over_x("measurement", "observes"),
        "noise": _noise("measurement", "measurement"),
        "detects": _over_x(),
        "clutter": _over_x(),
        "invert": _inverts,
        "at": _a(Sensor),
    },
    HypothesisAssociator: {"branch": _branches, "keep": _keeps, "associate": _weighs},
    Associator: {"associate": _weighs, "approximated": _approximated},
    Estimator: {
        "state": _SPACE,
        "start": _starts,
        "reframe": _believes,
        "predict": _believes,
        "evaluate": _evaluates,
        "update": _believes,
        "moments": _moments,
    },
    Birth: {"begin": _begins, "reveal": _reveals},
    Lifecycle: {"start": _remembers, "predict": _fades, "review": _reviews},
    Preprocessor: {"measurement": _SPACE, "process": _processes},
    Source: {"open": _opens},
}
"""By role, what its methods must return."""

METHODS = frozenset(name for promises in PROMISES.values() for name in promises)
