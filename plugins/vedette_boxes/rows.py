"""Files as MOTChallenge has them: a box a line, `frame, id, left, top, width, height, score, class, ..`, without header."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from attrs import frozen

from vedette import Array, Indices, InputError, Mask, Problem
from vedette_files.input_files import lines, shown
from vedette_files.writing import whole_file

FEWEST, MOST = 6, 12
"""Numbers that a line has: a score, a class and the rest may be left out."""


@frozen(eq=False)
class BoxRows:
    """Boxes (n,) by frame: frame and id (n,), box (n, 4) as middle and sides in px, score (n,), kind (n,), -1 for none."""

    frame: Indices
    id: Indices
    box: Array
    score: Array
    kind: Indices
    refused: tuple[Problem, ...] = ()

    def of(self, keep: Mask) -> BoxRows:
        """Return some of them."""
        return BoxRows(self.frame[keep], self.id[keep], self.box[keep], self.score[keep], self.kind[keep], self.refused)


def numbers_of(line: str) -> list[float]:
    """Return the numbers of a line; ValueError where it is no box."""
    cells = line.split(",") if "," in line else line.split()
    if not FEWEST <= len(cells) <= MOST:
        raise ValueError(f"must hold frame, id, left, top, width, height and up to {MOST - FEWEST} more, got {shown(line)}")
    values = [float(cell) for cell in cells]
    if not np.all(np.isfinite(values)) or max(map(abs, values)) > 1e9:
        raise ValueError(f"must hold finite numbers, got {shown(line)}")
    if values[0] != int(values[0]) or values[0] < 0 or values[1] != int(values[1]):
        raise ValueError(f"must begin with the whole numbers of a frame and an object, got {shown(line)}")
    if values[4] <= 0 or values[5] <= 0:
        raise ValueError(f"must have a width and a height > 0, got {values[4]:g} and {values[5]:g}")
    return values


def read_rows(path: Path) -> BoxRows:
    """Read detections, true boxes or results; lines that are no boxes are refused. InputError if none is one."""
    found, refused = list[list[float]](), list[Problem]()
    for number, line in lines(path):
        if line.strip():
            try:
                found.append(numbers_of(line))
            except ValueError as error:
                refused.append(Problem(f"{path}:{number}", str(error)))
    if not found:
        raise InputError(f"{refused[0]}" if refused else f"{path}: holds no boxes")
    values = np.array([(row + [-1.0, -1.0])[:8] for row in found])
    values = values[np.argsort(values[:, 0], kind="stable")]
    box = np.concatenate([values[:, 2:4] + 0.5 * values[:, 4:6], values[:, 4:6]], axis=1)
    return BoxRows(
        values[:, 0].astype(int), values[:, 1].astype(int), box, values[:, 6], values[:, 7].astype(int), tuple(refused)
    )


def write_rows(path: Path, rows: Iterable[tuple[int, int, Array, float]]) -> None:
    """Write results: of each box its frame, track, middle and sides in px (4,), and how sure it is."""
    with whole_file(path) as file:
        for frame, track, (x, y, width, height), sure in rows:
            left, top = x - 0.5 * width, y - 0.5 * height
            file.write(f"{frame},{track},{left:.3f},{top:.3f},{width:.3f},{height:.3f},{sure:.4f},-1,-1,-1\n")


def overlap(a: Array, b: Array) -> Array:
    """Return intersection over union (j, t) of boxes (j, 4) and (t, 4), each middle and sides."""
    low = np.maximum((a[:, :2] - 0.5 * a[:, 2:])[:, None], (b[:, :2] - 0.5 * b[:, 2:])[None])
    high = np.minimum((a[:, :2] + 0.5 * a[:, 2:])[:, None], (b[:, :2] + 0.5 * b[:, 2:])[None])
    both = np.prod(np.maximum(high - low, 0.0), axis=-1)
    either = np.prod(a[:, 2:], axis=-1)[:, None] + np.prod(b[:, 2:], axis=-1)[None] - both
    return np.divide(both, either, out=np.zeros_like(both), where=either > 0)
