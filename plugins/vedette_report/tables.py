"""A run's result as data frames of pandas, and in short."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import attrs
import numpy as np

from vedette import ConfigError, Result
from vedette.config import did_you_mean
from vedette.display import html_table
from vedette.metrics import Score
from vedette_files import Terms, table_of
from vedette_files.libraries import needed
from vedette_report.figures import figures, figures_html, forgiven_figures
from vedette_report.known import known
from vedette_report.series.traces import Judged


def tabulate_result(result: Result, what: str) -> Any:
    """Return one of the tables of a result; ConfigError for a name that is none, InputError without pandas."""
    pd = needed("pandas", "data frames need pandas", "data")
    if what not in TABLES:
        text = f"there is no such table;{did_you_mean(what, TABLES)} those are {', '.join(TABLES)}"
        raise ConfigError.at(str(what), text)
    return pd.DataFrame(TABLES[what](result))


def draw_result(result: Result, axes: Any = None) -> Any:
    """Draw the map of a result on axes of matplotlib, by default new ones; return them."""
    from vedette_report.drawing.picture import plot

    return plot(result, axes)


def result_html(result: Result) -> str:
    """Return what a notebook shows of a result."""
    rows = [(name.replace("_", " "), f"{value:.4g}") for name, value in _metrics(result).items() if _is_number(value)]
    return html_table(repr(result), rows)


def _tracks(result: Result) -> dict[str, Any]:
    return table_of(result.tracks, result.made_by.tracker.state, Terms.of(result.recording.notes, result.tracks))


def _detections(result: Result) -> dict[str, Any]:
    """Return a row for each return: the scan's number, time and sensor, and what was measured by axis, or NaN."""
    axes = dict.fromkeys(name for sensor in result.made_by.tracker.sensors.values() for name in sensor.measurement.names)
    columns: dict[str, list[Any]] = {name: [] for name in ("scan", "time", "sensor", *axes)}
    for i, scan in enumerate(result.scans):
        own = result.made_by.tracker.sensors[scan.sensor].measurement.names
        for z in known(scan.detections)[scan.detections.valid].tolist():
            measured = dict(zip(own, z, strict=True))
            for name, value in (("scan", i), ("time", scan.time), ("sensor", scan.sensor)):
                columns[name].append(value)
            for name in axes:
                columns[name].append(measured.get(name, np.nan))
    return columns


def _truth(result: Result) -> dict[str, Any]:
    paths = result.recording.truth
    axes = dict.fromkeys(name for path in paths for name in path.space.names)
    columns: dict[str, list[Any]] = {name: [] for name in ("object", "time", *axes)}
    for path in paths:
        for time, state in zip(path.times.tolist(), path.states.tolist(), strict=True):
            known = dict(zip(path.space.names, state, strict=True))
            columns["object"].append(path.name)
            columns["time"].append(time)
            for name in axes:
                columns[name].append(known.get(name, np.nan))
    return columns


def _metrics(result: Result) -> dict[str, Any]:
    score = Judged.of(result.made_by, result, forgiven_figures()).score
    told = figures(result.made_by, result, score)
    return {name: value for name, value in told.items() if _is_number(value) or value is None}


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _metrics_row(result: Result) -> dict[str, Any]:
    return {name: [np.nan if value is None else value] for name, value in _metrics(result).items()}


TABLES: dict[str, Callable[[Result], dict[str, Any]]] = {
    "tracks": _tracks,
    "detections": _detections,
    "truth": _truth,
    "metrics": _metrics_row,
}
"""The tables of a result, by name."""


def score_html(score: Score) -> str:
    """Return the figures of a run in a table, and those of each true object in others."""
    figures = {name: value for name, value in score.figures().items() if name != "truths"}
    per_truth = "".join(figures_html(truth.name, attrs.asdict(truth)) for truth in score.truths)
    return figures_html(f"Score over {score.scans} scans", figures) + per_truth
