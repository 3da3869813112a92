"""Tracks as tables: CSV, and Parquet with what is the same in all of the run as its metadata."""

from __future__ import annotations

import json
from pathlib import Path

from vedette_files import write_tracks_csv, write_tracks_parquet
from vedette_report.exporting.run import Run


def write_csv(path: Path, run: Run, ellipses: int) -> None:
    """Write a row for each track and scan, as `tracks.csv`, with dates and latitudes where they are known."""
    write_tracks_csv(path, run.tracks, run.space, run.terms)


def write_parquet(path: Path, run: Run, ellipses: int) -> None:
    """Write the same rows by columns."""
    notes = {"title": run.title, "axes": json.dumps(run.about["axes"]), "notes": json.dumps(run.about["notes"])}
    write_tracks_parquet(path, run.tracks, run.space, run.terms, notes)
