"""The command `vedette`: its arguments and how it ends. docs/command-line.md describes it.

Exit codes: 0 done; 1 a law failed (`check`);
2 wrong use, config or input, reported without a traceback; 130 interrupted; 141 the reader closed the pipe.
"""

from __future__ import annotations

import gc
import os
import sys
from argparse import Action, ArgumentParser, Namespace
from collections.abc import Iterator, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from vedette.commands import about
from vedette.commands.ending import CLOSED, INTERRUPTED, complain, ended
from vedette.commands.parser import Parser
from vedette.commands.report_options import add_report_options
from vedette.commands.tune_options import ABOUT, add_options
from vedette.errors import VedetteError


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code. SystemExit only from argparse: for --help, --version and wrong use."""
    _open_streams()
    if arguments is None:
        # a process of its own makes few cycles, and looking for them among all that is imported is a tenth of a short run
        gc.set_threshold(100_000, 20, 20)
    parsed = _parser().given(list(_values_joined(sys.argv[1:] if arguments is None else arguments)))
    try:
        code = _command(parsed)
        sys.stdout.flush()
    except VedetteError as error:
        return ended(error, str(error), traceback=parsed.traceback)
    except BrokenPipeError:
        _forget_stdout()
        return CLOSED
    except UnicodeEncodeError as error:
        part = ascii(error.object[error.start : error.end])
        return complain(f"{part} cannot be written in {error.encoding}: a name in another encoding? LANG=C.UTF-8 reads more")
    except OSError as error:
        return complain(f"{error.filename or 'a file or the output'}: {error.strerror or error}")
    except KeyboardInterrupt:
        print("vedette: interrupted", file=sys.stderr)
        return INTERRUPTED
    except (Exception, SystemExit) as error:  # a component that ends the process is told as one that raises
        from vedette.tracking.faults import raised_by

        if (text := raised_by(error, None)) is None:
            raise
        return ended(error, text, traceback=parsed.traceback)
    return code


def _values_joined(arguments: Sequence[str]) -> Iterator[str]:
    """Yield the arguments with `--origin -33.8,151.2` as one: argparse takes what begins with a minus for an option."""
    waiting = ""
    for argument in arguments:
        if waiting and argument[:1] == "-" and argument[1:2].isdigit():
            yield f"{waiting}={argument}"
            waiting = ""
            continue
        if waiting:
            yield waiting
        waiting = argument if argument.startswith("--") and "=" not in argument else ""
        if not waiting:
            yield argument
    if waiting:
        yield waiting


def _command(parsed: Namespace) -> int:
    """Run the requested command and import no other: help comes at once, and each needs only its own imports."""
    command = import_module(f"vedette.commands.{parsed.command}")
    code: int = command.run(parsed)
    return code


def _open_streams() -> None:
    """Write nowhere what is meant for a stream that the caller has closed."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, Path(os.devnull).open("w", encoding="utf-8"))  # noqa: SIM115


def _forget_stdout() -> None:
    """Write nowhere from now on: the reader closed the pipe, as `| head` does, and nothing is wrong."""
    try:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except (OSError, ValueError):
        return


class _Version(Action):
    """Looks the version up only when it is requested."""

    def __call__(self, parser: ArgumentParser, *_: Any) -> None:
        from importlib.metadata import version

        print(f"vedette {version('vedette')}")
        parser.exit()


def _parser() -> Parser:
    parser = Parser("vedette", description="Compose target trackers from small parts and run them.")
    parser.add_argument("--version", action=_Version, nargs=0, help="show the version and exit")
    parser.add_argument("--traceback", action="store_true", help="show where in the code an error came from")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    parser.below = commands.choices

    run = commands.add_parser("run", help="run a tracker on a recording or a simulated scene", description=about.RUN)
    run.add_argument("config", metavar="CONFIG", help="a TOML, YAML or JSON file that describes tracker and source")
    _takes_overrides(run, "the config")
    run.add_argument("--out", metavar="DIR", help="folder for the results; default: out/ and the config's name")
    run.add_argument("--seed", metavar="N", help="seed of all random numbers; the same as --set seed=N")
    run.add_argument("--json", action="store_true", help="end standard output with one line of JSON: the results")
    run.add_argument(
        "--smooth",
        nargs="?",
        const="",
        metavar="LAG",
        help="also smooth the tracks, with all later scans, or with those within LAG, as in --smooth '10 s'",
    )
    run.add_argument("--strict", action="store_true", help="stop at the first bad scan or return")
    run.add_argument(
        "--stream",
        action="store_true",
        help="write results during the run and keep no history in memory; default for more than 10,000 scans",
    )
    run.add_argument("--report", action="store_true", help="also write report.html, a page that shows the run")
    _draws(run)
    run.add_argument("--keep", action="store_true", help="keep the history of a long run in memory, for its pictures")

    watch = commands.add_parser("watch", help="run a tracker and show it live", description=about.WATCH)
    watch.add_argument("config", metavar="CONFIG", help="a TOML, YAML or JSON file that describes tracker and source")
    _takes_overrides(watch, "the config")
    watch.add_argument("--speed", metavar="X", help="times as fast as recorded, or max: as fast as possible; default: 1")
    watch.add_argument("--terminal", action="store_true", help="show the run in this terminal instead of in a browser")
    watch.add_argument("--out", metavar="DIR", help="also write what `vedette run --stream` writes into this folder")
    watch.add_argument("--seed", metavar="N", help="seed of all random numbers; the same as --set seed=N")
    watch.add_argument("--port", metavar="N", help="port of the page; default: any free port")
    watch.add_argument("--underlay", metavar="FILE", help="GeoJSON under the map: in deg if the origin is known, else in m")
    watch.add_argument("--json", action="store_true", help="end standard output with one line of JSON")

    new = commands.add_parser("new", help="draft a config for your data, or a plugin", description=about.NEW)
    drafts = new.add_subparsers(dest="what", required=True, metavar="WHAT")
    draft = drafts.add_parser("config", help="a config that tracks the targets of a file", description=about.NEW_CONFIG)
    draft.add_argument("data", metavar="DATA", help="a CSV or Parquet file with a header and one row for each return")
    draft.add_argument("--out", metavar="FILE", help="the config; default: the data's name with .toml, in this folder")
    package = drafts.add_parser(
        "plugin", help="a Python package with one component and its tests", description=about.NEW_PLUGIN
    )
    package.add_argument("name", metavar="NAME", help="name of the plugin: one word")
    roles = ("motion", "sensor", "associator", "estimator", "birth", "lifecycle")
    package.add_argument("--role", choices=roles, default="motion", help="role of its component; default: motion")
    package.add_argument("--out", metavar="DIR", help="folder for the package; default: vedette-NAME")

    explain = commands.add_parser(
        "explain", help="say what a config composes and what is out of proportion", description=about.EXPLAIN
    )
    explain.add_argument("config", metavar="CONFIG", help="a TOML, YAML or JSON file that describes tracker and source")
    _takes_overrides(explain, "the config")
    explain.add_argument("--interval", metavar="TIME", help="time between scans, as in '2.5 s'; default: that of the source")
    explain.add_argument("--json", action="store_true", help="end standard output with one line of JSON")

    tune = commands.add_parser("tune", help="estimate parameters from a recording without truth", description=ABOUT)
    add_options(tune)
    _takes_overrides(tune, "the config")
    _draws(tune)

    report = commands.add_parser(
        "report", help="write a page that shows a run, several runs, or a study", description=about.REPORT
    )
    add_report_options(report)

    export = commands.add_parser("export", help="write the tracks of a run for another program", description=about.EXPORT)
    export.add_argument("run", metavar="RUN_DIR", help="the folder that `vedette run` wrote")
    export.add_argument("--to", metavar="FILE", required=True, help="the file: .kml, .geojson, .csv, .parquet or .rrd")
    export.add_argument("--origin", metavar="LAT,LON", help="where x and y are 0, in deg; default: as recorded")
    export.add_argument("--epoch", metavar="DATE", help="date of time 0, as in 2024-05-01T12:00:00Z, if the run has none")
    export.add_argument("--ellipses", metavar="N", default="50", help="at most N ellipses for each track; default: 50")
    export.add_argument(
        "--lasting", metavar="TIME", help="only tracks that lived this long after they were confirmed, as in '30 s'"
    )
    export.add_argument(
        "--covering", action="store_true", help="only tracks that covered a true object, hence no false tracks"
    )
    export.add_argument("--smoothed", action="store_true", help="write the smoothed tracks that `vedette run --smooth` made")

    reproduce = commands.add_parser("reproduce", help="reproduce a published study", description=about.REPRODUCE)
    reproduce.add_argument("paper", metavar="PAPER", help="the study: vts, target-oriented, bayes-risk, or a plugin's")
    reproduce.add_argument("--runs", metavar="N", help="Monte-Carlo runs; default: the study's")
    reproduce.add_argument("--seed", metavar="N", help="seed of all random numbers; default: 1")
    reproduce.add_argument("--full", action="store_true", help="take the larger number of runs, however long it lasts")
    reproduce.add_argument("--out", metavar="DIR", help="folder for tables and pictures; default: none are written")
    _draws(reproduce)
    reproduce.add_argument("--resume", action="store_true", help="continue the unfinished study in the folder --out")
    reproduce.add_argument("--json", action="store_true", help="end standard output with one line of JSON")

    study = commands.add_parser("study", help="run a grid of trackers many times over", description=about.STUDY)
    study.add_argument(
        "study", metavar="STUDY", help="a TOML, YAML or JSON file: experiment, runs, sweep, trackers, precision"
    )
    _takes_overrides(study, "the study's experiment")
    study.add_argument("--runs", metavar="N", help="runs at each point of the grid; default: the study's")
    study.add_argument("--seed", metavar="N", help="seed of all random numbers; default: the study's")
    study.add_argument("--chunk", metavar="N", help="runs that are computed together; default: the study's")
    study.add_argument("--threads", metavar="N", help="chunks that run at once; default: the number of cores")
    study.add_argument("--out", metavar="DIR", help="folder for finished chunks and results; default: none are kept")
    _draws(study)
    study.add_argument("--resume", action="store_true", help="continue the unfinished study in the folder --out")
    study.add_argument(
        "--scheduler", metavar="ADDRESS", help="run on the Dask cluster of this scheduler, as tcp://host:8786"
    )
    study.add_argument("--json", action="store_true", help="end standard output with one line of JSON: the tables")

    components = commands.add_parser("components", help="list what is installed", description=about.COMPONENTS)
    components.add_argument(
        "wanted", nargs="?", metavar="ROLE_OR_KIND", help="describe this role, kind or table in full: motion, ekf, gate, ..."
    )
    components.add_argument("--json", action="store_true", help="print one JSON object")

    check = commands.add_parser("check", help="test a component against the laws of its role", description=about.CHECK)
    check.add_argument("subject", metavar="WHAT", help="an installed kind, a module, module:Class, or a config's file")
    check.add_argument("--config", metavar="FILE", help="check the kind with the parameters that it has in this config")
    _takes_overrides(check, "the config")
    check.add_argument(
        "--profile", default="fast", choices=["fast", "nightly"], help="how thoroughly to test; default: fast"
    )
    check.add_argument("--seed", metavar="N", type=int, default=0, help="seed of all random numbers; default: 0")
    check.add_argument("--json", action="store_true", help="end standard output with one line of JSON")

    consistency = commands.add_parser(
        "consistency", help="report whether a tracker's covariances fit a recording", description=about.CONSISTENCY
    )
    consistency.add_argument("config", metavar="CONFIG", help="a TOML, YAML or JSON file that describes tracker and source")
    _takes_overrides(consistency, "the config")
    consistency.add_argument("--seed", metavar="N", help="seed of all random numbers; the same as --set seed=N")
    consistency.add_argument("--out", metavar="DIR", help="folder for text, JSON and picture; default: none are written")
    _draws(consistency)
    consistency.add_argument("--json", action="store_true", help="end standard output with one line of JSON")

    info = commands.add_parser("info", help="show which kernels, libraries and plugins are used", description=about.INFO)
    info.add_argument("--json", action="store_true", help="print one JSON object")

    completions = commands.add_parser(
        "completions", help="print a script that completes commands in a shell", description=about.COMPLETIONS
    )
    completions.add_argument("shell", metavar="SHELL", choices=["bash", "zsh", "fish"], help="bash, zsh or fish")
    completions.set_defaults(parser=parser)

    commands.add_parser("schema", help="print the JSON Schema of configs", description=about.SCHEMA)
    return parser


def _takes_overrides(command: ArgumentParser, changed: str) -> None:
    command.add_argument(
        "--set",
        action="append",
        default=[],
        dest="overrides",
        metavar="PATH.TO.KEY=VALUE",
        help=f"change {changed}, as in source.path=data or estimator.modes[1].motion.sigma_accel=0.2; may be repeated",
    )


def _draws(command: ArgumentParser) -> None:
    command.add_argument(
        "--format", default="png", choices=["png", "svg", "pdf"], help="format of the pictures; default: png"
    )
    command.add_argument(
        "--columns",
        default="screen",
        choices=["screen", "one", "two"],
        help="size of the pictures: for a screen, or for one or two columns of a paper; default: screen",
    )
    command.add_argument("--style", metavar="FILE", help="a matplotlib style file, applied after Vedette's own")
