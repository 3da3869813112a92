"""The common part of all pictures: a figure without global state, its colours, its file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TRACKS = (
    *("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"),
    *("#332288", "#882255", "#117733", "#999933", "#44aa99", "#aa4499"),
)
"""Colours that people with any colour vision can tell apart: those of Okabe and Ito, then those of Paul Tol."""

INK, SOFT, FAINT = "#1a1a1a", "#6e6e6e", "#dcdcdc"

MODES = ("#bcd7ea", "#f2b48c", "#9fd3bf", "#e3c2d6", "#f4d58d", "#c9c4e6")
"""Paler colours for areas."""


def colour(i: int) -> str:
    """Return the colour of the i-th track or object."""
    return TRACKS[i % len(TRACKS)]


_HEAD = 0.62
"""Inches for title and facts."""


def figure(height: float = 9.0, foot: float = 0.0, more: float = 0.0) -> Figure:
    """Return an empty figure, 1200 px wide and 100 px for each of its inches high, with room for a head and a foot.

    `more`: inches beyond those of a title and one line of facts.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    room = (0.0, foot / height, 1.0, 1.0 - (_HEAD + more + foot) / height)
    layout = ConstrainedLayoutEngine(rect=room, w_pad=0.1, h_pad=0.06, hspace=0.03, wspace=0.03)
    made = Figure(figsize=(12.0, height), dpi=100, layout=layout, facecolor="white")
    FigureCanvasAgg(made)
    return made


def head(made: Figure, title: str, facts: str) -> None:
    """Write a title, and under it in smaller letters what the picture shows."""
    from textwrap import shorten

    height = made.get_figheight()
    made.text(0.012, 1.0 - 0.32 / height, shorten(title, 105, placeholder=" ..."), fontsize=15, fontweight="bold", color=INK)
    made.text(0.012, 1.0 - 0.56 / height, facts, fontsize=10.5, color=SOFT)


def plain(axes: Axes) -> None:
    """Remove what carries no information."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(SOFT)
    axes.tick_params(which="both", colors=SOFT, labelsize=9.5)
    axes.grid(visible=True, color=FAINT, linewidth=0.6)
    axes.set_axisbelow(True)


_UNDATED: dict[str, dict[str, Any]] = {
    "png": {"Software": None},
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Producer": None, "Creator": None},
}


def save(made: Figure, path: Path) -> None:
    """Write a PNG, SVG or PDF, by the path's suffix; the same figure gives the same bytes."""
    from matplotlib import rc_context

    form = path.suffix[1:]
    with rc_context({"svg.hashsalt": path.stem, "svg.fonttype": "none", "pdf.fonttype": 42}):
        made.savefig(path, format=form, metadata=_UNDATED[form])
