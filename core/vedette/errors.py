"""What can go wrong: each error names the place, what is wrong there and what would be right."""

from __future__ import annotations

from collections.abc import Iterable

from attrs import frozen

LATE = "late"
"""The kind of what is of a time before one that was used."""


@frozen
class Problem:
    """Something in a config or an input that was not used: its place, and what is wrong with it.

    rows: of how many rows of a file; kind: a word for what asks for an answer of its own, as LATE.
    """

    place: str
    text: str
    rows: int = 1
    kind: str = ""

    def __str__(self) -> str:
        return f"{self.place}: {self.text}" if self.place else self.text


class VedetteError(Exception):
    """The base of all errors that the user can put right; a command prints them without a traceback."""


class ConfigError(VedetteError, ValueError):
    """A config that cannot be built: all its problems at once."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = tuple(problems)
        super().__init__("\n".join(map(str, self.problems)))

    @classmethod
    def at(cls, place: str, text: str) -> ConfigError:
        """Return one problem, at `place`."""
        return cls([Problem(place, text)])

    def within(self, place: str) -> ConfigError:
        """Return the same problems for a part at `place`."""
        return ConfigError(Problem(f"{place}.{problem.place}", problem.text) for problem in self.problems)


class InputError(VedetteError, ValueError):
    """An input that cannot be used at all: a missing file, a wrong header, another format."""


class ScanRefused(VedetteError, ValueError):
    """A scan that the tracker did not accept; the tracker is as it was before."""


class PluginError(VedetteError):
    """A plugin that breaks the contract: a kind that is taken, a class that is incomplete."""
