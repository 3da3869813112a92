"""The tables beside radar pictures: rows of words and numbers, by their titles."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from vedette import Problem, Space, Trajectory
from vedette.fields import ABSURD
from vedette_files.input_files import lines, shown
from vedette_files.readers import Sample, in_time_order
from vedette_files.tables.rows import UNCLOSED, cells_of, header_of

Table = list[tuple[str, dict[str, str], dict[str, float]]]
"""Each row's place, its words and its numbers."""


def read_table(
    path: Path, words: Sequence[str], numbers: Sequence[str], optional: Sequence[str], refused: list[Problem]
) -> Table:
    """Return the rows, refusing malformed ones. `optional` numbers are present where their column has a value.

    InputError for a missing file or a header that lacks a column.
    """
    given = lines(path)
    header = header_of(path, next(given)[1], (*words, *numbers), optional)
    table: Table = []
    for number, line in given:
        if not line.strip():
            continue
        place, cells = f"{path.name}:{number}", cells_of(line)
        try:
            if cells is None:
                raise ValueError(UNCLOSED)
            if len(cells) != len(header):
                raise ValueError(f"must have {len(header)} columns as in the header, got {len(cells)}")
            row = dict(zip(header, cells, strict=True))
            values = {title: _number(title, row[title]) for title in numbers}
            values |= {title: _number(title, row[title]) for title in optional if row.get(title)}
            table.append((place, {title: row[title] for title in words}, values))
        except ValueError as error:
            refused.append(Problem(place, str(error)))
    return table


def _number(title: str, cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        raise ValueError(f"{title} must be a number, got {shown(cell)}") from None
    if not abs(value) <= ABSURD:
        raise ValueError(f"{title} must be a finite number of at most {ABSURD:g}, got {shown(cell)}")
    return value


def truth(path: Path, refused: list[Problem]) -> tuple[Trajectory, ...]:
    """Return a trajectory of the hull's centre for each object, with its velocity if every row of it has one."""
    moving = ("east_mps", "north_mps")
    objects: dict[str, list[Sample[dict[str, float]]]] = {}
    for place, words, row in read_table(path, ("object",), ("time_s", "east_m", "north_m"), moving, refused):
        objects.setdefault(words["object"], []).append(Sample(place, row["time_s"], row))
    rows = []
    for name, samples in objects.items():
        kept = in_time_order(samples, refused)
        whole = all(title in sample.value for sample in kept for title in moving)
        titles = ("east_m", "north_m", *(moving if whole else ()))
        units = {"x": "m", "y": "m"} | ({"vx": "m/s", "vy": "m/s"} if whole else {})
        states = np.array([[sample.value[title] for title in titles] for sample in kept])
        rows.append(Trajectory(name, Space.of(**units), np.array([sample.time for sample in kept]), states))
    return tuple(rows)
