"""Which code makes a result: sources, kernels, libraries. A study is of one code, and so is a run that goes on."""

from __future__ import annotations

import hashlib
import importlib.util
import json
import platform
import sys
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from attrs import frozen

from vedette import kernels
from vedette.config import Registry
from vedette.errors import ConfigError, Problem

ALWAYS = ("vedette", "vedette_standard", "vedette_files", "vedette_report")
"""Packages without which nothing runs."""

TOLD = ("python", "machine")
"""What may differ, and is told: Python's own release, if its minor version is the same, and the processor."""

Identity = Mapping[str, str]


def packages_of(configs: Iterable[Any], registry: Registry | None = None, more: Iterable[str] = ()) -> tuple[str, ...]:
    """Return the packages whose code makes the results of some configs: Vedette's own, `more`, and those of their kinds."""
    registry = Registry.installed() if registry is None else registry
    kinds = {kind for config in configs for kind in kinds_in(config)}
    brought = {entry.cls.__module__.partition(".")[0] for entry in registry if entry.kind in kinds}
    return tuple(sorted(brought | {*ALWAYS, *more}))


@cache
def identity(packages: tuple[str, ...]) -> dict[str, str]:
    """Return what identifies the code here, of the packages that are given; as the process loaded it when first asked."""
    found = {f"sources of {name}": sources(name) for name in packages}
    found |= {"kernels": kernels.RUNNING, "build": kernels.BUILD}
    found |= {name: version(name) for name in ("vedette", "numpy", "scipy")}
    return found | {"python": platform.python_version(), "machine": platform.machine()}


def sources(package: str) -> str:
    """Return a hash of the Python files of a package, by their names and contents; "none" if it is not installed."""
    found = importlib.util.find_spec(package)
    if found is None or not (found.submodule_search_locations or found.origin):
        return "none"
    total = hashlib.sha256()
    folders = [Path(each) for each in found.submodule_search_locations or ()]
    files = sorted((path.relative_to(folder).as_posix(), path) for folder in folders for path in folder.rglob("*.py"))
    for name, path in files or [(package, Path(str(found.origin)))]:
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
            refused.append(Problem(place, f"{name}: must be {value!r} as here, got {other!r}; see --accept-other-code"))
    return refused, told


@frozen
class Code:
    """The code that results are of: its packages, what identifies them here, and whether other code is accepted."""

    packages: tuple[str, ...]
    made: dict[str, str]
    accept: bool = False

    @classmethod
    def of(cls, configs: Iterable[Any], *, accept: bool = False, more: Iterable[str] = ()) -> Code:
        """Return the code here of some configs, and of `more` packages."""
        packages = packages_of(configs, more=more)
        return cls(packages, identity(packages), accept)

    @property
    def name(self) -> str:
        """Its short name."""
        return digest(self.made)


def tell(texts: Iterable[str]) -> None:
    """Print notes, each once, on standard error."""
    for text in dict.fromkeys(texts):
        print(f"vedette: note: {text}", file=sys.stderr)


def check(there: Identity, here: Identity, place: str, *, accept: bool) -> list[str]:
    """Return what is to be told of another code; ConfigError if it is refused, that is, unless `accept`."""
    refused, told = differences(there, here, place)
    if refused and not accept:
        raise ConfigError(refused)
    return [*map(str, refused), *told]


def kinds_in(config: Any) -> Iterator[str]:
    """Yield all kinds that a config names."""
    if isinstance(config, Mapping):
        if isinstance(config.get("kind"), str):
            yield config["kind"]
        for each in config.values():
            yield from kinds_in(each)
    elif isinstance(config, list | tuple):
        for each in config:
            yield from kinds_in(each)


def _minor(made: Identity) -> str:
    return ".".join(str(made.get("python", "")).split(".")[:2])
