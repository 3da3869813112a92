"""Recordings and tracks, read and written. The sources are this distribution's own plugin."""

from collections.abc import Iterable

from vedette.config.hooks import plugin
from vedette.display import without_passwords
from vedette.io.autoferry import AutoferrySource
from vedette.io.csv_source import CsvSource
from vedette.io.csv_table import UNCLOSED, cells_of, header_of
from vedette.io.frames import read_frame
from vedette.io.image_header import check_pixels, picture_size
from vedette.io.json_values import parse, short
from vedette.io.jsonl import read_recording, write_recording
from vedette.io.jsonl_source import JsonLinesSource
from vedette.io.opening import check_regular, inside, lines, shown, user_path, whole_text
from vedette.io.png import check_png, is_png
from vedette.io.reading import Sample, find, in_time_order
from vedette.io.series import Series, read_series
from vedette.io.tracks import read_tracks, write_tracks_csv, write_tracks_jsonl
from vedette.roles import Component

VEDETTE_CONTRACT = 2

__all__ = [
    "UNCLOSED",
    "AutoferrySource",
    "CsvSource",
    "JsonLinesSource",
    "Sample",
    "Series",
    "cells_of",
    "check_pixels",
    "check_png",
    "check_regular",
    "find",
    "header_of",
    "in_time_order",
    "inside",
    "is_png",
    "lines",
    "parse",
    "picture_size",
    "read_frame",
    "read_recording",
    "read_series",
    "read_tracks",
    "short",
    "shown",
    "user_path",
    "whole_text",
    "without_passwords",
    "write_recording",
    "write_tracks_csv",
    "write_tracks_jsonl",
]


@plugin
def vedette_components() -> Iterable[type[Component]]:
    """Return the sources of recorded data."""
    return [AutoferrySource, CsvSource, JsonLinesSource]
