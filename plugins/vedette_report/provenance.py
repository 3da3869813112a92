"""Which code makes a result: sources, kernels, libraries. What is kept, and what others make, can be of another one."""

from __future__ import annotations

import hashlib
import importlib.util
import json
import platform
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from vedette import Problem, Registry, kernels

ALWAYS = ("vedette", "vedette_standard", "vedette_files")
"""Packages that have a part in every result."""

TOLD = ("python", "machine")
"""What may differ, and is told: Python's own release, if its minor version is the same, and the processor."""

Identity = Mapping[str, str]


def packages_of(configs: Iterable[Any], *also: str) -> tuple[str, ...]:
    """Return the packages whose code makes the results of some configs: Vedette's own, those of their kinds, and `also`."""
    kinds = {kind for config in configs for kind in kinds_in(config)}
    brought = {entry.cls.__module__.partition(".")[0] for entry in Registry.installed() if entry.kind in kinds}
    return tuple(sorted(brought | {*ALWAYS, *also}))


@cache
def identity(packages: tuple[str, ...]) -> dict[str, str]:
    """Return what identifies the code here, of the packages that are given; as the process loaded it when first asked."""
    parts = {f"sources of {name}": sources(name) for name in packages}
    parts |= {"kernels": kernels.RUNNING, "build": kernels.BUILD}
    parts |= {name: version(name) for name in ("vedette", "numpy", "scipy")}
    return parts | {"python": platform.python_version(), "machine": platform.machine()}


def sources(package: str) -> str:
    """Return a hash of the Python files of a package, by their names and contents; "none" if it is not installed."""
    spec = importlib.util.find_spec(package)
    if spec is None or not (spec.submodule_search_locations or spec.origin):
        return "none"
    total = hashlib.sha256()
    folders = [Path(each) for each in spec.submodule_search_locations or ()]
    files = sorted((path.relative_to(folder).as_posix(), path) for folder in folders for path in folder.rglob("*.py"))
    for name, path in files or [(package, Path(str(spec.origin)))]:
        content = path.read_bytes().replace(b"\r\n", b"\n")
        total.update(f"{name} {len(content)}\n".encode() + content)
    return total.hexdigest()[:16]


def digest(made: Identity) -> str:
    """Return a short name of a code, of what must be equal alone."""
    equal = {name: value for name, value in made.items() if name not in TOLD} | {"python": _minor(made)}
    return hashlib.sha256(json.dumps(equal, sort_keys=True).encode()).hexdigest()[:16]


def differences(there: Identity, here: Identity, place: str) -> tuple[list[Problem], list[str]]:
    """Return what must be equal in two codes and is not, and in words what may differ and does."""
    refused, told = [], []
    for name, value in here.items():
        other = there.get(name)
        if other == value:
            continue
        if name in TOLD and (name != "python" or _minor(there) == _minor(here)):
            told.append(f"{place}: {name} is {other}, here it is {value}")
        else:
            refused.append(Problem(place, f"{name}: must be {value!r} as here, got {other!r}"))
    return refused, told


def kinds_in(config: Any) -> Iterator[str]:
    """Yield all kinds that a config names."""
    if isinstance(config, Mapping):
        if isinstance(config.get("kind"), str):
            yield config["kind"]
        for part in config.values():
            yield from kinds_in(part)
    elif isinstance(config, list | tuple):
        for part in config:
            yield from kinds_in(part)


def _minor(made: Identity) -> str:
    return ".".join(str(made.get("python", "")).split(".")[:2])
