"""The figures of a run as plain data: one JSON object. docs/command-line.md lists its keys."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from numbers import Real
from typing import Any, final

import numpy as np
from attrs import asdict, define, evolve

from vedette import Experiment, Result, Rows, Trajectory
from vedette.config import installed_figures
from vedette.display import html_table
from vedette.metrics import Block, Figure, Score
from vedette.units import short
from vedette_report.pixels import pixel_figures
from vedette_report.registration import registered

FIRST = 20
"""Number of refused parts that the figures name."""

WHOLE, MANY = 0.5, 30.0
"""A judge's radius is too large beyond such a part of the scene and so many of a track's errors: by hand."""


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


@final
@define
class _Forgiven:
    """A figure of a plugin, without which a run goes on where it fails: that is told once, as `told` is shared by runs."""

    name: str
    start: Callable[[], Any]
    told: list[str]
    of: Any = None
    failed: bool = False

    def add(self, block: Block) -> None:
        self._asked(lambda of: of.add(block))

    def value(self) -> float | None:
        return self._asked(_number)

    def _asked(self, ask: Callable[[Any], float | None]) -> float | None:
        if self.failed:
            return None
        try:
            self.of = self.start() if self.of is None else self.of
            return ask(self.of)
        except Exception as error:
            self.failed = True
            if not self.told:
                self.told.append(f"the figure {self.name!r} failed and is left out: {type(error).__name__}: {error}")
                print(f"vedette: {self.told[0]}", file=sys.stderr)
            return None


def _number(of: Any) -> float | None:
    """Return a figure's value, None if it is none or not finite; TypeError if it is no number."""
    value: Any = of.value()
    if not (value is None or isinstance(value, Real)):
        raise TypeError(f"value() must return a number or None, got {short(value)}")
    return float(value) if value is not None and math.isfinite(value) else None


def forgiven_figures() -> tuple[Figure, ...]:
    """Return the figures of plugins: one that fails is left out of a run, and the rest of it kept."""
    return tuple(
        evolve(one, start=partial(_Forgiven, one.name, one.start, []))
        for one in installed_figures()
        if one.start is not None
    )


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


def extent(truth: Sequence[Trajectory]) -> float:
    """Return how far from one another true objects are at most, over all times, in m."""
    spots = [path.states[:, [i for i, name in enumerate(path.space.names) if name in ("x", "y")]] for path in truth]
    every = np.concatenate([each for each in spots if each.shape[1] == 2] or [np.zeros((1, 2))])
    return float(np.linalg.norm(np.ptp(every, axis=0))) if len(every) else 0.0


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
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {_figure(each)}" for name, each in value.items() if each is not None)
    return f"{value:.4g}" if isinstance(value, float) else str(value)
