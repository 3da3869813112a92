"""What was asked for on the command line, read; what cannot be read is told with the name of its option."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable
from typing import TypeVar

from vedette.errors import ConfigError, Problem

Read = TypeVar("Read")


def overrides(arguments: Namespace) -> list[str]:
    """Return the overrides of --set, with --seed as the last of them."""
    return [*arguments.overrides, *([] if arguments.seed is None else [f"seed={arguments.seed}"])]


def read(option: str, given: str | None, reader: Callable[[str], Read]) -> Read | None:
    """Return what the `reader` makes of an option, None if it was not given; ConfigError for its ValueError."""
    try:
        return None if given is None else reader(given)
    except ValueError as error:
        raise ConfigError([Problem(option, str(error))]) from None


def whole(option: str, given: str | None, usual: int, least: int = 0, most: int | None = None) -> int:
    """Return a whole number, `usual` if none was given; ConfigError if it is not one, too small or too large."""
    if given is None:
        return usual
    if not given.isdecimal() or int(given) < least or (most is not None and int(given) > most):
        range_ = f"of at least {least}" if most is None else f"from {least} to {most}"
        raise ConfigError([Problem(option, f"must be a whole number {range_}, got {given!r}")])
    return int(given)


def number(option: str, given: str) -> float:
    """Return a number; ConfigError if it is none."""
    try:
        return float(given)
    except ValueError:
        raise ConfigError([Problem(option, f"must be a number, got {given!r}")]) from None
