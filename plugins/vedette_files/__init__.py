"""Recordings and tracks, read and written. The sources are this distribution's own plugin."""

from collections.abc import Iterable

from vedette.config import plugin
from vedette.display import without_passwords
from vedette.roles import Component
from vedette_files.autoferry import AutoferrySource
from vedette_files.columnar import PARQUET, FrameTable, TablePath, frame_of, header_and_rows, is_columnar
from vedette_files.csv_source import CsvSource
from vedette_files.csv_table import COMMAS, UNCLOSED, Dialect, cells_of, fitted, header_line, header_of, is_number, listed
from vedette_files.frames import FrameFiles, read_frame
from vedette_files.geodesy import Origin
from vedette_files.georeference import Terms, geometry, utc, write_features, write_geojson
from vedette_files.image_header import check_pixels, picture_size
from vedette_files.input_files import check_regular, inside, lines, shown, user_path, whole_text
from vedette_files.json_values import parse, short
from vedette_files.jsonl import read_recording, recording_head, scan_line, units, write_recording
from vedette_files.jsonl_source import JsonLinesSource
from vedette_files.png import SIGNATURE, check_png, is_png
from vedette_files.readers import FRAMES, NORTH_EAST, Sample, beyond_period, find, in_time_order
from vedette_files.series import Column, Series, SeriesFile, Tables, read_about, read_series
from vedette_files.track_pieces import Write, geojson_pieces, parquet_pieces
from vedette_files.track_table import table_of, write_tracks_parquet
from vedette_files.tracks import (
    csv_head,
    csv_rows,
    jsonl_head,
    jsonl_rows,
    read_tracks,
    write_tracks_csv,
    write_tracks_jsonl,
)

VEDETTE_CONTRACT = 2

__all__ = [
    "COMMAS",
    "FRAMES",
    "NORTH_EAST",
    "PARQUET",
    "SIGNATURE",
    "UNCLOSED",
    "AutoferrySource",
    "Column",
    "CsvSource",
    "Dialect",
    "FrameFiles",
    "FrameTable",
    "JsonLinesSource",
    "Origin",
    "Sample",
    "Series",
    "SeriesFile",
    "TablePath",
    "Tables",
    "Terms",
    "Write",
    "beyond_period",
    "cells_of",
    "check_pixels",
    "check_png",
    "check_regular",
    "csv_head",
    "csv_rows",
    "find",
    "fitted",
    "frame_of",
    "geojson_pieces",
    "geometry",
    "header_and_rows",
    "header_line",
    "header_of",
    "in_time_order",
    "inside",
    "is_columnar",
    "is_number",
    "is_png",
    "jsonl_head",
    "jsonl_rows",
    "lines",
    "listed",
    "parquet_pieces",
    "parse",
    "picture_size",
    "read_about",
    "read_frame",
    "read_recording",
    "read_series",
    "read_tracks",
    "recording_head",
    "scan_line",
    "short",
    "shown",
    "table_of",
    "units",
    "user_path",
    "utc",
    "whole_text",
    "without_passwords",
    "write_features",
    "write_geojson",
    "write_recording",
    "write_tracks_csv",
    "write_tracks_jsonl",
    "write_tracks_parquet",
]


@plugin
def vedette_components() -> Iterable[type[Component]]:
    """Return the sources of recorded data."""
    return [AutoferrySource, CsvSource, JsonLinesSource]
