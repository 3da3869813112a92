"""Recordings and tracks, read and written. The sources are this distribution's own plugin."""

from collections.abc import Iterable

from vedette.config.hooks import plugin
from vedette.io.autoferry import AutoferrySource
from vedette.io.csv_source import CsvSource
from vedette.io.jsonl import read_recording, write_recording
from vedette.io.jsonl_source import JsonLinesSource
from vedette.io.opening import lines
from vedette.io.reading import Sample, find, in_time_order
from vedette.io.tracks import read_tracks, write_tracks_csv, write_tracks_jsonl
from vedette.roles import Component

VEDETTE_CONTRACT = 2

__all__ = [
    "AutoferrySource",
    "CsvSource",
    "JsonLinesSource",
    "Sample",
    "find",
    "in_time_order",
    "lines",
    "read_recording",
    "read_tracks",
    "write_recording",
    "write_tracks_csv",
    "write_tracks_jsonl",
]


@plugin
def vedette_components() -> Iterable[type[Component]]:
    """The sources of recorded data."""
    return [AutoferrySource, CsvSource, JsonLinesSource]
