"""The core's own plugin: the commands that say what is installed and test it."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Iterable
from typing import ClassVar, final

from attrs import frozen

from vedette.commands import options
from vedette.config.hooks import plugin
from vedette.roles import Component
from vedette.supporting import Command

VEDETTE_CONTRACT = 2


@final
@frozen
class Components(Command):
    """List what is installed, with parameters, units and defaults.

    Prints one line for each kind. With a role, a kind or a table, describes it in full: distribution, and parameters with
    units, bounds and defaults.
    """

    kind: ClassVar[str] = "components"

    def options(self, parser: ArgumentParser) -> None:
        parser.add_argument(
            "wanted",
            nargs="?",
            metavar="ROLE_OR_KIND",
            help="describe this role, kind or table in full: motion, ekf, gate, ...",
        )
        options.add_json(parser, "print one JSON object")

    def run(self, arguments: Namespace) -> int:
        from vedette.commands import components

        return components.run(arguments)


@final
@frozen
class Check(Command):
    """Test a component against the laws of its role.

    Parameters are drawn within their limits. Prints which laws held, which failed and for which example, and which did not
    apply. Exit code 1 if one failed. Needs vedette[testing].
    """

    kind: ClassVar[str] = "check"

    def options(self, parser: ArgumentParser) -> None:
        parser.add_argument("subject", metavar="WHAT", help="an installed kind, a module, module:Class, or a config's file")
        parser.add_argument("--config", metavar="FILE", help="check the kind with the parameters that it has in this config")
        options.add_overrides(parser, "the config")
        parser.add_argument(
            "--profile", default="fast", choices=["fast", "nightly"], help="how thoroughly to test; default: fast"
        )
        parser.add_argument("--law", metavar="NAME", help="try this law alone")
        parser.add_argument("--replay", metavar="CODE", default="", help="with --law: the one example that failed")
        parser.add_argument("--seconds", metavar="S", type=float, help="CPU time that a law may take; default: 60")
        parser.add_argument("--seed", metavar="N", type=int, default=0, help="seed of all random numbers; default: 0")
        options.add_json(parser)

    def run(self, arguments: Namespace) -> int:
        from vedette.commands import check

        return check.run(arguments)


@final
@frozen
class Info(Command):
    """Show which kernels, libraries and plugins are used, with their versions, and why."""

    kind: ClassVar[str] = "info"

    def options(self, parser: ArgumentParser) -> None:
        options.add_json(parser, "print one JSON object")

    def run(self, arguments: Namespace) -> int:
        from vedette.commands import info

        return info.run(arguments)


@final
@frozen
class Schema(Command):
    """Print the JSON Schema of all that is installed, for editors that complete and check a config."""

    kind: ClassVar[str] = "schema"

    def run(self, arguments: Namespace) -> int:
        from vedette.commands import schema

        return schema.run(arguments)


@plugin
def vedette_components() -> Iterable[type[Component]]:
    """Return the core's commands."""
    return [Check, Components, Info, Schema]
