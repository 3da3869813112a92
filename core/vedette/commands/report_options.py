"""The options of `vedette report`, apart from what it does: help and other commands need nothing of that."""

from __future__ import annotations

from argparse import ArgumentParser


def add_report_options(report: ArgumentParser) -> None:
    """Add what `vedette report` takes."""
    about = (
        "the folder that `vedette run` or `vedette study` wrote, or smoothed.npz in it; several runs are shown side by side"
    )
    report.add_argument("runs", nargs="+", metavar="DIR", help=about)
    report.add_argument(
        "--out", metavar="FILE", help="the page; default: report.html, or for several runs compare.html, in the first DIR"
    )
    report.add_argument("--underlay", metavar="FILE", help="GeoJSON under the map: in deg if the origin is known, else in m")
    report.add_argument(
        "--origin", metavar="LAT,LON", help="latitude and longitude of the map's origin, in deg; default: as recorded"
    )
    report.add_argument(
        "--worst", metavar="N", help="for a study: repeat the N worst runs of each point, and write their pages"
    )
    report.add_argument(
        "--run", action="append", default=[], dest="again", metavar="POINT-RUN", help="for a study: repeat this run"
    )
