"""The options of `vedette report`, apart from what it does: help and other commands need nothing of that."""

from __future__ import annotations

from argparse import ArgumentParser


def add_report_options(report: ArgumentParser) -> None:
    """Add what `vedette report` takes."""
    about = "the folder that `vedette run` or `vedette study` wrote, or smoothed.npz in it; several runs are compared"
    report.add_argument("runs", nargs="+", metavar="DIR", help=about)
    report.add_argument("--out", metavar="FILE", help="the page; default: report.html, or compare.html, in the first DIR")
    report.add_argument("--underlay", metavar="FILE", help="GeoJSON under the map: in deg if the origin is known, else in m")
    report.add_argument("--origin", metavar="LAT,LON", help="where the map's origin is, in deg; default: as recorded")
    report.add_argument("--worst", metavar="N", help="of a study: run the N worst runs of each point anew, for their pages")
    report.add_argument(
        "--run", action="append", default=[], dest="again", metavar="POINT-RUN", help="of a study: run this run anew"
    )
