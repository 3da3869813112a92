"""What a study does: the points of its grid, how many runs, how they are cut into chunks, and when it may stop."""

from __future__ import annotations

import hashlib
import itertools
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from attrs import field, frozen

from vedette.config import apply_overrides, load
from vedette.config.files import read_file
from vedette.config.overrides import apply_changes, path_of
from vedette.config.parameters import plain
from vedette.config.registry import Registry
from vedette.config.renames import renamed, with_birth
from vedette.config.suggestions import did_you_mean
from vedette.errors import ConfigError, Problem
from vedette.experiment import Experiment
from vedette.montecarlo.chunk import goes_together
from vedette.space import Array
from vedette.units import in_unit

MOST_RUNS, MOST_POINTS = 1_000_000_000, 10_000
TOGETHER, ALONE = 2000, 10
"""Most runs of a chunk: in lock-step about as many as fit the cache; else few, that all processes have work."""
UNITS = {
    "position_rmse": "m",
    "velocity_rmse": "m/s",
    "nees": "1",
    "nis": "1",
    "lost": "1",
    "coverage": "1",
    "id_switches": "1",
    "false_tracks": "1",
    "gospa": "m",
    "ospa": "m",
    "confirmed_after": "s",
}
"""All figures of a study. NEES is over the number of axes and NIS over what is expected: both 1 on matched truth."""
NAMES = ("title", "experiment", "runs", "seed", "chunk", "sweep", "trackers", "precision")


@frozen
class Point:
    """One point of the grid: what is varied there, by name, the whole config, and what it describes, ready to run here."""

    labels: dict[str, Any]
    config: dict[str, Any]
    experiment: Experiment = field(repr=False, eq=False)

    @property
    def name(self) -> str:
        """All labels in one line."""
        names = short_names(self.labels)
        return ", ".join(f"{names[path]} {told(value)}" for path, value in self.labels.items()) or "the config"


@frozen(eq=False)
class Plan:
    """A whole study, checked."""

    title: str
    points: tuple[Point, ...]
    axes: dict[str, tuple[Any, ...]]
    runs: int
    seed: int
    chunk: int
    together: bool
    precision: dict[str, float] = field(factory=dict)
    given: dict[str, Any] = field(factory=dict, repr=False)

    @property
    def hash(self) -> str:
        """Of all that decides what a run gives; not of how many runs there are, nor of when to stop."""
        text = json.dumps([[point.labels, point.config] for point in self.points], sort_keys=True, default=repr)
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    @property
    def count(self) -> int:
        """How many chunks a point has."""
        return -(-self.runs // self.chunk)

    def runs_of(self, k: int) -> range:
        """The runs of the k-th chunk."""
        return range(k * self.chunk, min((k + 1) * self.chunk, self.runs))


def short_names(paths: Iterable[str], taken: Iterable[str] = ()) -> dict[str, str]:
    """Return of each config path as much of its end as tells it from the others: of `associator.kind` the `associator`."""
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
    """A swept value in a label."""
    return f"{value:g}" if isinstance(value, float) else value if isinstance(value, str) else json.dumps(plain(value))


def whole(place: str, given: Any, least: int, most: int = MOST_RUNS) -> int:
    """A whole number of the study; ConfigError if it is none."""
    if isinstance(given, bool) or not isinstance(given, int) or not least <= given <= most:
        raise ConfigError([Problem(place, f"must be a whole number from {least} to {most:,}, got {given!r}")])
    return given


def read_study(path: str | Path) -> dict[str, Any]:
    """The table of a study's file, its `experiment` in it, read from the file that it may name relative to the study."""
    table = read_file(path)
    experiment = table.get("experiment")
    if isinstance(experiment, str):
        table["experiment"] = read_file(Path(path).parent / experiment)
    return table


def plan(table: Mapping[str, Any], overrides: Sequence[str] = ()) -> Plan:
    """Return a study from its table, its experiment changed by `overrides` as `vedette run` would change it.

    ConfigError tells every problem, with its place.
    """
    problems = [
        Problem(str(name), f"unknown;{did_you_mean(str(name), NAMES)} a study takes {', '.join(NAMES)}")
        for name in table
        if name not in NAMES
    ]
    experiment = table.get("experiment")
    if not isinstance(experiment, Mapping):
        problems.append(Problem("experiment", "must be a config, or the path to one"))
    if problems:
        raise ConfigError(problems)
    assert isinstance(experiment, Mapping)
    sweep, trackers = _sweep(table.get("sweep", {})), _trackers(table.get("trackers", {}))
    registry = Registry.installed()
    try:
        given = renamed(experiment, registry)
    except ConfigError as error:
        raise error.within("experiment") from None
    changes = {"sweep": sweep, **{f"trackers.{name}": each for name, each in trackers.items()}}
    base = _overridden(given, overrides, changes, registry)
    points = _Grid(given, base, trackers, sweep, registry).points()
    together = all(_goes_together(point) for point in points)
    axes: dict[str, tuple[Any, ...]] = {"tracker": tuple(trackers)} if trackers else {}
    runs = whole("runs", table.get("runs", 1000), 1)
    return Plan(
        title=str(table.get("title", experiment.get("title", ""))),
        points=points,
        axes=axes | {path: tuple(values) for path, values in sweep.items()},
        runs=runs,
        seed=whole("seed", table.get("seed", 0), 0, 2**63 - 1),
        chunk=whole("chunk", table.get("chunk", 0), 0) or (_piece(runs) if together else ALONE),
        together=together,
        precision=_precision(table.get("precision")),
        given=json.loads(json.dumps(dict(table) | {"experiment": base}, default=plain)),
    )


def _piece(runs: int) -> int:
    """Runs of a chunk in lock-step; chunks are even in number, that two threads end together, but for few runs."""
    pieces = 2 * -(-runs // (2 * TOGETHER)) if 2 * runs > TOGETHER else 1
    return -(-runs // pieces)


def _precision(given: Any) -> dict[str, float]:
    """Figure to the standard error at which it is known well enough, in the unit of the figure."""
    if given is None:
        return {}
    if not isinstance(given, Mapping) or not given:
        raise ConfigError([Problem("precision", f"must be a table such as {{ position_rmse = '0.1 m' }}, got {given!r}")])
    wanted = {}
    for name, value in given.items():
        if name not in UNITS:
            raise ConfigError(
                [Problem(f"precision.{name}", f"unknown;{did_you_mean(str(name), UNITS)} known: {', '.join(UNITS)}")]
            )
        try:
            wanted[str(name)] = in_unit(value, UNITS[name])
        except ValueError as error:
            raise ConfigError([Problem(f"precision.{name}", str(error))]) from None
        if wanted[str(name)] <= 0:
            raise ConfigError([Problem(f"precision.{name}", f"must be > 0, got {value!r}")])
    return wanted


def _goes_together(point: Point) -> bool:
    try:
        return goes_together(point.experiment)
    except ConfigError as error:
        raise error.within("experiment") from None


def _sweep(given: Any) -> dict[str, list[Any]]:
    if not isinstance(given, Mapping):
        raise ConfigError([Problem("sweep", "must be a table: config path to a list of values")])
    swept = {}
    for path, values in given.items():
        if hasattr(values, "tolist"):
            values = values.tolist()
        if not isinstance(values, list | tuple) or not values:
            raise ConfigError([Problem(f"sweep.{path}", f"must be a list of at least one value, got {values!r}")])
        swept[str(path)] = [plain(value) for value in values]
    return swept


def _trackers(given: Any) -> dict[str, Mapping[str, Any]]:
    if not isinstance(given, Mapping) or not all(isinstance(table, Mapping) for table in given.values()):
        raise ConfigError([Problem("trackers", "must be a table: name to a table of config paths and values")])
    return {str(name): table for name, table in given.items()}


@frozen
class _Grid:
    """All combinations of trackers and swept values, each a change of `base`, which is `given` with its overrides."""

    given: Mapping[str, Any]
    base: Mapping[str, Any]
    trackers: Mapping[str, Mapping[str, Any]]
    sweep: Mapping[str, list[Any]]
    registry: Registry

    def points(self) -> tuple[Point, ...]:
        """Return all points, each loaded once to see that it can be built."""
        count = max(1, len(self.trackers))
        for values in self.sweep.values():
            count *= len(values)
        if count > MOST_POINTS:
            raise ConfigError([Problem("sweep", f"makes {count:,} points; at most {MOST_POINTS:,} are taken")])
        alone = self._point({}, self.base, "experiment")  # told first, so that its own faults are not the sweep's
        choices = itertools.product(self.trackers or [None], *self.sweep.values())
        return tuple(self._chosen(*each) for each in choices) if self.trackers or self.sweep else (alone,)

    def _chosen(self, tracker: str | None, *values: Any) -> Point:
        config, place = self.base, "sweep" if self.sweep else f"trackers.{tracker}"
        swept = dict(zip(self.sweep, values, strict=True))
        if tracker is not None:
            config = _changed(config, self.trackers[tracker], f"trackers.{tracker}", self.registry)
        config = _changed(config, swept, "sweep", self.registry)
        return self._point(({} if tracker is None else {"tracker": tracker}) | swept, config, place)

    def _point(self, labels: dict[str, Any], config: Mapping[str, Any], place: str) -> Point:
        whole = with_birth(config, self.given, self.registry)
        return Point(labels, whole, _load(whole, place, self.registry))


def _overridden(
    given: Mapping[str, Any], overrides: Iterable[str], changes: Mapping[str, Mapping[str, Any]], registry: Registry
) -> dict[str, Any]:
    """Return the experiment with its overrides; ConfigError where one of the study's `changes`, by place, would undo one."""
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
        raise ConfigError([Problem("experiment.source", "is missing: there are no scans to run on")])
    return experiment


def by_point(values: Array, axes: Mapping[str, tuple[Any, ...]]) -> Array:
    """What leads with the points as an array that leads with the axes of the grid."""
    return values.reshape(*(len(each) for each in axes.values()), *values.shape[1:])
