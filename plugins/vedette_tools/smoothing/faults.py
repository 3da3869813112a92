"""Where a table cannot be used, and why."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice

from vedette.errors import Problem
from vedette.space import Space
from vedette_files import NAMELESS
from vedette_files.tables.columnar import TablePath, is_columnar
from vedette_files.tables.numbers import is_number, numbers
from vedette_files.tables.rows import Dialect, rows
from vedette_files.tables.times import Times, form_of
from vedette_tools.drafting.first_rows import dialect_of
from vedette_tools.smoothing.columns import Columns
from vedette_tools.smoothing.folders import folders

LOOKED_AT = 10_000
"""Among so many rows the first one that cannot be used is looked for."""


def first_fault(paths: Sequence[TablePath], columns: Columns) -> str:
    """Return the place of the first row that cannot be used, and what is wrong with it; "" if none of the first is."""
    axes = Space.of(latitude="deg", longitude="deg") if columns.geodetic else Space.of(x="m", y="m")
    titles = {axis: column.title for axis, column in zip(axes.names, columns.place, strict=True)}
    read = numbers(axes, columns.time.title, titles, {}, "smooth")
    wanted = {column.name: column.title for column in read.values()}
    wanted |= {f"elsewhere {i}": title for i, title in enumerate(columns.elsewhere)}
    refused: list[Problem] = []
    for path in paths:
        dialect = Dialect() if is_columnar(path) else dialect_of(path)
        named = {"name": columns.name} if columns.name and columns.name not in folders(path) else {}
        given = list(islice(rows(path, wanted | named, "smooth", dialect, refused), LOOKED_AT))
        given = [
            row for row in given if not any(is_number(row.cells[f"elsewhere {i}"]) for i in range(len(columns.elsewhere)))
        ]
        times = Times(read["time"], form_of((row.cells["time"] for row in given), columns.dates), 0.0)
        for row in given:
            try:
                times.of(row)
                for axis in axes.names:
                    read[axis].of(row)
                if named and (name := row.cells["name"]).lower() in NAMELESS:
                    raise ValueError(f"{columns.name} must name an object, got {name!r}; --by names another column")
            except ValueError as error:
                refused.append(Problem(row.place, str(error)))
                break
        if refused:
            return str(refused[0])
    return ""
