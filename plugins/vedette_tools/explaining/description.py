"""What an experiment composes, in plain words: its parts with their parameters, and the figures that follow from them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from textwrap import wrap
from typing import Any

import attrs
import numpy as np

from vedette import ImagingSensor, display
from vedette.config import Maybe, holds_parts, parameters
from vedette.display import shown
from vedette.tracking import parts
from vedette.units import say
from vedette_tools.explaining.situation import Seen, Situation, deviation, fused, positions
from vedette_tools.explaining.steady_state import SCANS

WIDTH = 120
_UNTOLD = "source"
"""The parts inside of a source are its own: a scene's ships and legs."""


def composed(it: Situation) -> list[dict[str, Any]]:
    """Return each part with its place, kind, what it is, and its parameters in words, with units."""
    lines = []
    for place, part in parts(it.experiment):
        if not place.startswith(f"{_UNTOLD}."):
            lines.append({"place": place, "kind": part.kind, "about": _first(part), "parameters": list(_told(part))})
    gate = it.experiment.tracker.gate
    lines.append({"place": "gate", "kind": "", "about": _first(gate), "parameters": list(_told(gate))})
    return lines


def figures(seen: Seen, it: Situation) -> dict[str, Any]:
    """Return the figures of one sensor that follow from the parts, in SI units; None where they cannot be told."""
    settled, tracker = seen.settled, it.experiment.tracker
    facts: dict[str, Any] = {
        "sensor": seen.name,
        "interval_s": seen.dt,
        "returns_per_scan": seen.came.per_scan,
        "reach_m": seen.far,
        "detection_probability": None if settled is None else settled.detects,
    }
    if settled is None:
        return facts
    threshold = tracker.gate.for_sensor(seen.sensor).threshold
    where, finite = positions(it.state), math.isfinite(threshold)
    volumes = settled.gate_volumes(threshold) if finite else np.full(SCANS, math.nan)
    axes = []
    for i, axis in enumerate(seen.sensor.measurement.axes[at] for at in settled.has):
        sigmas = [float(np.sqrt(S[i, i])) for S in (settled.R, settled.S[0], settled.S[-1])]
        half = [float(np.sqrt(threshold)) * sigma if finite else None for sigma in sigmas[1:]]
        axes.append(
            {"axis": axis.name, "unit": axis.unit, "noise": sigmas[0], "first_gate": half[0], "settled_gate": half[1]}
        )
    lives = seen.lives
    return facts | {
        "axes": axes,
        "false_returns_in_first_gate": float(settled.density * volumes[0]) if finite else None,
        "false_returns_in_settled_gate": float(settled.density * volumes[-1]) if finite else None,
        "first_position_error_m": deviation(settled.start.cov[0], where) if where else None,
        "settled_position_error_m": deviation(settled.updated[-1], where) if where else None,
        "targets_confirmed": None if lives is None else lives.confirmed,
        "targets_kept": None if lives is None else lives.kept,
        "false_starts_confirmed": None if lives is None else lives.false,
    }


def lines(it: Situation) -> Iterator[str]:
    """Yield the composition as text."""
    if it.experiment.title:
        yield it.experiment.title
        yield ""
    for part in composed(it):
        head = f"{part['place']}: {part['kind']}".rstrip(": ")
        yield from wrap(f"{head}: {part['about']}", WIDTH, subsequent_indent="  ")
        for name, value, meaning in part["parameters"]:
            yield from wrap(f"{name} = {value}: {meaning}", WIDTH, initial_indent="    ", subsequent_indent="      ")
    for seen in it.sensors:
        yield ""
        yield from _of_sensor(seen, figures(seen, it))
    if (facts := fused(it)) is not None:
        yield ""
        first, then = (say(round_(facts[name]), "m") for name in ("first_position_error_m", "position_error_m"))
        told = f"known to {first} at its start, to {then} after {say(round_(facts['after_s']), 's')}"
        yield f"all sensors together: a track's position: {told} with a return in each scan"
    if it.opened.recording is None:
        yield ""
        why = it.opened.why.partition("\n")[0]
        yield from wrap(f"The source was not opened: {why}", WIDTH, subsequent_indent="  ")


def _of_sensor(seen: Seen, facts: dict[str, Any]) -> Iterator[str]:
    if seen.dt is None:
        yield f"{seen.name}: its scan interval is not known: say it, as in --interval '2.5 s', for what follows from it"
        return
    returns = "" if seen.came.per_scan is None else f", {seen.came.per_scan:.3g} returns a scan"
    reach = "" if seen.far is None else f", as far as {say(seen.far, 'm')}"
    yield f"{seen.name}: a scan every {say(seen.dt, 's')}{returns}{reach}"
    if seen.settled is None:
        why = (
            "its frames are no returns"
            if isinstance(seen.sensor, ImagingSensor)
            else "no return of it was found that starts one, or that its estimator learns from"
        )
        yield f"    how a track of it settles is not told: {why}"
        return
    for axis in facts["axes"]:
        unit, gate = axis["unit"], ""
        if axis["first_gate"] is not None:
            first, then = angle(axis["first_gate"], unit), angle(axis["settled_gate"], unit)
            gate = f"; the gate reaches {first} either way at first, then {then}"
        yield f"    {axis['axis']}: errs by {angle(axis['noise'], unit)} (standard deviation){gate}"
    names = [name for at, name in enumerate(seen.sensor.measurement.names) if at not in seen.settled.has]
    if names:
        yield f"    {', '.join(names)}: no return of the source's first scans has it"
    yield f"    a target gives a return with probability {facts['detection_probability']:.3g}"
    if facts["false_returns_in_first_gate"] is not None:
        yield (
            f"    false returns in the gate: {facts['false_returns_in_first_gate']:.3g} at first, then "
            f"{facts['false_returns_in_settled_gate']:.3g}"
        )
    if facts["settled_position_error_m"] is not None:
        yield (
            f"    a track's position: known to {say(round_(facts['first_position_error_m']), 'm')} at its start, to "
            f"{say(round_(facts['settled_position_error_m']), 'm')} after {SCANS} scans with a return each"
        )
    if seen.lives is not None:
        yield (
            f"    of tracks that start at a target {100 * seen.lives.confirmed:.3g} % are confirmed; of those that start at "
            f"a false return {100 * seen.lives.false:.2g} %"
        )


def angle(value: float, unit: str) -> str:
    """Return a value with its unit, of an angle in rad also in deg."""
    text = say(round_(value), unit)
    degrees = {"rad": "deg", "rad/s": "deg/s", "rad/s^2": "deg/s^2", "rad/s^1.5": "deg/s^1.5"}.get(unit)
    return text if degrees is None else f"{text} ({np.degrees(value):.3g} {degrees})"


def round_(value: float) -> float:
    """Return a value to three digits."""
    return float(f"{value:.3g}")


def _first(part: Any) -> str:
    """Return the first line of what a part's class says of itself."""
    return display.about(type(part)).partition("\n")[0]


def _told(part: Any) -> Iterator[tuple[str, str, str]]:
    """Yield name, value with unit, and meaning of each parameter that is given or has a default and is no part itself."""
    if not attrs.has(type(part)):
        return
    for parameter in parameters(type(part)):
        shape = parameter.shape.item if isinstance(parameter.shape, Maybe) else parameter.shape
        value = getattr(part, parameter.field.name)
        if holds_parts(shape) or value is None or (hasattr(value, "__len__") and len(value) == 0):
            continue
        number = isinstance(value, float | int) and not isinstance(value, bool)
        unit = "" if parameter.unit in ("", "1") else f" {parameter.unit}"
        text = angle(float(value), parameter.unit) if number else f"{shown(value)}{unit}"
        yield parameter.name, text, str(parameter.field.metadata.get("doc", ""))
