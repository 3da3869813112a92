"""The points of a study: all combinations of its trackers and swept values, each a config that can be built."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import attrs
from attrs import field, frozen

from vedette import ConfigError, Experiment, Problem, Registry, load
from vedette.config import apply_changes, apply_overrides, parameters, path_of, plain, with_birth

MOST_POINTS = 10_000


@frozen
class Point:
    """One point of the grid: what is varied there, by name, the whole config, and the experiment built from it."""

    labels: dict[str, Any]
    config: dict[str, Any]
    experiment: Experiment = field(repr=False, eq=False)

    @property
    def name(self) -> str:
        """All labels in one line."""
        names = short_names(self.labels)
        return ", ".join(f"{names[path]} {told(value)}" for path, value in self.labels.items()) or "the config"


def short_names(paths: Iterable[str], taken: Iterable[str] = ()) -> dict[str, str]:
    """Return for each config path as much of its end as is unique: for `associator.kind`, `associator`."""
    taken, whole = set(taken), list(paths)
    parts = {path: path.removesuffix(".kind").split(".") for path in whole}
    names = {path: steps[-1] for path, steps in parts.items()}
    for length in range(2, max(map(len, parts.values()), default=0) + 1):
        ends = list(names.values())
        for path, steps in parts.items():
            if ends.count(names[path]) > 1 or names[path] in taken:
                names[path] = ".".join(steps[-length:])
    return {path: path if name in taken or list(names.values()).count(name) > 1 else name for path, name in names.items()}


def told(value: Any) -> str:
    """Format a swept value for a label."""
    return f"{value:g}" if isinstance(value, float) else value if isinstance(value, str) else json.dumps(plain(value))


@frozen
class Grid:
    """All combinations of trackers and swept values, each a change of `base`."""

    base: dict[str, Any]
    trackers: Mapping[str, Mapping[str, Any]]
    sweep: Mapping[str, list[Any]]
    registry: Registry

    def alone(self) -> Point:
        """Return the config as it is; before the points, so that its own faults are not reported as the sweep's."""
        return self._point({}, self.base, "experiment")

    def points(self, alone: Point) -> tuple[Point, ...]:
        """Return all points, each loaded once to check that it can be built."""
        count = max(1, len(self.trackers))
        for values in self.sweep.values():
            count *= len(values)
        if count > MOST_POINTS:
            raise ConfigError.at("sweep", f"makes {count:,} points; at most {MOST_POINTS:,} are taken")
        if undone := list(self._undone()):
            raise ConfigError(undone)
        choices = itertools.product(self.trackers or [None], *self.sweep.values())
        return tuple(self._chosen(*choice) for choice in choices) if self.trackers or self.sweep else (alone,)

    def _undone(self) -> Iterator[Problem]:
        """Yield the changes of trackers that the sweep would replace: their points would be equal under several names."""
        for tracker, changes in self.trackers.items():
            for path, swept in itertools.product(changes, self.sweep):
                if (own := path_of(swept)) and path_of(path)[: len(own)] == own:
                    yield Problem(f"trackers.{tracker}.{path}", f"has no effect: the study sets sweep.{swept}")

    def _chosen(self, tracker: str | None, *values: Any) -> Point:
        own, place = self.base, f"trackers.{tracker}"
        swept = dict(zip(self.sweep, values, strict=True))
        if tracker is not None:
            own = _changed(own, self.trackers[tracker], place, self.registry)
        config = _changed(own, swept, "sweep", self.registry)
        try:
            return self._point(({} if tracker is None else {"tracker": tracker}) | swept, config, "sweep")
        except ConfigError:
            if tracker is not None:
                self._point({}, own, place)  # its own faults are not told as the sweep's
            raise

    def _point(self, labels: dict[str, Any], config: dict[str, Any], place: str) -> Point:
        whole = with_birth(config, self.base, self.registry)
        return Point(labels, whole, _load(whole, place, self.registry))


def overridden(
    given: Mapping[str, Any], overrides: Iterable[str], changes: Mapping[str, Mapping[str, Any]], registry: Registry
) -> dict[str, Any]:
    """Return the experiment with its overrides; ConfigError if one of the study's `changes`, by place, would undo one."""
    overrides = list(overrides)
    undone = [
        Problem(f"--set {override}", f"has no effect: the study sets {place}.{path}")
        for override in overrides
        for place, paths in changes.items()
        for path in paths
        if (own := path_of(path)) and path_of(override)[: len(own)] == own
    ]
    if undone:
        raise ConfigError(undone)
    return apply_overrides(given, overrides, registry)


def _changed(config: Mapping[str, Any], changes: Mapping[str, Any], place: str, registry: Registry) -> dict[str, Any]:
    try:
        return apply_changes(config, ((path, plain(value)) for path, value in changes.items()), registry)
    except ConfigError as error:
        raise error.within(place) from None


def _load(config: Mapping[str, Any], place: str, registry: Registry) -> Experiment:
    try:
        experiment = load(config, registry)
    except ConfigError as error:
        raise error.within(place) from None
    if experiment.source is None:
        raise ConfigError.at("experiment.source", "is missing: there are no scans to run on")
    return experiment


def value_at(config: Any, path: str) -> Any:
    """Return the value at a path of a whole config; None if it has none."""
    for step in path_of(path):
        try:
            config = config[step]
        except (KeyError, IndexError, TypeError):
            return None
    return config


def unit_at(experiment: Experiment, path: str) -> str:
    """Return the unit of the parameter at a config path, "" if it has none."""
    *steps, last = path_of(path)
    part: Any = experiment if steps and hasattr(experiment, str(steps[0])) else experiment.tracker
    for step in steps:
        try:
            part = getattr(part, step) if isinstance(step, str) and not isinstance(part, Mapping) else part[step]
        except (AttributeError, KeyError, IndexError, TypeError):
            return ""
    if not attrs.has(type(part)):
        return ""
    unit = next((parameter.unit for parameter in parameters(type(part)) if parameter.name == last), "")
    return "" if unit == "1" else unit


def spaced_evenly_in_log(values: Sequence[Any]) -> bool:
    """Return whether swept numbers are spaced more evenly by their ratios than by their differences."""
    given = sorted(set(map(float, values)))
    if len(given) < 2 or given[0] <= 0:
        return False
    if len(given) == 2:
        return given[1] >= 10 * given[0]
    return _unevenness([math.log(value) for value in given]) < _unevenness(given)


def _unevenness(values: Sequence[float]) -> float:
    """Return the largest step over the smallest."""
    steps = [after - before for before, after in itertools.pairwise(values)]
    return max(steps) / min(steps)
