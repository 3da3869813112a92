"""The page of a study: tables with errors, curves with bands, the worst runs with the commands that run them anew."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from shlex import quote
from typing import Any

import numpy as np

from vedette.space import Array
from vedette_files.writing import write_text
from vedette_report.drawing import canvas
from vedette_report.findings import Curve, Panel, Table
from vedette_report.page import page
from vedette_study.chunk import study_figures
from vedette_study.outcome import Outcome
from vedette_study.summary import charts, tables, text
from vedette_study.worst_runs import FOLDER, Bad, judged_by, whole, worst

MOST = 5
"""Worst runs of each point that are named."""
SCRIPTS = ("theme.js", "plots.js", "study.js")


def write_study_page(folder: Path, outcome: Outcome, target: Path) -> None:
    """Write the page of the study in `folder` as one HTML file. It links the runs that were run anew."""
    facts = {
        "words": text(outcome),
        "tables": [_table(table) for table in tables(outcome)],
        "charts": [{"name": chart.name, "panels": [_panel(panel) for panel in chart.panels]} for chart in charts(outcome)],
        "colours": canvas.TRACKS,
        **_worst(folder, outcome, target),
    }
    title = outcome.plan.title or folder.resolve().name
    write_text(target, page(title, facts, SCRIPTS, skeleton="study.html"))


def _worst(folder: Path, outcome: Outcome, target: Path) -> dict[str, Any]:
    every, name = whole(outcome), judged_by(whole(outcome))
    points = [
        {"name": at.name, "runs": [_bad(folder, bad, target) for bad in runs]}
        for at, runs in zip(every.plan.points, worst(outcome, MOST), strict=True)
    ]
    all_of_them = f"vedette report {quote(str(folder))} --worst {MOST}"
    return {
        "worst": points if name else [],
        "judged": [name, study_figures()[name].unit] if name else None,
        "command": all_of_them,
    }


def _bad(folder: Path, bad: Bad, target: Path) -> dict[str, Any]:
    page = folder / FOLDER / bad.name / "report.html"
    link = Path(os.path.relpath(page, target.parent)).as_posix() if page.exists() else None
    return {
        "run": bad.run,
        "value": bad.value,
        "command": f"vedette report {quote(str(folder))} --run {bad.name}",
        "page": link,
    }


def _table(table: Table) -> dict[str, Any]:
    rows = [[label, [[cell.measured, cell.error] for cell in cells]] for label, cells in table.rows]
    return {"title": table.title, "columns": table.columns, "rows": rows}


def _panel(panel: Panel) -> dict[str, Any]:
    low, high = panel.within or (-np.inf, np.inf)
    return {
        "title": panel.title,
        "across": panel.across,
        "upright": panel.upright,
        "logAcross": panel.log_across,
        "log": panel.log,
        "ticks": panel.ticks,
        "within": [low if np.isfinite(low) else None, high if np.isfinite(high) else None],
        "curves": [_curve(i, curve) for i, curve in enumerate(panel.curves)],
    }


def _curve(i: int, curve: Curve) -> dict[str, Any]:
    colours = canvas.TRACKS
    return {
        "label": curve.label,
        "style": curve.style,
        "colour": canvas.SOFT
        if curve.style == "expected"
        else colours[(i if curve.colour is None else curve.colour) % len(colours)],
        "x": _numbers(curve.x),
        "y": _numbers(curve.y),
        "doubt": None if curve.doubt is None else _numbers(curve.doubt),
        "doubtAcross": None if curve.doubt_across is None else _numbers(curve.doubt_across),
        "notes": curve.notes,
    }


def _numbers(values: Array | Sequence[float]) -> list[float | None]:
    """Return numbers with 6 digits, None for what is none."""
    return [float(f"{value:.6g}") if np.isfinite(value) else None for value in values]
