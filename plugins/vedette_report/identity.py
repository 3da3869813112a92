"""The code that results are of: a study's chunks and a run that goes on are of one, unless another is accepted."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from typing import Any

from attrs import frozen

from vedette.errors import ConfigError, Problem
from vedette_report import provenance
from vedette_report.provenance import Identity, digest, identity, packages_of


@frozen
class Code:
    """The code that results are of: its packages, what identifies them here, and whether other code is accepted."""

    packages: tuple[str, ...]
    made: dict[str, str]
    accept: bool = False

    @classmethod
    def of(cls, configs: Iterable[Any], *also: str, accept: bool = False) -> Code:
        """Return the code here of some configs, and that of other packages which have a part in the results."""
        packages = packages_of(configs, "vedette_report", *also)
        return cls(packages, identity(packages), accept)

    @property
    def name(self) -> str:
        """Its short name."""
        return digest(self.made)


def differences(there: Identity, here: Identity, place: str) -> tuple[list[Problem], list[str]]:
    """Return what must be equal in two codes and is not, and in words what may differ and does."""
    refused, told = provenance.differences(there, here, place)
    return [Problem(problem.place, f"{problem.text}; see --accept-other-code") for problem in refused], told


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
