"""From the folder of a run to its page."""

from __future__ import annotations

import html
import json
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from vedette.errors import InputError
from vedette.io import Series, read_series
from vedette.io.atomic import whole_file
from vedette.io.geodesy import Origin
from vedette.io.terms import Terms
from vedette.report import canvas
from vedette.report.page.columns import columns
from vedette.report.page.frames import frames
from vedette.report.page.geography import graticule, read_underlay
from vedette.report.page.packing import Packed
from vedette.space import Array

STYLES = ("uplot/uPlot.min.css", "page.css")
SCRIPTS = ("uplot/uPlot.iife.min.js", "data.js", "ground.js", "seen.js", "map.js", "charts.js", "details.js", "page.js")
_COLUMN = '<script type="text/plain" class="column" data-name="{each.name}" data-type="{each.type}">{each.text}</script>'


def write_page(folder: Path, target: Path, underlay: Path | None = None, origin: Origin | None = None) -> None:
    """Write the page of the run in `folder` as one HTML file, from its files alone.

    `underlay`: a GeoJSON file to lie under the map; `origin`: latitude and longitude in deg of the map's origin, by default
    those that the recording states, if it does.
    """
    series = read_series(folder / "series.npz")
    origin = origin or Terms.of(series.about["notes"]).origin
    packed, placed = columns(series)
    facts = {
        **series.about,
        **placed,
        "words": _text(folder / "summary.txt"),
        "config": _text(folder / "config.json"),
        "colours": {"tracks": canvas.TRACKS, "modes": canvas.MODES},
        "frames": frames(folder / "recording.jsonl"),
        "underlay": [] if underlay is None else read_underlay(underlay, origin),
        "graticule": [] if origin is None else graticule(origin, *_box(series)),
    }
    text = page(series.about["title"] or folder.resolve().name, facts, packed)
    with whole_file(target) as file:
        file.write(text)


def page(title: str, facts: Mapping[str, Any], packed: list[Packed]) -> str:
    """Return the page: the skeleton with styles, facts, columns and scripts in it."""
    data = [f'<script type="application/json" id="facts">{_safe(json.dumps(facts, allow_nan=False))}</script>']
    data += [_COLUMN.format(each=each) for each in packed]
    parts = {
        "TITLE": html.escape(title),
        "STYLES": "".join(f"<style>{_asset(name)}</style>\n" for name in STYLES),
        "DATA": "\n".join(data),
        "SCRIPTS": "".join(f"<script>{_asset(name)}</script>\n" for name in SCRIPTS),
    }
    made = _asset("page.html")
    for name, content in parts.items():
        made = made.replace(f"<!-- {name} -->", content)
    return made


def _box(series: Series) -> tuple[Array, Array]:
    """Return the corners of what the series have on the map."""
    places = np.concatenate([series["returns"]["position"], series["truth"]["position"]])
    known = places[np.isfinite(places).all(axis=1)]
    return (known.min(axis=0), known.max(axis=0)) if len(known) else (np.full(2, -1e3), np.full(2, 1e3))


def _asset(name: str) -> str:
    return files(__package__).joinpath(name).read_text(encoding="utf-8")


def _safe(text: str) -> str:
    """Return JSON that cannot end the script that holds it."""
    return text.replace("<", "\\u003c")


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file; `vedette run` writes it") from None
