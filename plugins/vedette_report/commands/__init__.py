"""The commands that run a tracker and show what came out: their options; the module of each does the work."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import ClassVar, final

from attrs import frozen

from vedette import Command
from vedette.commands import options
from vedette_report.drawing.canvas import add_pictures


@final
@frozen
class Run(Command):
    """Run a tracker on a recording or a simulated scene.

    Runs it over all scans of its source, compares the tracks with the truth where it is known, and writes tracks, recording,
    config, summary and pictures into a folder. Ctrl-C ends the run and keeps the results so far.
    """

    kind: ClassVar[str] = "run"

    def options(self, parser: ArgumentParser) -> None:
        options.add_config(parser, optional=True)
        parser.add_argument("--out", metavar="DIR", help="folder for the results; default: out/ and the config's name")
        about = "go on from the streamed run in DIR that was killed; needs no CONFIG"
        parser.add_argument("--resume", metavar="DIR", help=about)
        about = "go on although Vedette, a plugin or a library is another one than before: the results are mixed"
        parser.add_argument("--accept-other-code", action="store_true", help=about)
        options.add_seed(parser)
        options.add_json(parser, "end standard output with one line of JSON: the results")
        parser.add_argument(
            "--smooth",
            nargs="?",
            const="",
            metavar="LAG",
            help="also smooth the tracks, with all later scans, or with those within LAG, as in --smooth '5 s'",
        )
        parser.add_argument("--strict", action="store_true", help="stop at the first bad scan or return")
        parser.add_argument(
            "--stream",
            action="store_true",
            help="write results during the run, smoothed ones too, and keep no history; default for more than 10,000 scans "
            "or a million returns",
        )
        parser.add_argument("--all", action="store_true", help="print the whole summary, as summary.txt has it")
        parser.add_argument("--report", action="store_true", help="also write report.html, a page that shows the run")
        add_pictures(parser)
        parser.add_argument("--keep", action="store_true", help="keep the history of a long run in memory, for its pictures")

    def run(self, arguments: Namespace) -> int:
        from vedette_report.commands import run

        return run.run(arguments)


@final
@frozen
class Watch(Command):
    """Run a tracker and show it live.

    On a page, which only this machine can open and whose address is printed, or in the terminal. A recording is played as
    fast as it was recorded, or at --speed. Ctrl-C ends the run.
    """

    kind: ClassVar[str] = "watch"

    def options(self, parser: ArgumentParser) -> None:
        options.add_config(parser)
        parser.add_argument(
            "--speed", metavar="X", help="times as fast as recorded, or max: as fast as possible; default: 1"
        )
        parser.add_argument("--terminal", action="store_true", help="show the run in this terminal instead of in a browser")
        parser.add_argument("--out", metavar="DIR", help="also write what `vedette run --stream` writes into this folder")
        options.add_seed(parser)
        parser.add_argument("--port", metavar="N", help="port of the page; default: any free port")
        parser.add_argument(
            "--underlay", metavar="FILE", help="GeoJSON under the map: in deg if the origin is known, else in m"
        )
        options.add_json(parser)

    def run(self, arguments: Namespace) -> int:
        from vedette_report.commands import watch

        return watch.run(arguments)


@final
@frozen
class Report(Command):
    """Write a page that shows a run, several runs, or a study.

    One HTML file shows a run scan by scan, with map, errors, NEES, NIS, modes and the history of its tracks; or several runs
    side by side; or a study with its worst runs. The page needs no network and no other file.
    """

    kind: ClassVar[str] = "report"

    def options(self, parser: ArgumentParser) -> None:
        about = "the folder that `vedette run` or `vedette study` wrote, or smoothed.npz in it; several stand side by side"
        parser.add_argument("runs", nargs="+", metavar="DIR", help=about)
        about = "the page; default: report.html, or for several runs compare.html, in the first DIR"
        parser.add_argument("--out", metavar="FILE", help=about)
        parser.add_argument(
            "--underlay", metavar="FILE", help="GeoJSON under the map: in deg if the origin is known, else in m"
        )
        about = "latitude and longitude of the map's origin, in deg; default: as recorded"
        parser.add_argument("--origin", metavar="LAT,LON", help=about)
        about = "for a study: repeat the N worst runs of each point, and write their pages"
        parser.add_argument("--worst", metavar="N", help=about)
        parser.add_argument(
            "--run", action="append", default=[], dest="again", metavar="POINT-RUN", help="for a study: repeat this run"
        )

    def run(self, arguments: Namespace) -> int:
        from vedette_report.commands import report

        return report.run(arguments)


@final
@frozen
class Export(Command):
    """Write the tracks of a run, or those that a service kept, for another program.

    Writes the confirmed tracks, with their times, covariances and ellipses, for maps (KML, GeoJSON), as a table (CSV,
    Parquet), or the whole run for the viewer Rerun (needs vedette[rerun]).
    """

    kind: ClassVar[str] = "export"

    def options(self, parser: ArgumentParser) -> None:
        about = "the folder that `vedette run` wrote, or the database of `vedette serve`"
        parser.add_argument("run", metavar="RUN_DIR", help=about)
        parser.add_argument("--to", metavar="FILE", required=True, help="the file: .kml, .geojson, .csv, .parquet or .rrd")
        parser.add_argument("--origin", metavar="LAT,LON", help="where x and y are 0, in deg; default: as recorded")
        parser.add_argument(
            "--epoch", metavar="DATE", help="date of time 0, as in 2024-05-01T12:00:00Z, if the run has none"
        )
        parser.add_argument("--ellipses", metavar="N", default="50", help="at most N ellipses for each track; default: 50")
        parser.add_argument(
            "--lasting", metavar="TIME", help="only tracks that lived this long after they were confirmed, as in '30 s'"
        )
        parser.add_argument(
            "--covering", action="store_true", help="only tracks that covered a true object, hence no false tracks"
        )
        parser.add_argument(
            "--smoothed", action="store_true", help="write the smoothed tracks that `vedette run --smooth` made"
        )
        about = "of a database, only estimates from this time on: a date, or in s as the scans' times"
        parser.add_argument("--from", metavar="TIME", help=about)
        parser.add_argument("--until", metavar="TIME", help="of a database, only estimates up to this time")
        about = "of a database, only estimates with x and y between two corners, in m"
        parser.add_argument("--box", metavar="X,Y,X,Y", help=about)

    def run(self, arguments: Namespace) -> int:
        from vedette_report.commands import export

        return export.run(arguments)


@final
@frozen
class Consistency(Command):
    """Report whether a tracker's covariances fit a recording.

    Runs the tracker and prints for each object or track the size and whiteness of the innovations, how often it was detected
    and, with truth, its errors. It gives no verdict. CONFIG may also be a CSV of another program's estimates.
    """

    kind: ClassVar[str] = "consistency"

    def options(self, parser: ArgumentParser) -> None:
        options.add_config(parser)
        options.add_seed(parser)
        parser.add_argument("--out", metavar="DIR", help="folder for text, JSON and picture; default: none are written")
        add_pictures(parser)
        options.add_json(parser)

    def run(self, arguments: Namespace) -> int:
        from vedette_report.commands import consistency

        return consistency.run(arguments)
