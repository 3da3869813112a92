"""The commands that run trackers many times: their options; the module of each does the work."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import ClassVar, final

from attrs import frozen

from vedette import Command
from vedette.commands import options
from vedette_report.drawing.canvas import add_pictures


@final
@frozen
class Study(Command):
    """Run a grid of trackers many times over.

    Runs every point of the grid many times on the same drawn scenes, and prints means with their standard errors and paired
    differences. With --out it keeps finished chunks, and --resume continues from them. --write stores the figures of each
    run, and --against compares with them, run by run: the exit code is 1 if one is worse than chance explains.
    """

    kind: ClassVar[str] = "study"

    def options(self, parser: ArgumentParser) -> None:
        parser.add_argument(
            "study", metavar="STUDY", help="a TOML, YAML or JSON file: experiment, runs, sweep, trackers, precision"
        )
        options.add_overrides(parser, "the study's experiment")
        parser.add_argument("--runs", metavar="N", help="runs at each point of the grid; default: the study's")
        parser.add_argument("--seed", metavar="N", help="seed of all random numbers; default: the study's")
        parser.add_argument("--chunk", metavar="N", help="runs that are computed together; default: the study's")
        parser.add_argument("--threads", metavar="N", help="chunks that run at once; default: the number of cores")
        parser.add_argument("--out", metavar="DIR", help="folder for finished chunks and results; default: none are kept")
        add_pictures(parser)
        parser.add_argument("--resume", action="store_true", help="continue the unfinished study in the folder --out")
        parser.add_argument(
            "--scheduler", metavar="ADDRESS", help="run on the Dask cluster of this scheduler, as tcp://host:8786"
        )
        parser.add_argument("--wait", metavar="S", help="seconds to wait for workers while there is none; default: 600")
        parser.add_argument(
            "--accept-other-code",
            action="store_true",
            help="take workers and finished chunks of other code, and record it",
        )
        parser.add_argument("--against", metavar="FILE", help="a judgement: exit with 1 if a figure is worse than it says")
        parser.add_argument("--write", metavar="FILE", help="store the figures of all runs as a new judgement")
        options.add_json(parser, "end standard output with one line of JSON: the tables")

    def run(self, arguments: Namespace) -> int:
        from vedette_study.commands import study

        return study.run(arguments)


@final
@frozen
class Reproduce(Command):
    """Reproduce a published study.

    Runs the whole study of a paper and prints its tables, published values beside measured ones, with a verdict on each
    claim: reproduced, not reproduced, not decided with this number of runs, or a remark. With --grid it judges the claims
    over a grid of what the paper leaves unsaid, and says where each holds. The exit code is 0 in any case.
    """

    kind: ClassVar[str] = "reproduce"

    def options(self, parser: ArgumentParser) -> None:
        names = "vts, target-oriented, bayes-risk, flir, marine, marine-pictures"
        about = f"the study, as `vedette components reproduction` lists them: {names}, or a plugin's"
        parser.add_argument("paper", metavar="PAPER", help=about)
        parser.add_argument("--runs", metavar="N", help="Monte-Carlo runs; default: the study's")
        parser.add_argument("--seed", metavar="N", help="seed of all random numbers; default: 1")
        parser.add_argument("--full", action="store_true", help="take the larger number of runs, however long it lasts")
        parser.add_argument("--grid", action="store_true", help="judge over a grid of what the paper leaves unsaid")
        parser.add_argument("--out", metavar="DIR", help="folder for tables and pictures; default: none are written")
        add_pictures(parser)
        parser.add_argument("--resume", action="store_true", help="continue the unfinished study in the folder --out")
        options.add_json(parser)

    def run(self, arguments: Namespace) -> int:
        from vedette_study.commands import reproduce

        return reproduce.run(arguments)
