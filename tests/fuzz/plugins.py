"""Plugins: one with its source changed, beside another that is right. Whatever the one does, the other is there."""

from __future__ import annotations

import importlib.metadata
import sys
import types
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
from attrs import frozen

from fuzz.cases import NASTY, pick
from support.drift import SOURCE, drifting
from vedette import ConfigError, PluginError, Registry
from vedette.config import plugins

CHANGES = [
    ("CONTRACT = 2", "CONTRACT = VALUE"),
    ('"drift"', "VALUE"),
    ('"drift"', '"tide"'),
    ("@frozen\n", "@attrs.define\n"),
    ("@frozen\n", "\n"),
    ("@frozen\n", "@frozen(slots=False)\n"),
    ("[Drift]", "VALUE"),
    ("[Drift]", "[Drift, VALUE]"),
    ("[Drift]", "[Drift, Drift]"),
    ("[Drift]", "(1 / 0 for each in range(3))"),
    ("[Drift]", "[type(vedette.Sensor)('Odd', (), {'kind': VALUE})]"),
    ("vedette_components()", "vedette_components(VALUE_NAME)"),
    ("@vedette.plugin\n", ""),
    ('fields.quantity("m/s", "speed of the water", at_least=0)', "VALUE"),
    ('"speed of the water", at_least=0', '"speed of the water", default=VALUE'),
    ("-> vedette.Space", "-> 'Nowhere'"),
    ("current: float", "current: 'Nowhere'"),
    ("vedette.MotionModel", "vedette.Sensor"),
    ("vedette.MotionModel", "(vedette.MotionModel, vedette.Sensor)"),
    ("vedette.MotionModel", "object"),
    ("import attrs\n", "import attrs, nothing_of_this_name\n"),
    ("import attrs\n", "import attrs\nraise SystemExit(3)\n"),
    ("    def noise(", "    def settle(self, own, combined): ...\n\n    def noise("),
    ("    def noise(", "    def __init_subclass__(cls): raise RuntimeError('no')\n\n    def noise("),
]


@frozen
class Point:
    """An entry point of a distribution that is not installed: its module is made of a source when it is loaded."""

    name: str
    source: str
    dist: Any = None

    def load(self) -> types.ModuleType:
        """Return the module; whatever the source raises is raised."""
        module = types.ModuleType(f"fuzzed_{self.name}")
        sys.modules[module.__name__] = module
        exec(compile(self.source, module.__name__, "exec"), module.__dict__)
        return module


def case(rng: np.random.Generator, folder: Path) -> str:
    """Load one plugin beside one that is right, and ask for what it would bring."""
    points = [Point("good", drifting("Tide", "tide")), Point("bad", drawn(rng))]
    installed = mock.patch.object(importlib.metadata, "entry_points", return_value=points)
    with installed, mock.patch.object(plugins, "_found", plugins._found.__wrapped__), mock.patch.dict(sys.modules):
        try:
            registry = Registry.installed()
        except PluginError as error:
            raise AssertionError(f"one plugin stops all: {error}") from error
    clash = any((clash.role, clash.kind) == ("motion", "tide") for clash in registry.clashes)
    assert (registry.find("motion", "tide") is None) == clash, "the plugin that is right is not used"
    assert all(map(len, registry.reasons()))
    try:
        registry.get("motion", "drift")
    except ConfigError:
        assert "drift" not in [entry.kind for entry in registry.of_role("motion")]
        return "set aside" if registry.broken else "other kinds"
    return "used"


def drawn(rng: np.random.Generator) -> str:
    """Return the source with one to three changes, or without one of its lines."""
    source = SOURCE
    for _ in range(int(rng.integers(1, 4))):
        if rng.random() < 0.2:
            lines = source.splitlines(keepends=True)
            del lines[int(rng.integers(len(lines)))]
            source = "".join(lines)
        else:
            old, new = pick(rng, CHANGES)
            source = source.replace(old, new.replace("VALUE_NAME", "given").replace("VALUE", value(rng)))
    return source


def value(rng: np.random.Generator) -> str:
    """Return the source of some value."""
    odd = [
        "vedette",
        "Drift" if rng.random() < 0.5 else "dict",
        "float('nan')",
        "lambda: 1",
        "object()",
        "...",
        "b'x'",
        "-1",
    ]
    return pick(rng, [*odd, repr(pick(rng, NASTY)).replace("nan", "float('nan')").replace("inf", "float('inf')")])
