"""A table without a column that looks like a time: what may be one, and what to type."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from shlex import quote

from vedette_files.tables.columnar import FrameTable, TablePath, is_columnar
from vedette_files.tables.rows import listed

STEPS = 100
"""What counts frames leaves out fewer at a time. By hand."""


def untimed(
    path: TablePath, cells: Mapping[str, Sequence[str]], scan: str, read: Collection[str], delimiter: str | None
) -> str:
    """Say that no column looks like a time, and what to do: with the column of the scans, or another one that counts.

    read: columns that are something else; delimiter: between cells, if the titles stand in the first line of a file.
    """
    told = f"no column looks like a time among {listed(list(cells))}; name it `time` or `t`, or say --time COLUMN"
    counter = next((title for title, column in cells.items() if title not in read and _counts(column)), "")
    if scan:
        told += f", or say how many counts of {scan!r} a second has: --rate 30"
    elif counter:
        told += f", or, if {counter} counts frames, how many a second has: --time {quote(counter)} --rate 30"
    elif delimiter and isinstance(path, Path) and not is_columnar(path):
        program = f'NR == 1 {{print "frame{delimiter}" $0; next}} {{print NR - 2 "{delimiter}" $0}}'
        told += (
            f"; if each row is a frame, number them: awk '{program}' {quote(str(path))} > numbered.csv, and say --rate 30"
        )
    return told + ("; an index counts if it has a name" if isinstance(path, FrameTable) else "")


def _counts(column: Sequence[str]) -> bool:
    """Return whether cells are whole numbers that rise now and then, by little, and never fall."""
    if len(column) < 2 or not all(cell.isdigit() and len(cell) < 16 for cell in column):
        return False
    steps = [int(after) - int(before) for before, after in pairwise(column)]
    return min(steps) >= 0 and 0 < max(steps) < STEPS
