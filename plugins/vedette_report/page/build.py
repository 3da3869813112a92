"""From the folders of runs to their page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vedette.errors import ConfigError, InputError
from vedette_files import Origin
from vedette_files.writing import write_text
from vedette_report.page.metrics import metrics
from vedette_report.page.run import Shown
from vedette_report.page.skeleton import UPLOT, page

DRAWING = (
    UPLOT,
    "theme.js",
    "data.js",
    "ground.js",
    "seen.js",
    "map.js",
    "charts.js",
    "details.js",
    "metrics.js",
    "page.js",
)
MOST = 4
"""Runs on one page: more cannot be told apart."""


def write_page(run: Path, target: Path, underlay: Path | None = None, origin: Origin | None = None) -> None:
    """Write the page of a run as one HTML file, from its files alone: of its folder, or of series in it.

    `underlay`: a GeoJSON file to lie under the map; `origin`: that of the map, by default what the recording states, if it
    does.
    """
    shown = Shown.read(run)
    facts, packed = shown.facts(underlay, origin)
    facts["metrics"] = _metrics([shown])
    write_text(target, page(shown.series.about["title"] or shown.name, facts, (*DRAWING, "start.js"), [packed]))


def write_comparison(runs: Sequence[Path], target: Path, underlay: Path | None = None, origin: Origin | None = None) -> None:
    """Write the page of several runs, or of a run and its smoothed tracks, side by side. InputError if maps do not agree."""
    if len(runs) > MOST:
        raise InputError(f"{runs[MOST]}: a page compares at most {MOST} runs, got {len(runs)}")
    shown = [Shown.read(path) for path in runs]
    first = shown[0]
    told: list[dict[str, Any]] = []
    columns = []
    centre = None
    for path, run in zip(runs, shown, strict=True):
        if run.map_axes != first.map_axes or run.series.about["unit"] != first.series.about["unit"]:
            wanted, got = (f"{', '.join(one.map_axes) or 'none'} in {one.series.about['unit']}" for one in (first, run))
            raise InputError(f"{path}: the axes of its map must be those of {runs[0]}, {wanted}, got {got}")
        facts, packed = run.facts(underlay if run is first else None, origin if run is first else None, centre)
        centre = np.array(facts["centre"])
        if run is not first:
            facts |= {"underlay": [], "graticule": []}
        told.append(facts)
        columns.append(packed)
    names = [run.name for run in shown]
    if len(set(names)) < len(names):
        names = [str(path) for path in runs]
    compared = {
        "runs": [
            facts | {"name": name, "same": _same(first, run)} for facts, name, run in zip(told, names, shown, strict=True)
        ],
        "metrics": _metrics(shown),
    }
    title = f"{', '.join(names[:-1])} and {names[-1]}"
    write_text(target, page(title, compared, (*DRAWING, "compare.js"), columns))


def _same(first: Shown, other: Shown) -> bool:
    """Return whether both saw the same scans and the same truth, so that it is enough to draw them once."""
    tables = [(run.series["scans"], run.series["returns"], run.series["truth"]) for run in (first, other)]
    wanted = (("time",), ("scan", "position"), ("scan", "position"))
    return all(
        np.array_equal(one[name], two[name], equal_nan=True)
        for one, two, names in zip(*tables, wanted, strict=True)
        for name in names
    )


def _metrics(shown: Sequence[Shown]) -> dict[str, Any]:
    about = shown[0].series.about
    return metrics([each.figures for each in shown], about["modes"], shown[0].map_axes, about["unit"])


def target_of(given: str | None, usual: Path) -> Path:
    """Return the file that --out names, by default the `usual` one; ConfigError if it is a folder."""
    target = Path(given) if given else usual
    if target.is_dir():
        raise ConfigError.at("--out", f"must be a file, and {str(target)!r} is a folder")
    return target
