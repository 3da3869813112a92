"""What a study does: the points of its grid, how many runs, how they are cut into chunks, and when it may stop."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs
from attrs import field, frozen

from vedette import Array, ConfigError, Experiment, Problem, Registry, to_config
from vedette.config import did_you_mean, plain, read_file
from vedette.units import in_unit
from vedette_study.chunk import goes_together, recorded, study_figures
from vedette_study.grid import Grid, Point, overridden, value_at
from vedette_study.redraw import Redraw

MOST_RUNS = 1_000_000_000
TOGETHER, ALONE = 500, 10
"""Most runs of a chunk, whoever runs it: in lock-step as few as cost little more than many, so that many cores have work."""
NAMES = ("title", "experiment", "runs", "seed", "chunk", "sweep", "trackers", "average", "redraw", "precision")
SCENES, DRAWS = 1000, 10
"""Runs by default: of drawn scenes, and of a recording of which each run draws a part."""


@frozen(eq=False)
class Plan:
    """A whole study, checked.

    `redraw` is what each run draws of a recording, `average` the swept paths over which figures are averaged, `own` the
    experiment's own values at the swept paths.
    """

    title: str
    points: tuple[Point, ...]
    axes: dict[str, tuple[Any, ...]]
    runs: int
    seed: int
    chunk: int
    together: bool
    redraw: Redraw | None = None
    average: tuple[str, ...] = ()
    precision: dict[str, float] = field(factory=dict)
    own: dict[str, Any] = field(factory=dict, repr=False)
    given: dict[str, Any] = field(factory=dict, repr=False)

    @property
    def hash(self) -> str:
        """Of all that determines a run's result; not of the number of runs, nor of when to stop."""
        parts = [[point.labels, point.config] for point in self.points]
        drawn = [] if self.redraw is None else [[self.redraw.drop, self.redraw.starts]]
        text = json.dumps(parts + drawn, sort_keys=True, default=repr)
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    @property
    def count(self) -> int:
        """Number of chunks of a point."""
        return -(-self.runs // self.chunk)

    def runs_of(self, k: int) -> range:
        """Return the runs of the k-th chunk."""
        return range(k * self.chunk, min((k + 1) * self.chunk, self.runs))


def whole(place: str, given: Any, least: int, most: int = MOST_RUNS) -> int:
    """Return a whole number of the study; ConfigError if it is not one."""
    if isinstance(given, bool) or not isinstance(given, int) or not least <= given <= most:
        raise ConfigError.at(place, f"must be a whole number from {least} to {most:,}, got {given!r}")
    return given


def read_study(path: str | Path, alone: bool = False) -> dict[str, Any]:
    """Return the table of a study's file, with its `experiment`, which it may name by a path relative to the study.

    alone: the config of a run is a study of that one tracker.
    """
    table = read_file(path)
    if alone and "experiment" not in table and "estimator" in table:
        return {"experiment": table}
    _refuse_one_run(table, str(path), Path(path).name)
    experiment = table.get("experiment")
    if isinstance(experiment, str):
        table["experiment"] = read_file(Path(path).parent / experiment)
    return table


def _refuse_one_run(table: Mapping[str, Any], place: str, name: str) -> None:
    """Raise ConfigError, with how to make a study of it, if a table is the config of a run."""
    if "experiment" not in table and "estimator" in table:
        text = (
            f"is the config of one run, not a study: write a file that names it, experiment = {json.dumps(name)}, and says "
            'what to repeat and vary, as in runs = 100 and sweep = { "gate.probability" = [0.9, 0.99] }'
        )
        raise ConfigError.at(place, text)


def plan(table: Mapping[str, Any], overrides: Sequence[str] = ()) -> Plan:
    """Return a study from its table, its experiment changed by `overrides` as `vedette run` would change it.

    ConfigError reports every problem, with its place.
    """
    _refuse_one_run(table, "", "config.toml")
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
    changes = {"sweep": sweep, **{f"trackers.{name}": changes_of for name, changes_of in trackers.items()}}
    base = overridden(experiment, overrides, changes, registry)
    grid = Grid(base, trackers, sweep, registry)
    alone = grid.alone()
    points = grid.points(alone)
    together = all(_goes_together(point) for point in points)
    axes: dict[str, tuple[Any, ...]] = {"tracker": tuple(trackers)} if trackers else {}
    axes |= {path: tuple(values) for path, values in sweep.items()}
    redraw = _redraw(table.get("redraw", {}), points)
    varies = any(_draws(point.experiment, redraw) for point in points)
    usual = (DRAWS if redraw is not None else SCENES) if varies else 1
    runs = whole("runs", table.get("runs", usual), 1)
    if runs > 1 and not varies:
        raise ConfigError.at("runs", _all_the_same(points, runs))
    return Plan(
        title=str(table.get("title", experiment.get("title", ""))),
        points=points,
        axes=axes,
        runs=runs,
        seed=whole("seed", table.get("seed", 0), 0, 2**63 - 1),
        chunk=whole("chunk", table.get("chunk", 0), 0) or (_piece(runs) if together else ALONE),
        together=together,
        redraw=redraw,
        average=_average(table.get("average", ()), axes),
        precision=_precision(table.get("precision")),
        own={path: value_at(to_config(alone.experiment), path) for path in sweep},
        given=json.loads(json.dumps(dict(table) | {"experiment": base}, default=plain)),
    )


def _draws(experiment: Experiment, redraw: Redraw | None) -> bool:
    """Return whether another seed gives another run."""
    if redraw is not None and recorded(experiment) and (redraw.drop > 0 or (redraw.starts and _given(experiment))):
        return True
    parts = (experiment.source, experiment.tracker.estimator.traits, experiment.tracker.birth)
    return any(part is not None and part.draws for part in parts)


def _given(experiment: Experiment) -> bool:
    """Return whether tracks may be given before the first scan."""
    return experiment.tracker.birth is not None and not experiment.tracker.starters


def _redraw(given: Any, points: tuple[Point, ...]) -> Redraw | None:
    """Return what each run draws of a recording; None if all sources draw."""
    names = tuple(attribute.name for attribute in attrs.fields(Redraw))
    if not isinstance(given, Mapping):
        raise ConfigError.at("redraw", f"must be a table such as {{ drop = 0.1 }}, got {given!r}")
    if unknown := [str(name) for name in given if name not in names]:
        text = f"unknown;{did_you_mean(unknown[0], names)} known: {', '.join(names)}"
        raise ConfigError.at(f"redraw.{unknown[0]}", text)
    try:
        redraw = Redraw(**given)
    except ValueError as error:
        raise ConfigError.at(f"redraw.{str(error).partition(':')[0]}", str(error).partition(": ")[2]) from None
    if any(recorded(point.experiment) for point in points):
        return attrs.evolve(redraw, starts=redraw.starts and any(_given(point.experiment) for point in points))
    if given:
        raise ConfigError.at("redraw", "is what is drawn of a recording, but the scenes of this study are drawn whole")
    return None


def _average(given: Any, axes: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the swept paths over which figures are averaged."""
    if isinstance(given, str) or not isinstance(given, list | tuple):
        raise ConfigError.at("average", f"must be a list of swept paths, got {given!r}")
    for path in given:
        if path not in axes:
            text = f"{path!r} is not swept;{did_you_mean(str(path), axes)} swept: {', '.join(axes) or 'nothing'}"
            raise ConfigError.at("average", text)
    return tuple(given)


def _all_the_same(points: tuple[Point, ...], runs: int) -> str:
    sources = {point.experiment.source.kind for point in points if point.experiment.source is not None}
    estimators = {point.experiment.tracker.estimator.kind for point in points}
    return (
        f"must be 1, got {runs:,}: neither the source ({', '.join(sorted(sources))}) nor the estimator "
        f"({', '.join(sorted(estimators))}) draws anything, so all runs would be the same; leave a part of the returns out "
        "with redraw.drop, or vary the scene with a source that draws, such as 'simulation'"
    )


def _piece(runs: int) -> int:
    """Return the runs of a chunk in lock-step; chunks are even in number for two threads, but for few runs."""
    pieces = 2 * -(-runs // (2 * TOGETHER)) if 2 * runs > TOGETHER else 1
    return -(-runs // pieces)


def _precision(given: Any) -> dict[str, float]:
    """Return figure to the standard error at which it is known well enough, in the unit of the figure."""
    if given is None:
        return {}
    if not isinstance(given, Mapping) or not given:
        raise ConfigError.at("precision", f"must be a table such as {{ position_rmse = '0.1 m' }}, got {given!r}")
    wanted, known = dict[str, float](), study_figures()
    for name, value in given.items():
        if name not in known:
            raise ConfigError.at(f"precision.{name}", f"unknown;{did_you_mean(str(name), known)} known: {', '.join(known)}")
        try:
            wanted[str(name)] = in_unit(value, known[name].unit)
        except ValueError as error:
            raise ConfigError.at(f"precision.{name}", str(error)) from None
        if wanted[str(name)] <= 0:
            raise ConfigError.at(f"precision.{name}", f"must be > 0, got {value!r}")
    return wanted


def _goes_together(point: Point) -> bool:
    try:
        return goes_together(point.experiment)
    except ConfigError as error:
        raise error.within("experiment") from None


def _sweep(given: Any) -> dict[str, list[Any]]:
    if not isinstance(given, Mapping):
        raise ConfigError.at("sweep", "must be a table: config path to a list of values")
    swept = {}
    for path, values in given.items():
        if hasattr(values, "tolist"):
            values = values.tolist()
        if not isinstance(values, list | tuple) or not values:
            raise ConfigError.at(f"sweep.{path}", f"must be a list of at least one value, got {values!r}")
        swept[str(path)] = [plain(value) for value in values]
    return swept


def _trackers(given: Any) -> dict[str, Mapping[str, Any]]:
    if not isinstance(given, Mapping) or not all(isinstance(table, Mapping) for table in given.values()):
        raise ConfigError.at("trackers", "must be a table: name to a table of config paths and values")
    return {str(name): table for name, table in given.items()}


def by_point(values: Array, axes: Mapping[str, tuple[Any, ...]]) -> Array:
    """Reshape an array that leads with the points to one that leads with the axes of the grid."""
    return values.reshape((*(len(values_of) for values_of in axes.values()), *values.shape[1:]))
