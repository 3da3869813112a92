"""True boxes and segments of a clip, from CSV files."""

from __future__ import annotations

import math
from bisect import bisect
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from attrs import frozen

from vedette import Array, ConfigError, InputError, Problem, Space
from vedette_files.input_files import lines, shown
from vedette_files.tables.rows import UNCLOSED, cells_of, header_of

BOX = Space.of(x="px", y="px", width="px", height="px")


@frozen
class Segment:
    """Frames `start` to before `end` of a clip; label i + `label_offset` belongs to frame i."""

    start: int
    end: int
    label_offset: int


def read_boxes(path: Path, first_pixel: float) -> dict[int, Array]:
    """Label number to centre x, y, width and height in px; boxes whose cells are empty are left out."""
    return boxes_and_absences(path, first_pixel)[0]


def boxes_and_absences(path: Path, first_pixel: float) -> tuple[dict[int, Array], set[int]]:
    """Label number to centre x, y, width and height in px; and the labels whose cells are empty: there is no target."""
    boxes_of: dict[int, Array] = {}
    absent: set[int] = set()
    places: dict[int, str] = {}
    for place, row in _rows(path, ("frame", "x", "y", "w", "h")):
        cells = [row[name] for name in ("x", "y", "w", "h")]
        try:
            number, box = int(row["frame"]), [float(cell) for cell in cells if any(cells)]
        except ValueError:
            raise InputError(
                f"{place}: frame must be a whole number and x, y, w, h numbers, got {shown(', '.join(row.values()))}"
            ) from None
        if not box:
            absent.add(number)
            continue
        if number in boxes_of:
            raise InputError(
                f"{place}: frame {number} has a box already: {places[number]}; a file holds those of one target"
            )
        try:
            boxes_of[number], places[number] = centred(box, first_pixel), place
        except ValueError as error:
            raise InputError(f"{place}: {error}; where the target is not in the frame, leave the cells empty") from None
    return boxes_of, absent


def in_sight(numbers: Iterable[int], absent: Iterable[int]) -> list[list[int]]:
    """Return the labels that have a box in order, parted where the target was absent in between."""
    away = sorted(absent)
    parts: dict[int, list[int]] = {}
    for number in sorted(numbers):
        parts.setdefault(bisect(away, number), []).append(number)
    return list(parts.values())


def centred(box: Sequence[float] | Array, first_pixel: float) -> Array:
    """x, y, w, h of a box whose corner is a pixel, counted from `first_pixel` -> centre x, y, width, height.

    ValueError if it is no box.
    """
    sides = [float(value) for value in box]
    if len(sides) != 4 or not all(map(math.isfinite, sides)) or min(sides[2:]) <= 0:
        raise ValueError(f"must be [x, y, w, h] with w and h > 0, got {sides}")
    x, y, w, h = sides
    return np.array([x - first_pixel + 0.5 * (w - 1.0), y - first_pixel + 0.5 * (h - 1.0), w, h])


def four(values: Array) -> str | None:
    """Return what is wrong with one box of a config."""
    return None if len(values) == 4 else f"must be [x, y, w, h], got {len(values)} numbers"


def fours(values: Array) -> str | None:
    """Return what is wrong with several boxes of a config."""
    if not len(values):
        return "must be rows of [x, y, w, h], got none"
    return None if values.shape[1] == 4 else f"must be rows of [x, y, w, h], got {values.shape[1]} numbers"


def given_boxes(box: Array | None, boxes: Array | None, first_pixel: float, shape: tuple[int, ...]) -> list[Array]:
    """Return centre, width and height of each given box in a frame of `shape`; ConfigError for those that are none in it."""
    given = [("box", box)] if box is not None else []
    if boxes is not None:
        given += [(f"boxes[{i}]", each) for i, each in enumerate(boxes)]
    found, problems = [], []
    for name, each in given:
        try:
            found.append(within(centred(each, first_pixel), shape))
        except ValueError as error:
            problems.append(Problem(name, str(error)))
    if problems:
        raise ConfigError(problems)
    return found


def meets(box: Array, shape: tuple[int, ...]) -> bool:
    """Return whether some of a box lies in an image of `shape` (height, width)."""
    size = np.array(shape[::-1])
    return bool(np.all((box[:2] + 0.5 * box[2:] > -0.5) & (box[:2] - 0.5 * box[2:] < size - 0.5)))


def within(box: Array, shape: tuple[int, ...]) -> Array:
    """Return a box of 1 px or more whose centre lies in an image of `shape` (height, width); ValueError for others."""
    height, width = shape
    if min(shape) < 2:
        raise ValueError(f"must lie in an image of at least 2 x 2 px, got one of {width} x {height} px")
    if not (1 <= box[2] <= width and 1 <= box[3] <= height):
        sides = f"sides of {box[2]:g} and {box[3]:g} px"
        raise ValueError(f"must have sides of 1 px or more that fit into the image of {width} x {height} px, got {sides}")
    if not (-0.5 <= box[0] <= width - 0.5 and -0.5 <= box[1] <= height - 0.5):
        raise ValueError(
            f"must lie in the image of {width} x {height} px, got one whose middle is at {box[0]:g}, {box[1]:g} px"
        )
    return box


def read_segment(path: Path, clip: str, number: int) -> Segment:
    """Return the `number`-th segment of `clip`, counted from 0."""
    own = []
    for place, row in _rows(path, ("clip", "label_offset", "start", "end_excl")):
        if row["clip"] == clip:
            try:
                own.append(Segment(int(row["start"]), int(row["end_excl"]), int(row["label_offset"])))
            except ValueError:
                raise InputError(f"{place}: must hold whole numbers, got {shown(', '.join(row.values()))}") from None
    if number >= len(own):
        raise InputError(f"{path}: {clip!r} has {len(own)} segments, counted from 0; there is no {number}")
    return own[number]


def _rows(path: Path, titles: tuple[str, ...]) -> list[tuple[str, dict[str, str]]]:
    """Each row's place and its cells under `titles`, stripped."""
    given = lines(path)
    header = header_of(path, next(given)[1], titles)
    found = []
    for number, line in given:
        if not line.strip():
            continue
        place, cells = f"{path}, line {number}", cells_of(line)
        if cells is None:
            raise InputError(f"{place}: {UNCLOSED}")
        row = dict(zip(header, cells + [""] * len(header), strict=False))
        found.append((place, {title: row[title] for title in titles}))
    return found
