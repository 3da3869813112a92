"""Recordings and tracks, read and written. The sources are this distribution's own plugin."""

from collections.abc import Iterable

from vedette import Component, plugin
from vedette_files.apart import Apart as Apart
from vedette_files.apart import ApartOpenCV as ApartOpenCV
from vedette_files.autoferry.source import AutoferrySource as AutoferrySource
from vedette_files.codes import NAMELESS as NAMELESS
from vedette_files.codes import code as code
from vedette_files.codes import label as label
from vedette_files.codes import labels as labels
from vedette_files.codes import long_names as long_names
from vedette_files.geodesy import Origin as Origin
from vedette_files.geodesy import curvature_radii as curvature_radii
from vedette_files.georeference import PLAIN as PLAIN
from vedette_files.georeference import Terms as Terms
from vedette_files.georeference import geometry as geometry
from vedette_files.georeference import utc as utc
from vedette_files.georeference import write_features as write_features
from vedette_files.georeference import write_geojson as write_geojson
from vedette_files.images.png import SIGNATURE as SIGNATURE
from vedette_files.jsonl.frames import FrameFiles as FrameFiles
from vedette_files.jsonl.frames import read_frame as read_frame
from vedette_files.jsonl.recording import left_out_line as left_out_line
from vedette_files.jsonl.recording import read_recording as read_recording
from vedette_files.jsonl.recording import recording_head as recording_head
from vedette_files.jsonl.recording import scan_line as scan_line
from vedette_files.jsonl.recording import units as units
from vedette_files.jsonl.recording import write_recording as write_recording
from vedette_files.jsonl.scans import identity_code as identity_code
from vedette_files.jsonl.source import JsonLinesSource as JsonLinesSource
from vedette_files.oddities import replaced as replaced
from vedette_files.readers import FRAMES as FRAMES
from vedette_files.readers import NORTH_EAST as NORTH_EAST
from vedette_files.readers import beyond_period as beyond_period
from vedette_files.readers import east_north as east_north
from vedette_files.series import Column as Column
from vedette_files.series import Series as Series
from vedette_files.series import SeriesFile as SeriesFile
from vedette_files.series import Tables as Tables
from vedette_files.series import open_series as open_series
from vedette_files.series import read_about as read_about
from vedette_files.series import read_series as read_series
from vedette_files.tables.columnar import PARQUET as PARQUET
from vedette_files.tables.source import CsvSource as CsvSource
from vedette_files.tables.times import DATED as DATED
from vedette_files.tables.truth import STATE as STATE
from vedette_files.tracks.kept import SCHEMA as SCHEMA
from vedette_files.tracks.kept import Wanted as Wanted
from vedette_files.tracks.kept import is_database as is_database
from vedette_files.tracks.kept import keep_facts as keep_facts
from vedette_files.tracks.kept import keep_tracks as keep_tracks
from vedette_files.tracks.kept import read_kept as read_kept
from vedette_files.tracks.lines import chunks as chunks
from vedette_files.tracks.lines import csv_head as csv_head
from vedette_files.tracks.lines import jsonl_head as jsonl_head
from vedette_files.tracks.of_series import UNNAMED as UNNAMED
from vedette_files.tracks.of_series import SeriesTracks as SeriesTracks
from vedette_files.tracks.of_series import tracks_of_run as tracks_of_run
from vedette_files.tracks.pieces import Write as Write
from vedette_files.tracks.pieces import geojson_pieces as geojson_pieces
from vedette_files.tracks.pieces import parquet_pieces as parquet_pieces
from vedette_files.tracks.rows import WITHIN as WITHIN
from vedette_files.tracks.rows import TrackRows as TrackRows
from vedette_files.tracks.rows import below as below
from vedette_files.tracks.rows import full_covariances as full_covariances
from vedette_files.tracks.rows import stands as stands
from vedette_files.tracks.rows import triangles as triangles
from vedette_files.tracks.table import table_of as table_of
from vedette_files.tracks.table import write_tracks_parquet as write_tracks_parquet
from vedette_files.tracks.text import read_tracks as read_tracks
from vedette_files.tracks.text import write_tracks_csv as write_tracks_csv
from vedette_files.tracks.text import write_tracks_jsonl as write_tracks_jsonl

VEDETTE_CONTRACT = 2


@plugin
def vedette_components() -> Iterable[type[Component]]:
    """Return the sources of recorded data."""
    return [AutoferrySource, CsvSource, JsonLinesSource]
