"""Options that several commands have, and how their values are read; what cannot be read is told with the option's name."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from typing import TypeVar

from vedette.errors import ConfigError

Read = TypeVar("Read")


def add_config(parser: ArgumentParser, *, optional: bool = False) -> None:
    """Add CONFIG, and --set for it."""
    about = "a TOML, YAML or JSON file that describes tracker and source"
    parser.add_argument("config", metavar="CONFIG", nargs="?" if optional else None, help=about)
    add_overrides(parser, "the config")


def add_overrides(parser: ArgumentParser, changed: str) -> None:
    """Add --set, which changes what is `changed`."""
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        dest="overrides",
        metavar="PATH.TO.KEY=VALUE",
        help=f"change {changed}, as in source.path=data or estimator.modes[1].motion.sigma_accel=0.2; may be repeated",
    )


def add_seed(parser: ArgumentParser) -> None:
    """Add --seed for a config."""
    parser.add_argument("--seed", metavar="N", help="seed of all random numbers; the same as --set seed=N")


def add_json(parser: ArgumentParser, what: str = "end standard output with one line of JSON") -> None:
    """Add --json."""
    parser.add_argument("--json", action="store_true", help=what)


def overrides(arguments: Namespace) -> list[str]:
    """Return the overrides of --set, with --seed as the last of them."""
    return [*arguments.overrides, *([] if arguments.seed is None else [f"seed={arguments.seed}"])]


def read(option: str, given: str | None, reader: Callable[[str], Read]) -> Read | None:
    """Return what the `reader` makes of an option, None if it was not given; ConfigError for its ValueError."""
    try:
        return None if given is None else reader(given)
    except ValueError as error:
        raise ConfigError.at(option, str(error)) from None


def whole(option: str, given: str | None, usual: int, least: int = 0, most: int | None = None) -> int:
    """Return a whole number, `usual` if none was given; ConfigError if it is not one, too small or too large."""
    if given is None:
        return usual
    if not given.isdecimal() or int(given) < least or (most is not None and int(given) > most):
        range_ = f"of at least {least}" if most is None else f"from {least} to {most}"
        raise ConfigError.at(option, f"must be a whole number {range_}, got {given!r}")
    return int(given)
