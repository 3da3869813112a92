"""From a config to a tracker and back. The classes are the schema; all problems are reported at once, with their paths.

>>> import vedette
>>> vedette.build({
...     "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": -3}},
...     "sensors": {"radar": {"kind": "cartesian_position", "sigma": "5 kg"}},
...     "associator": {"kind": "pda"},
...     "birth": {"kind": "from_returns", "spread": {"vx": 10, "vy": 10}},
...     "lifecycle": {"kind": "m_of_n"},
...     "gate": {"probabilty": 0.9},
... })
Traceback (most recent call last):
    ...
vedette.errors.ConfigError: estimator.motion.sigma_accel: must be > 0, got -3 m/s^1.5
sensors.radar.sigma: must be in m or km or NM or ft, got '5 kg'
gate.probabilty: unknown; did you mean 'probability'? Gate takes probability, clutter, largest_distance
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from vedette.config.builder import Builder, told
from vedette.config.contract import Installed, described
from vedette.config.files import check_size, read_file
from vedette.config.hooks import plugin
from vedette.config.overrides import KeyPath, apply_changes, apply_overrides, path_of
from vedette.config.parameters import APART, Maybe, Parameter, holds_parts, parameters, plain
from vedette.config.plugins import answers, draft_of, installed_figures, load_plugins, warnings_of
from vedette.config.registry import Registry
from vedette.config.suggestions import did_you_mean, which_kind
from vedette.errors import ConfigError, Problem
from vedette.experiment import Experiment
from vedette.supporting import Lifecycle
from vedette.tracking.components import INLINE, below
from vedette.tracking.tracker import Tracker

Config = Mapping[str, Any] | str | Path
"""A table, with or without component objects in it, or the path to a TOML, YAML or JSON file."""


def build(config: Config, registry: Registry | None = None) -> Tracker:
    """Return the tracker that a config describes. An experiment's config is checked as a whole.

    Parameters
    ----------
    config
        A table, with or without component objects in it, or the path to a TOML, YAML or JSON file. Numbers are in SI units
        unless a text such as "5 km" says otherwise.
    registry
        The components that the config may name; default: all that is installed.

    Returns
    -------
    Tracker
        It is frozen: one tracker serves any number of runs.

    Raises
    ------
    ConfigError
        With every problem and its path in the config.
    """
    return load(config, registry).tracker


def load(config: Config, registry: Registry | None = None, overrides: Iterable[str] = ()) -> Experiment:
    """Return the experiment that a config describes: a tracker, its source and its judge.

    Parameters
    ----------
    config
        A table, with or without component objects in it, or the path to a TOML, YAML or JSON file.
    registry
        The components that the config may name; default: all that is installed.
    overrides
        Changes made before it is built, such as "estimator.modes[1].motion.sigma_accel=0.2", in order; values as in TOML.

    Returns
    -------
    Experiment
        Its `source` is None if the config names none: then it builds a tracker, and cannot run.

    Raises
    ------
    ConfigError
        With every problem and its path; also for a file that cannot be read, and for a study of many runs.
    """
    given: Any = read_file(config) if isinstance(config, str | Path) else config
    if not isinstance(given, Mapping):
        raise ConfigError.at("", f"a config must be a table, or the path to a file, got {told(given)}")
    if "experiment" in given and "estimator" not in given:
        raise ConfigError.at("experiment", "this file is a study of many runs, not the config of one run: use vedette study")
    registry = Registry.installed() if registry is None else registry
    given = with_birth(apply_overrides(given, overrides, registry), given, registry)
    check_size(given)
    builder = Builder(registry)
    experiment = _experiment(builder, {name: value for name, value in given.items() if name != "$schema"})
    if builder.problems or not isinstance(experiment, Experiment):
        raise ConfigError(builder.problems)
    return experiment


def with_birth(given: Mapping[str, Any], before: Mapping[str, Any], registry: Registry) -> dict[str, Any]:
    """Return a config whose birth has a kind: where it names none, that of its lifecycle.

    `before` is the config without its overrides: if they changed the lifecycle, what the birth took then and does not take
    now is left out.
    """
    usual, birth = _usual_birth(given, registry), given.get("birth", {})
    if not isinstance(birth, Mapping) or "kind" in birth:
        return dict(given)
    if usual is None:  # the lifecycle is at fault, and is told: nothing can be said of a birth that goes with it
        return {name: value for name, value in given.items() if name != "birth"}
    gone = _names(_usual_birth(before, registry), registry) - _names(usual, registry)
    return {**given, "birth": {**usual, **{name: value for name, value in birth.items() if name not in gone}}}


def _usual_birth(config: Mapping[str, Any], registry: Registry) -> Mapping[str, Any] | None:
    lifecycle = config.get("lifecycle")
    kind = lifecycle.get("kind") if isinstance(lifecycle, Mapping) else None
    entry = registry.find("lifecycle", kind) if isinstance(kind, str) else None
    cls = lifecycle if isinstance(lifecycle, Lifecycle) else None if entry is None else entry.cls
    return getattr(cls, "usual_birth", None)


def _names(birth: Mapping[str, Any] | None, registry: Registry) -> set[str]:
    """Return what a birth of this kind takes."""
    entry = None if birth is None else registry.find("birth", str(birth["kind"]))
    return set() if entry is None else {parameter.name for parameter in entry.parameters}


def to_config(value: Any) -> dict[str, Any]:
    """Return a config of plain numbers, strings, lists and tables that builds an equal tracker or component.

    Parameters
    ----------
    value
        A tracker, an experiment, or a component.

    Returns
    -------
    dict
        Plain data, in SI units. A tracker's or an experiment's can be passed to `build` or `load`, or be written as TOML.

    Raises
    ------
    TypeError
        For a value that no config can hold.
    """
    config: dict[str, Any] = plain(value)
    return config.pop(INLINE) | config if isinstance(value, Experiment) else config


def _experiment(builder: Builder, given: Mapping[str, Any]) -> Any:
    inner = parameters(Tracker)
    outer = parameters(Experiment)
    known = [parameter.name for parameter in (*inner, *outer) if parameter.name != INLINE]
    meant = builder.check_names(given, known, "", "a config")
    tracker = builder.construct(Tracker, inner, given, "", meant)
    rest = {name: value for name, value in given.items() if name != INLINE}
    return builder.construct(Experiment, outer, {**rest, INLINE: tracker}, "", meant)
