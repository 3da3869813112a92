"""What commands write only if optional libraries are installed, and how they report a missing one."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from importlib.util import find_spec
from pathlib import Path

from vedette_report.drawing.canvas import Look, save, styled
from vedette_report.findings import Chart


def can_write(what: str, extra: str, *modules: str) -> bool:
    """Return whether all modules are installed; otherwise say on standard error how to install them."""
    if all(find_spec(module) for module in modules):
        return True
    print(f"vedette: no {what} without {' and '.join(modules)}: pip install 'vedette[{extra}]'", file=sys.stderr)
    return False


def can_draw() -> bool:
    """Return whether pictures can be drawn."""
    return can_write("pictures", "report", "matplotlib")


def write_charts(folder: Path, charts: Iterable[Chart], look: Look) -> list[str]:
    """Write a picture of each chart; return the names of the files."""
    if not can_draw():
        return []
    from vedette_report.drawing.chart import draw

    written = []
    with styled(look):
        for chart in charts:
            written.append(look.file(chart.name))
            save(draw(chart), folder / written[-1])
    return written
