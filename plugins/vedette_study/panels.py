"""Panels that set a study's figures beside those that a paper prints."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vedette.space import Array
from vedette_report.consistency import standard_error
from vedette_report.findings import Cell, Curve, Panel, Table


def comparison(
    table: Table,
    columns: Sequence[str],
    upright: str,
    *,
    title: str = "",
    log: bool = False,
    within: tuple[float, float] | None = None,
) -> Panel:
    """Return the table's rows across, for each column a point with a bar of two standard errors, and the published mark."""
    ticks = tuple(label for label, _ in table.rows)
    step = 0.6 / max(1, len(columns))
    curves: list[Curve] = []
    marks: list[Curve] = []
    for i, column in enumerate(columns):
        cells = [table.cell(label, column) for label in ticks]
        x = np.arange(len(cells)) + step * (i - (len(columns) - 1) / 2)
        curves.append(Curve(column, x, _values(cells, "measured"), "points", i, 2 * np.nan_to_num(_values(cells, "error"))))
        printed = _values(cells, "published")
        if np.any(np.isfinite(printed)):
            marks.append(Curve("" if marks else "published", x, printed, "published"))
    return Panel(title, "", upright, (*curves, *marks), log=log, ticks=ticks, within=within)


def mode_panel(title: str, across: str, x: Array, modes: Array, names: Sequence[str], doubt: Array | None = None) -> Panel:
    """Return the mean probabilities (s, q) of the modes with these names at x (s,), in bands of `doubt` (s, q)."""
    wide = [None] * len(names) if doubt is None else list(doubt.T)
    curves = tuple(Curve(name, x, part, doubt=own) for name, part, own in zip(names, modes.T, wide, strict=True))
    return Panel(title, across, "probability", curves, within=(0.0, 1.0))


def mean_over_runs(values: Array) -> tuple[Array, Array]:
    """Return the mean over runs of values (r, ..), and two standard errors of it: (..), (..)."""
    mean: Array = np.mean(values, axis=0)
    error = standard_error(values)
    return mean, np.zeros_like(mean) if error is None else 2 * error


def over_runs(squares: Array) -> tuple[Array, Array]:
    """Return the root mean square over runs of squared errors (r, s), and two standard errors of it: (s,), (s,)."""
    mean, doubt = mean_over_runs(squares)
    root: Array = np.sqrt(mean)
    return root, np.divide(0.5 * doubt, root, out=np.zeros_like(root), where=root > 0)


def _values(cells: Sequence[Cell], name: str) -> Array:
    return np.array([np.nan if (value := getattr(cell, name)) is None else value for cell in cells], dtype=float)
