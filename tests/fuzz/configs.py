"""Configs: the examples with changes, and new ones put together from what is installed. Loading them may only refuse."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import vedette
from fuzz.cases import NASTY, pick
from fuzz.trees import mutated
from vedette import Registry
from vedette.config.files import read_file

EXAMPLES = Path(__file__).parents[2] / "examples"


@cache
def examples() -> list[dict[str, Any]]:
    """Return the example configs."""
    return [read_file(path) for path in sorted(EXAMPLES.glob("*.toml")) if path.name != "study.toml"]


@cache
def installed() -> Registry:
    """Return what is installed, loaded once."""
    return Registry.installed()


def case(rng: np.random.Generator, folder: Path) -> str:
    """Load one config."""
    vedette.load(drawn(rng), installed())
    return "accepted"


def drawn(rng: np.random.Generator) -> dict[str, Any]:
    """Return an example with changes, two in three times; else one that is put together."""
    if rng.random() < 0.67:
        return mutated(rng, pick(rng, examples()), examples())
    config: dict[str, Any] = {
        "estimator": _part(rng, "estimator", 0),
        "sensors": {"radar": _part(rng, "sensor", 0)},
        "associator": _part(rng, "associator", 0),
        "birth": _part(rng, "birth", 0),
        "lifecycle": _part(rng, "lifecycle", 0),
    }
    if rng.random() < 0.5:
        config["source"] = _part(rng, "source", 0)
    if rng.random() < 0.2:
        config["preprocessors"] = {"radar": _part(rng, "preprocessor", 0)}
    return config


def _part(rng: np.random.Generator, role: str, depth: int) -> dict[str, Any]:
    """Return a component of a role with values for some of its parameters."""
    entry = pick(rng, [entry for entry in installed() if entry.role == role])
    part: dict[str, Any] = {"kind": entry.kind}
    for parameter in entry.parameters:
        told = parameter.describe()
        if told.get("default") is not None and rng.random() < 0.7:
            continue
        part[parameter.name] = _value(rng, told, depth)
    return part


def _value(rng: np.random.Generator, told: dict[str, Any], depth: int) -> Any:
    """Return something that may suit a parameter, by what it says of itself."""
    words = str(told).lower()
    roles = [role for role in ("motion", "sensor", "estimator", "associator") if role in words]
    if roles and depth < 4 and rng.random() < 0.8:
        part = _part(rng, pick(rng, roles), depth + 1)
        return pick(rng, [part, [part], [part, part], {"a": part}])
    return next(_values(rng))


def _values(rng: np.random.Generator) -> Iterator[Any]:
    usual = [float(rng.uniform(0.01, 0.99)), int(rng.integers(1, 10)), [1.0, 2.0], {"x": 1.0, "vx": 2.0}, "x", True]
    while True:
        yield pick(rng, NASTY if rng.random() < 0.3 else usual)
