"""The commands that say what is installed and test it, draft, explain and tune a config: options; each has its module."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import ClassVar, final

from attrs import frozen

from vedette import Command
from vedette.commands import options
from vedette_report.drawing.canvas import add_pictures

METHODS = ["nelder-mead", "powell", "l-bfgs-b"]


def _add_columns(parser: ArgumentParser) -> None:
    """Add what states the columns of a table, so that they need not be guessed."""
    parser.add_argument("--time", metavar="COLUMN", help="the column of the time; default: by its title")
    parser.add_argument("--rate", metavar="HZ", help="how many counts of the time's column, as frames, a second has")
    about = "columns by what they hold, as x=cx,y=cy,z=cz or latitude=phi,longitude=lambda"
    parser.add_argument("--columns", metavar="AXIS=COLUMN,...", help=about)
    about = "units of columns, as x=km,y=km, bearing=deg or x=px,y=px"
    parser.add_argument("--units", metavar="AXIS=UNIT,...", help=about)
    about = "how dates are written, as '%%d.%%m.%%Y %%H:%%M:%%S'; default: as most of them are"
    parser.add_argument("--dates", metavar="PATTERN", help=about)


@final
@frozen
class New(Command):
    """Draft a config for your data, or a plugin."""

    kind: ClassVar[str] = "new"

    def options(self, parser: ArgumentParser) -> None:
        drafts = parser.add_subparsers(dest="what", required=True, metavar="WHAT")
        about = (
            "Read a file of returns; guess its columns, units, scan interval and noise; try the config on the file, with "
            "alternatives; write the best, with a comment on each guess. Ends with exit code 3 if none fits. Of a video, "
            "the targets are found where they stand out, or those in --box or drawn with --pick are followed."
        )
        config = drafts.add_parser("config", help="a config that tracks the targets of a file", description=about)
        about = "a CSV, Parquet, JSON or GPX file with a row or record for each return, a video, or a folder of images"
        config.add_argument("data", metavar="DATA", help=about)
        about = "a target's box in the first frame of a video, in px; once for each; default: targets are found"
        config.add_argument("--box", metavar="X,Y,W,H", action="append", default=[], help=about)
        about = "draw the boxes of targets in the first frame of a video, on a page of this machine"
        config.add_argument("--pick", action="store_true", help=about)
        config.add_argument("--out", metavar="FILE", help="the config; default: the data's name with .toml, in this folder")
        _add_columns(config)
        config.add_argument(
            "--scan",
            metavar="COLUMN",
            help="the column that numbers scans; `time`: rows of one time are one; `row`: each row is",
        )
        config.add_argument("--platform", metavar="FILE", help="the file of own ship's positions, in the data's folder")
        about = (
            "what names of objects in the file are: known to the tracker, to judge its tracks by, or nothing; default: aid"
        )
        config.add_argument("--identity", choices=["aid", "truth", "ignore"], default="aid", help=about)
        about = (
            "Write a Python package with a working component of one role, the test of all laws of that role, and the entry "
            "point."
        )
        package = drafts.add_parser("plugin", help="a Python package with one component and its tests", description=about)
        package.add_argument("name", metavar="NAME", help="name of the plugin: one word")
        roles = ("motion", "sensor", "associator", "estimator", "birth", "lifecycle")
        package.add_argument("--role", choices=roles, default="motion", help="role of its component; default: motion")
        package.add_argument("--out", metavar="DIR", help="folder for the package; default: vedette-NAME")

    def run(self, arguments: Namespace) -> int:
        from vedette_tools.commands import new

        return new.run(arguments)


@final
@frozen
class Explain(Command):
    """Say what a config composes and what is out of proportion.

    Says in plain words which gates, errors and track lives follow from a config. Reads the first scans of the source, and
    tracks nothing.
    """

    kind: ClassVar[str] = "explain"

    def options(self, parser: ArgumentParser) -> None:
        options.add_config(parser)
        about = "time between scans, as in '2.5 s'; default: that of the source"
        parser.add_argument("--interval", metavar="TIME", help=about)
        options.add_json(parser)

    def run(self, arguments: Namespace) -> int:
        from vedette_tools.commands import explain

        return explain.run(arguments)


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
        from vedette_tools.commands import components

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
        from vedette_tools.commands import check

        return check.run(arguments)


@final
@frozen
class Schema(Command):
    """Print the JSON Schema of all that is installed, for editors that complete and check a config."""

    kind: ClassVar[str] = "schema"

    def run(self, arguments: Namespace) -> int:
        from vedette_tools.commands import schema

        return schema.run(arguments)


@final
@frozen
class Completions(Command):
    """Print a script that completes commands in a shell.

    In bash: eval "$(vedette completions bash)".
    """

    kind: ClassVar[str] = "completions"

    def options(self, parser: ArgumentParser) -> None:
        parser.add_argument("shell", metavar="SHELL", choices=["bash", "zsh", "fish"], help="bash, zsh or fish")

    def run(self, arguments: Namespace) -> int:
        from vedette_tools.commands import completions

        return completions.run(arguments)


@final
@frozen
class Smooth(Command):
    """Clean and smooth positions that bear the names of their objects.

    One object a name, each with the noise and the agility that suit it: positions that cannot be right are marked and not
    used, long gaps split a path. The same columns come back, with speeds, courses and deviations.
    """

    kind: ClassVar[str] = "smooth"

    def options(self, parser: ArgumentParser) -> None:
        about = "CSV or Parquet files with a header and a row for each report of a time and a position; folders of Parquet"
        parser.add_argument("data", metavar="FILE", nargs="+", help=about)
        about = "the column that names objects; default: one whose title says so, such as mmsi or icao24"
        parser.add_argument("--by", metavar="COLUMN", help=about)
        about = "how far apart positions are to be, as in '10 s'; default: at the times of the rows"
        parser.add_argument("--every", metavar="TIME", help=about)
        about = "longest time without a report in one piece of a path; default: 20 times the object's usual one"
        parser.add_argument("--gap", metavar="TIME", help=about)
        _add_columns(parser)
        about = "the file to write, or of Parquet a folder; default: the data's name with -smoothed, in this folder"
        parser.add_argument("--out", metavar="FILE", help=about)
        parser.add_argument("--workers", metavar="N", help="number of processes; it changes no result; default: all cores")
        about = "address of a Dask scheduler, whose workers see the folder of --out"
        parser.add_argument("--scheduler", metavar="ADDRESS", help=about)
        options.add_json(parser, "end standard output with one line of JSON: what was done")

    def run(self, arguments: Namespace) -> int:
        from vedette_tools.commands import smooth

        return smooth.run(arguments)


@final
@frozen
class Tune(Command):
    """Estimate parameters from a recording without truth.

    Finds the parameters of greatest likelihood given a recording's returns, on the first part of the scans; tests them on
    the rest; states the error of each, and whether Q or R was wrong. Writes a config that runs. After Ctrl-C, --resume
    continues.
    """

    kind: ClassVar[str] = "tune"

    def options(self, parser: ArgumentParser) -> None:
        options.add_config(parser)
        parser.add_argument(
            "--free",
            nargs="+",
            action="extend",
            default=[],
            metavar="PATH.TO.KEY=LOW..HIGH",
            help="parameters to tune, with ranges: estimator.motion.sigma_accel=0.01..10; default: a tenth to ten times",
        )
        about = (
            "find this sensor's detection probability by range and bearing, in so many rows and columns, instead of free "
            "parameters; default: 4x8, or the cells that its table has"
        )
        parser.add_argument("--detection", metavar="SENSORS.NAME[=4x8]", help=about)
        parser.add_argument(
            "--part", default="0.5", metavar="P", help="fraction of the scans to tune on, from the first on; default: 0.5"
        )
        parser.add_argument(
            "--by", default="likelihood", choices=["likelihood", "consistency"], help="the criterion; default: likelihood"
        )
        about = "number of searches; the first starts at the config's values; default: 3"
        parser.add_argument("--starts", default="3", metavar="N", help=about)
        parser.add_argument("--method", default=METHODS[0], choices=METHODS, help="search method; default: nelder-mead")
        about = "number of processes; it changes no result; default: 1"
        parser.add_argument("--workers", default="1", metavar="N", help=about)
        options.add_seed(parser)
        parser.add_argument("--out", metavar="DIR", help="folder for config, results and picture; default: out/NAME-tuned")
        parser.add_argument("--resume", action="store_true", help="continue the unfinished tuning in the folder --out")
        options.add_json(parser, "end standard output with one line of JSON: the results")
        add_pictures(parser)

    def run(self, arguments: Namespace) -> int:
        from vedette_tools.commands import tune

        return tune.run(arguments)
