"""A page as one file: a skeleton with styles, data and scripts in it."""

from __future__ import annotations

import html
import json
from collections.abc import Mapping, Sequence
from importlib.resources import files
from typing import Any

from vedette.errors import InputError
from vedette_report.page.packing import Packed

STYLES = ("uplot/uPlot.min.css", "page.css")
UPLOT = "uplot/uPlot.iife.min.js"
_COLUMN = '<script type="text/plain" class="column" data-run="{}" data-name="{}" data-type="{}">{}</script>'


def page(
    title: str,
    facts: Mapping[str, Any],
    scripts: Sequence[str],
    runs: Sequence[Sequence[Packed]] = (),
    skeleton: str = "page.html",
) -> str:
    """Return the page with its facts, the columns of its runs and its scripts."""
    try:
        told = json.dumps(facts, allow_nan=False)
    except ValueError:
        raise InputError(f"{title}: the files of its run say infinity or nan of what must be a number") from None
    data = [f'<script type="application/json" id="facts">{_safe(told)}</script>']
    data += [_COLUMN.format(i, column.name, column.type, column.text) for i, packed in enumerate(runs) for column in packed]
    parts = {
        "TITLE": html.escape(title),
        "STYLES": "".join(f"<style>{_asset(name)}</style>\n" for name in STYLES),
        "DATA": "\n".join(data),
        "SCRIPTS": "".join(f"<script>{_asset(name)}</script>\n" for name in scripts),
    }
    made = _asset(skeleton)
    for name, content in parts.items():
        made = made.replace(f"<!-- {name} -->", content)
    return made


def _asset(name: str) -> str:
    return files(__package__).joinpath(name).read_text(encoding="utf-8")


def _safe(text: str) -> str:
    """Return JSON that cannot end the script that holds it."""
    return text.replace("<", "\\u003c")
