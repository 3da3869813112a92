"""The files of the Autoferry benchmark: lists in JSON, with returns and positions written in several ways."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from vedette import InputError, Problem, Rows, Space, Trajectory
from vedette_files.input_files import whole_text
from vedette_files.json_values import number, parse, short, vector

PUBLISHER = (
    "the Autoferry sensor fusion benchmark (Helgesen, Vasstein, Brekke, Stahl, Ocean Engineering 252, 2022, 111152). "
    "Format: a folder with scenarioN_detections.json and scenarioN_groundTruth.json"
)

STATE = Space.of(x="m", y="m", vx="m/s", vy="m/s")

HALF_BASE = 0.5
"""In s. Velocities are differences over twice this: over one sample of 0.04 s position jitter alone gives 0.7 m/s."""


def entries(path: Path) -> Iterator[tuple[str, Any]]:
    """Yield the entries of a file, each with its place."""
    text = whole_text(path)
    if not text.strip():
        raise InputError(f"{path}: is empty. Wanted: {PUBLISHER}")
    try:
        document = parse(text)
    except ValueError as error:
        raise InputError(f"{path}: {error}") from None
    if not isinstance(document, list):
        raise InputError(f"{path}: must be a list, got {short(document)}. Wanted: {PUBLISHER}")
    return ((f"{path.name}[{i}]", entry) for i, entry in enumerate(document))


def returns(measurement: Any) -> list[tuple[Any, ...]]:
    """Return the returns of a lidar or radar as written, (north, east) each: [] for none, [n, e] for one, else
    [[n, n, ...], [e, e, ...]], norths before easts.
    """
    if measurement == []:
        return []
    if isinstance(measurement, list) and len(measurement) == 2:
        north, east = measurement
        if not isinstance(north, list) and not isinstance(east, list):
            return [(north, east)]
        if isinstance(north, list) and isinstance(east, list) and len(north) == len(east):
            return list(zip(north, east, strict=True))
    raise ValueError(f"measurement must be [], [n, e] or [[n, n, ...], [e, e, ...]], got {short(measurement)}")


def bearings(measurement: Any) -> list[tuple[Any, ...]]:
    """Return the bearings of a camera as written: a list, or a single bare number."""
    return [(bearing,) for bearing in (measurement if isinstance(measurement, list) else [measurement])]


def truth(path: Path, refused: list[Problem]) -> tuple[tuple[Trajectory, ...], Rows]:
    """Return the boats in the order of their ids: each time counts once, although the file repeats it for each detection."""
    good: Counter[int] = Counter()
    total, told = 0, len(refused)
    positions: dict[int, dict[float, tuple[float, float]]] = {}
    for place, entry in entries(path):
        for j, sample in enumerate(entry if isinstance(entry, list) else [entry]):
            total += 1
            try:
                if not isinstance(sample, dict) or type(sample.get("targetID")) is not int:
                    raise ValueError(f"must be an object with targetID, position and time, got {short(sample)}")
                time = number(sample.get("time"), "time")
                north, east, _ = vector(sample.get("position"), "position", 3)
                if positions.setdefault(sample["targetID"], {}).setdefault(time, (north, east)) != (north, east):
                    raise ValueError(f"boat {sample['targetID']} has another position at {time!r} s in an earlier entry")
                good[sample["targetID"]] += 1
            except ValueError as error:
                refused.append(Problem(f"{place}[{j}]", str(error)))
    known = {target: at for target, at in sorted(positions.items()) if len(at) > 1}
    refused += [
        Problem(path.name, f"boat {target} has a position at one time only, which gives no velocity", good[target])
        for target in sorted(positions)
        if target not in known
    ]
    rows = Rows(total, sum(good[target] for target in known), sum(problem.rows for problem in refused[told:]))
    return tuple(_trajectory(f"boat {target}", at) for target, at in known.items()), rows


def _trajectory(name: str, at: Mapping[float, tuple[float, float]]) -> Trajectory:
    """Return states from positions, with velocities by differences over one second, or over what the record covers of it."""
    times = np.array(sorted(at))
    places = np.array([at[time] for time in times])
    before = np.maximum(times - HALF_BASE, times[0])
    after = np.minimum(times + HALF_BASE, times[-1])
    moved = [np.interp(after, times, column) - np.interp(before, times, column) for column in places.T]
    return Trajectory(name, STATE, times, np.column_stack([places, np.transpose(moved) / (after - before)[:, None]]))
