"""`vedette export`: the tracks of a finished run, or those that a service kept, for another program."""

from __future__ import annotations

import json
import sys
from argparse import Namespace
from collections.abc import Callable
from math import isfinite
from pathlib import Path

from attrs import evolve

from vedette.commands import DONE, options
from vedette.errors import ConfigError
from vedette.units import in_unit
from vedette_files import Wanted, is_database, read_series, write_tracks_csv, write_tracks_parquet
from vedette_files.files_read import Inputs
from vedette_files.results import finished
from vedette_report.exporting.geojson import write_geojson
from vedette_report.exporting.kml import write_kml
from vedette_report.exporting.run import Run, read_epoch
from vedette_report.exporting.viewer import write_rerun
from vedette_report.page.geography import read_origin
from vedette_report.running.files import NAMES
from vedette_report.running.resuming import not_ended


def write_csv(path: Path, run: Run, ellipses: int) -> None:
    """Write a row for each track and scan, as `tracks.csv`, with dates and latitudes where they are known."""
    write_tracks_csv(path, run.tracks, run.space, run.terms)


def write_parquet(path: Path, run: Run, ellipses: int) -> None:
    """Write the same rows by columns."""
    notes = {"title": run.title, "axes": json.dumps(run.about["axes"]), "notes": json.dumps(run.about["notes"])}
    write_tracks_parquet(path, run.tracks, run.space, run.terms, notes)


FORMATS: dict[str, Callable[[Path, Run, int], None]] = {
    ".kml": write_kml,
    ".geojson": write_geojson,
    ".csv": write_csv,
    ".parquet": write_parquet,
    ".rrd": write_rerun,
}


def run(arguments: Namespace) -> int:
    """Write the file and tell what is in it."""
    target, folder = Path(arguments.to), Path(arguments.run)
    write = FORMATS.get(target.suffix.lower())
    if write is None:
        known = ", ".join(FORMATS)
        raise ConfigError.at("--to", f"must end in one of {known}, got {target.name!r}")
    if target.is_dir() or not target.absolute().parent.is_dir():
        raise ConfigError.at("--to", f"must be a file in a folder that exists, got {str(target)!r}")
    run = _kept(folder, target, arguments) if is_database(folder) else _finished(folder, target, arguments)
    whole, run = len(run.tracks), _chosen(run, arguments)
    write(target, run, options.whole("--ellipses", arguments.ellipses, 0))
    if target.suffix.lower() == ".kml" and not run.terms.dated:
        print("vedette: KML has dates only, so 0 s stands at 1970-01-01T00:00:00Z; --epoch gives another", file=sys.stderr)
    if told := run.about.get("told"):
        print(f"vedette: {folder}: {told}", file=sys.stderr)
    points = sum(len(track.times) for track in run.tracks)
    rest = f" of {whole}" if whole > len(run.tracks) else ""
    print(f"{target}: {len(run.tracks)}{rest} tracks, {points} estimates, {target.stat().st_size / 1e6:.2g} MB")
    return DONE


def _finished(folder: Path, target: Path, arguments: Namespace) -> Run:
    """Return the run of a folder."""
    finished(folder)
    if not (folder / "tracks.jsonl").is_file():
        told = f"must be the folder that a run has written, or the database of a service, got {str(folder)!r}"
        if folder.is_file() and (folder.parent / "tracks.jsonl").is_file():
            smoothed = " and --smoothed" if folder.name.startswith("smoothed.") else ""
            told = f"must be a run's folder, not a file in it: {str(folder.parent)!r}{smoothed}"
        raise ConfigError.at("RUN_DIR", not_ended(folder) or told)
    for option in _OF_KEPT:
        if getattr(arguments, option) is not None:
            raise ConfigError.at(f"--{option}", f"is for the database of a service, and {folder} is a run's folder")
    Inputs.of([folder / name for name in NAMES]).check(target, "--to")
    if arguments.smoothed and not (folder / "smoothed.jsonl").is_file():
        raise ConfigError.at("--smoothed", f"{folder} has no smoothed.jsonl: `vedette run --smooth` writes it")
    origin = options.read("--origin", arguments.origin, read_origin)
    return Run.read(folder, origin, options.read("--epoch", arguments.epoch, read_epoch), smoothed=arguments.smoothed)


_OF_KEPT = ("from", "until", "box")
"""Options for what a service kept."""


def _kept(path: Path, target: Path, arguments: Namespace) -> Run:
    """Return what a service kept, of a time and a place."""
    if arguments.smoothed:
        raise ConfigError.at("--smoothed", "is for a run's folder: a service tells tracks as they are known")
    Inputs.of(path).check(target, "--to")
    since, until = (options.read(f"--{name}", getattr(arguments, name), _moment) for name in ("from", "until"))
    part = Wanted(since, until, options.read("--box", arguments.box, _box))
    origin = options.read("--origin", arguments.origin, read_origin)
    return Run.kept(path, part, origin, options.read("--epoch", arguments.epoch, read_epoch))


def _moment(text: str) -> float:
    """Return a time in s: a number, or a date by ISO 8601 as s since 1970; ValueError if it is neither."""
    try:
        value = float(text)
    except ValueError:
        return read_epoch(text)
    if not isfinite(value):
        raise ValueError(f"must be a finite number of s, or a date, got {text!r}")
    return value


def _box(text: str) -> tuple[float, float, float, float]:
    """Return the corners of a box in m; ValueError if they are none."""
    try:
        west, south, east, north = (float(in_unit(part, "m")) for part in text.split(","))
    except ValueError:
        raise ValueError(f"must be X,Y,X,Y: two corners, as in -500,-500,2000,1500, got {text!r}") from None
    return min(west, east), min(south, north), max(west, east), max(south, north)


def _chosen(run: Run, arguments: Namespace) -> Run:
    """Return the run with those of its tracks that are asked for."""
    tracks = run.tracks
    if arguments.lasting is not None:
        least = options.read("--lasting", arguments.lasting, lambda text: float(in_unit(text, "s")))
        tracks = tuple(track for track in tracks if track.times[-1] - track.times[0] >= least)
    if arguments.covering:
        if not run.about["objects"]:
            told = "needs the truth, and this run has none: --lasting leaves out what was confirmed for a short time only"
            raise ConfigError.at("--covering", told)
        entries = read_series(run.folder / "series.npz")["entries"]
        covering = set(entries["track"][entries["object"] >= 0].tolist())
        tracks = tuple(track for track in tracks if track.id in covering)
    return evolve(run, tracks=tracks)
