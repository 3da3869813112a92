"""Every reader of inputs, and what must be so of all that it accepts: order in time, finite numbers, no row lost."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path

import numpy as np

import vedette
from fuzz.samples import Files
from vedette import Experiment, Rows, Tracker
from vedette.metrics import judge
from vedette.roles import Sensor
from vedette.supporting import Source
from vedette_files import AutoferrySource, CsvSource, JsonLinesSource, read_tracks
from vedette_files.tables.platform import PlatformColumns
from vedette_files.tables.returns import DetectionColumns
from vedette_files.tables.truth import TruthColumns
from vedette_flir.sources.video import VideoSource
from vedette_marine.ais.csv import read_csv
from vedette_marine.ais.nmea import read_nmea
from vedette_marine.screen import RadarScreen
from vedette_marine.sources.pictures import RadarPictures
from vedette_report.figures import figures
from vedette_report.summary.words import summary
from vedette_standard.sensors.cartesian_position import CartesianPosition

EXAMPLE = Path(__file__).parents[2] / "examples" / "flir_clip.toml"
RADAR: dict[str, Sensor] = {"radar": CartesianPosition(sigma=1.0)}
XY = {"x": "x", "y": "y"}


def lines_of(data: bytes) -> list[str]:
    """Return the lines that hold something."""
    text = data.decode("utf-8-sig", errors="replace").replace("\r\n", "\n").replace("\r", "\n")
    return [line for line in text.split("\n") if line.strip()]


def count(data: bytes, skip: int = 1) -> int:
    """Count the lines that hold something, after the first of these: what docs/formats.md calls a row."""
    return max(len(lines_of(data)) - skip, 0)


def below_header(data: bytes) -> int:
    """Count the rows of a table whose times are `t`: docs/formats.md lets anything stand above the header."""
    lines = lines_of(data)
    titled = (i for i, line in enumerate(lines) if "t" in [cell.strip(' "#') for cell in line.split(",")])
    return max(len(lines) - next(titled, 0) - 1, 0)


def check_rows(rows: Mapping[str, Rows], totals: Mapping[str, int]) -> None:
    """Fail unless every row was used, refused or left out, and there are as many as the file has."""
    for name, part in rows.items():
        if part.used + part.refused + part.left_out != part.total or min(part.used, part.refused, part.left_out) < 0:
            raise AssertionError(f"{name}: {part} does not add up")
        if part.total != totals.get(name, part.total):
            raise AssertionError(f"{name}: {part}, and the file has {totals[name]}")


def opened(source: Source, sensors: Mapping[str, Sensor], totals: Mapping[str, int]) -> None:
    """Open a source, read all its scans, and check what it says of its rows."""
    recording = source.open(sensors, np.random.default_rng(0))
    times = []
    for scan in recording.scans:
        times.append(scan.time)
        if not np.all(np.isfinite(scan.detections.z)):
            raise AssertionError("a return is not finite")
    if times != sorted(times) or not np.all(np.isfinite(times)):
        raise AssertionError("the scans are not in the order of time")
    for path in recording.truth:
        if not np.all(np.isfinite(path.states)) or not np.all(np.diff(path.times) >= 0):
            raise AssertionError("the truth is not finite, or not in the order of time")
    if not recording.rows:
        raise AssertionError("says nothing of its rows")
    check_rows(recording.rows, totals)
    for text in (*map(str, recording.refused), *recording.notes, *recording.notes.values()):
        text.encode()
        if len(text) > 2000:
            raise AssertionError(f"a message of {len(text)} characters")


def read_csv_source(folder: Path, files: Files, more: bool) -> None:
    """Read returns, truth and platform; with `more` by a scan column and sorted."""
    source = CsvSource(
        DetectionColumns(time="t", columns=XY, file="d.csv", sensor_column="s", scan="n" if more else ""),
        str(folder),
        truth=TruthColumns(file="truth.csv", time="t", columns=XY, object="o"),
        platform=PlatformColumns(file="own.csv", time="t", columns=XY | {"heading": "h"}),
        sort=more,
    )
    names = {"detections": "d.csv", "truth": "truth.csv", "platform": "own.csv"}
    opened(source, RADAR, {name: below_header(files[file]) for name, file in names.items()})


def read_autoferry(folder: Path, files: Files, more: bool) -> None:
    """Read a scenario."""
    opened(AutoferrySource(scenario=1, path=str(folder), sensors=("radar",), lag={"radar": 1.5} if more else {}), RADAR, {})


def read_jsonl(folder: Path, files: Files, more: bool) -> None:
    """Read Vedette's own lines."""
    opened(JsonLinesSource(str(folder / "r.jsonl"), sort=more), RADAR, {"lines": count(files["r.jsonl"])})


def read_track_lines(folder: Path, files: Files, more: bool) -> None:
    """Read tracks: all lines or none."""
    found = read_tracks(folder / "t.jsonl")
    if sum(len(track.times) for track in found) != count(files["t.jsonl"], 0) - 1:
        raise AssertionError("a line of the tracks was lost")


def read_ais_table(folder: Path, files: Files, more: bool) -> None:
    """Read AIS reports from a table."""
    ships, refused = read_csv(folder / "ais.csv")
    used = sum(len(reports.time) for reports in ships.values())
    check_rows({"ais": Rows(count(files["ais.csv"]), used, len(refused))}, {})
    if not all(np.all(np.isfinite(reports.time)) for reports in ships.values()):
        raise AssertionError("a time is not finite")


def read_sentences(folder: Path, files: Files, more: bool) -> None:
    """Read AIS sentences."""
    ships, _, rows = read_nmea(folder / "ais.txt", 1.0)
    text = files["ais.txt"].decode("utf-8-sig", errors="replace").replace("\r\n", "\n").replace("\r", "\n")
    total = sum(bool(line.strip()) and not line.lstrip().startswith("#") for line in text.split("\n"))
    check_rows({"sentences": rows}, {"sentences": total})
    if sum(len(reports.time) for reports in ships.values()) > rows.used:
        raise AssertionError("more reports than sentences")
    if not all(np.all(np.isfinite(reports.time)) for reports in ships.values()):
        raise AssertionError("a time is not finite")


def read_radar_pictures(folder: Path, files: Files, more: bool) -> None:
    """Read radar pictures, held against their truth or their AIS."""
    totals = {"frames": count(files["frames.csv"]), "truth": count(files["truth.csv"]), "ais": count(files["ais.csv"])}
    opened(RadarPictures(path=str(folder), reference="ais" if more else "truth"), {"screen": RadarScreen()}, totals)


@cache
def camera() -> Mapping[str, Sensor]:
    """Return the camera of the example."""
    return vedette.load(EXAMPLE).tracker.sensors


def read_clip(folder: Path, files: Files, more: bool) -> None:
    """Read a folder of images."""
    opened(VideoSource(path=str(folder / "clip"), segment=0 if more else None), camera(), {"frames": 4})


TRACKER = {
    "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 1}},
    "sensors": {"radar": {"kind": "cartesian_position", "sigma": 1, "detection_probability": 0.9, "clutter_density": 1e-6}},
    "associator": {"kind": "pda"},
    "birth": {"kind": "from_returns", "spread": {"vx": 1, "vy": 1}},
    "lifecycle": {"kind": "m_of_n"},
}


@cache
def tracker() -> Tracker:
    """Return a tracker for the runs."""
    return vedette.build(TRACKER)


def run(folder: Path, files: Files, more: bool) -> None:
    """Run a tracker over a recording, judge it and sum it up, as the command does."""
    source = CsvSource(DetectionColumns(time="t", columns=XY), str(folder / "d.csv"), sort=more)
    experiment = Experiment(tracker(), source)
    result = experiment.run()
    score = judge(result.tracks, result.recording.truth, result.scans, experiment.judge, experiment.tracker.gate.probability)
    json.dumps(figures(experiment, result, score), allow_nan=False)
    summary(experiment, result, score).encode()
    check_rows(result.recording.rows, {"detections": below_header(files["d.csv"])})
    for track in result.tracks:
        if not np.all(np.isfinite(track.mean)) or not np.all(np.isfinite(track.cov)):
            raise AssertionError("a track is not finite")


READERS: dict[str, Callable[[Path, Files, bool], None]] = {
    "csv": read_csv_source,
    "autoferry": read_autoferry,
    "jsonl": read_jsonl,
    "tracks": read_track_lines,
    "ais_csv": read_ais_table,
    "nmea": read_sentences,
    "radar_pictures": read_radar_pictures,
    "video": read_clip,
    "run": run,
}
