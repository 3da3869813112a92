"""The core's own plugin, `vedette info`: what runs here, and why. It is asked when other plugins cannot be used."""

from __future__ import annotations

import json
import platform
from argparse import ArgumentParser, Namespace
from collections import Counter
from collections.abc import Iterable
from importlib.metadata import PackageNotFoundError, version
from typing import ClassVar, final

from attrs import frozen

from vedette import kernels, values
from vedette.commands import options
from vedette.config.hooks import plugin
from vedette.config.registry import Registry
from vedette.roles import Component
from vedette.supporting import Command

VEDETTE_CONTRACT = 2

_LIBRARIES = ("numpy", "scipy", "attrs", "pluggy", "shtab", "opencv-python-headless", "matplotlib", "xarray", "dask")


@final
@frozen
class Info(Command):
    """Show which kernels, libraries and plugins are used, with their versions, and why."""

    kind: ClassVar[str] = "info"

    def options(self, parser: ArgumentParser) -> None:
        options.add_json(parser, "print one JSON object")

    def run(self, arguments: Namespace) -> int:
        registry = Registry.installed()
        facts = {
            "vedette": version("vedette"),
            "python": f"{platform.python_version()} on {platform.machine()}",
            "kernels": kernels.RUNNING,
            "values": "made by compiled code" if values.COMPILED else "made by Python",
            "libraries": {name: installed for name in _LIBRARIES if (installed := _version(name)) is not None},
            "plugins": _plugins(registry),
            "unused": registry.reasons(),
        }
        if arguments.json:
            print(json.dumps(facts))
            return 0
        for name, fact in facts.items():
            for line in fact if isinstance(fact, list) else [fact]:
                told = ", ".join(f"{part} {what}" for part, what in line.items()) if isinstance(line, dict) else line
                print(f"{name + ':':11}{told}")
        return 0


@plugin
def vedette_components() -> Iterable[type[Component]]:
    """Return the core's command."""
    return [Info]


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _plugins(registry: Registry) -> dict[str, str]:
    """Return the number of components of each distribution."""
    counts = Counter(entry.distribution for entry in registry)
    return {name: f"({count} component{'s' * (count > 1)})" for name, count in counts.items()}
