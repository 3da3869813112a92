"""The figures of a run as plain data: one JSON object. docs/command-line.md lists its keys."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from attrs import asdict

from vedette.display import html_table
from vedette.experiment import Experiment, Result
from vedette.metrics import Score
from vedette.types import Rows
from vedette_report.pixels import pixel_figures
from vedette_report.registration import registered

FIRST = 20
"""Number of refused parts that the figures name."""


def figures(experiment: Experiment, result: Result, score: Score) -> dict[str, Any]:
    """Return what is equal in every run of one config and seed: score and input. None for a missing figure."""
    intake = result.intake
    told = {
        "title": experiment.title,
        "seed": experiment.seed,
        "interrupted": result.interrupted,
        "scans_taken": intake.scans,
        "returns": intake.returns,
        "refused": intake.refused.count,
        "first_refused": [str(problem) for problem in result.refused[:FIRST]],
        "rows": {name: asdict(part) for name, part in unused(result).items()},
        "notes": dict(result.recording.notes),
        "begun": result.begun,
        **_registration(result),
        **score.figures(),
        **pixel_figures(result.tracks, result.recording.truth),
    }
    return {name: _finite(value) for name, value in told.items()}


def _registration(result: Result) -> dict[str, Any]:
    """Return what was found of the offsets that all tracks share; nothing where they share none."""
    if result.offsets is None:
        return {}
    by_sensor = {
        one.name: {
            "unit": one.unit,
            "estimate": None if one.refused else one.estimate,
            "deviation": one.deviation,
            "prior_deviation": one.prior,
            "observability": one.observability,
            "refused": one.refused,
        }
        for one in registered(result)
    }
    return {"registration": by_sensor}


def unused(result: Result) -> dict[str, Rows]:
    """Return the account of what was read and not used whole, so that a run and its replay give the same figures."""
    return {name: part for name, part in result.recording.rows.items() if part.used < part.total}


def timings(result: Result) -> dict[str, Any]:
    """Return what differs from run to run."""
    intake = result.intake
    seconds = result.seconds / intake.scans if intake.scans else None
    frames = {"ms_per_frame": 1e3 * (seconds or 0.0)} if intake.frames else {}
    return {"seconds": result.seconds, "seconds_per_scan": seconds} | frames


def length_unit(experiment: Experiment) -> str:
    """Return the unit of positions: px where tracks are followed in images, else m."""
    space = experiment.tracker.state
    return "px" if any(axis.name == "x" and axis.unit == "px" for axis in space.axes) else "m"


def count(number: int, what: str) -> str:
    """Return a number of things in words."""
    return f"{number:,} {what}" if number == 1 else f"{number:,} {what}s"


def _finite(value: Any) -> Any:
    """Return the value with None for what JSON cannot represent."""
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    if isinstance(value, dict):
        return {name: _finite(item) for name, item in value.items()}
    return value


def figures_html(title: str, figures: Mapping[str, Any]) -> str:
    """Return the table of figures that exist, to four digits."""
    return html_table(
        title, [(name.replace("_", " "), _figure(value)) for name, value in figures.items() if value is not None]
    )


def _figure(value: Any) -> str:
    if isinstance(value, tuple | list):
        return ", ".join(map(_figure, value))
    return f"{value:.4g}" if isinstance(value, float) else str(value)
