"""The common part of all pictures: their style, their sizes, a figure without global state, its file.

Sizes of letters, lines and marks are those of a screen, where letters have 10 points; a style scales all of them.
"""

from __future__ import annotations

import sys
import warnings
from argparse import ArgumentParser
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, final

import numpy as np
from attrs import frozen

from vedette import Array, ConfigError, Problem

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TRACKS = (
    *("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"),
    *("#332288", "#882255", "#00bf60", "#5b1a0a", "#6f7df2", "#1a1ac8"),
)
"""Colours that readers with any colour vision can tell apart: those of Okabe and Ito, two of Paul Tol, four between them."""

INK, SOFT, FAINT = "#1a1a1a", "#6e6e6e", "#dcdcdc"

MODES = ("#bcd7ea", "#f2b48c", "#9a86d8", "#efe58a", "#b5747f", "#6e8c31")
"""Paler colours for areas."""

_HEAD = 0.62
"""Inches for title and facts."""
_PAPER, _NARROW = 8.0, 5.0
"""Figures narrower than so many inches have no title, and below the second their panels stand below one another."""

_BREAK = np.full((1, 2), np.nan)

Format = Literal["png", "svg", "pdf"]
Width = Literal["screen", "one", "two"]
_SIZES: dict[Width, str] = {"screen": "", "one": "one_column", "two": "two_columns"}


@final
@frozen
class Look:
    """How pictures are written: their format, for a screen or for one or two columns of a page, and the user's own style."""

    form: Format = "png"
    columns: Width = "screen"
    style: Path | None = None

    def file(self, name: str) -> str:
        """Return the name of a picture's file."""
        return f"{name}.{self.form}"


def add_pictures(parser: ArgumentParser) -> None:
    """Add the options of a command that say how pictures are drawn."""
    parser.add_argument(
        "--format", default="png", choices=["png", "svg", "pdf"], help="format of the pictures; default: png"
    )
    parser.add_argument(
        "--columns",
        default="screen",
        choices=["screen", "one", "two"],
        help="size of the pictures: for a screen, or for one or two columns of a paper; default: screen",
    )
    parser.add_argument("--style", metavar="FILE", help="a matplotlib style file, applied after Vedette's own")


@contextmanager
def styled(look: Look | None = None) -> Iterator[Look]:
    """Draw with Vedette's style, that of the size, and the user's on top; ConfigError if there is no such style."""
    from matplotlib import rc_context, rc_params_from_file

    look, own = look or Look(), files(__package__) / "styles"
    names = [own / f"{name}.mplstyle" for name in ("screen", _SIZES[look.columns]) if name]
    with rc_context():
        import matplotlib as mpl

        for path in names:
            mpl.rcParams.update(rc_params_from_file(str(path), use_default_template=False))
        if look.style is not None:
            mpl.rcParams.update(read_style(look.style))
        yield look


def read_style(path: Path) -> Any:
    """Return the settings of a style file; ConfigError with its line if matplotlib does not know one of them."""
    import logging

    from matplotlib import rc_params_from_file

    told: list[logging.LogRecord] = []
    log, listener = logging.getLogger("matplotlib"), logging.Handler()
    listener.emit = told.append  # type: ignore[method-assign, assignment]  # matplotlib logs what it refuses
    log.addHandler(listener)
    try:
        settings = rc_params_from_file(str(path), use_default_template=False)
    except OSError as error:
        raise ConfigError.at("--style", f"{path}: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise ConfigError.at("--style", f"{path}: must be a matplotlib style, in UTF-8") from None
    finally:
        log.removeHandler(listener)
    if told:
        raise ConfigError([Problem("--style", record.getMessage().strip().partition("\n")[0]) for record in told])
    return settings


def colour(i: int) -> str:
    """Return the colour of the i-th track or object: that of the style, if one was given."""
    return colours(i + 1)[i]


def colours(count: int) -> list[str]:
    """Return the colours of the first tracks or objects."""
    import matplotlib as mpl

    cycle = mpl.rcParams["axes.prop_cycle"]
    given = [] if cycle == mpl.rcParamsDefault["axes.prop_cycle"] else cycle.by_key().get("color", [])
    one_turn = [str(shade) for shade in given or TRACKS]
    return (one_turn * (1 + count // len(one_turn)))[:count]


def letters(points: float = 10.0) -> float:
    """Return the size of letters in points, by that on a screen."""
    return points * _setting("font.size") / 10.0


def stroke(points: float = 1.5) -> float:
    """Return the width of a line in points, by that on a screen."""
    return points * _setting("lines.linewidth") / 1.5


def mark(points: float = 6.0) -> float:
    """Return the size of a mark in points, by that on a screen."""
    return points * _setting("lines.markersize") / 6.0


def _setting(name: Literal["font.size", "lines.linewidth", "lines.markersize"]) -> float:
    import matplotlib as mpl

    return float(mpl.rcParams[name])


def width() -> float:
    """Return the width of pictures in inches."""
    import matplotlib as mpl

    return float(mpl.rcParams["figure.figsize"][0])


def on_paper() -> bool:
    """Return whether pictures are for a paper: what their titles would say belongs in captions."""
    return width() < _PAPER


def across(panels: int) -> int:
    """Return how many panels stand beside one another, where a wide figure has so many."""
    return 1 if width() < _NARROW else panels


def stacked(panels: int) -> float:
    """Return the inches, of a figure of 12, of so many panels below one another, each as wide as the figure."""
    return (2.5 if width() >= _NARROW else 4.6) * panels


def wrapped(words: str) -> str:
    """Return the label of an axis, on two lines where a panel is small."""
    from textwrap import wrap

    return words if width() >= _NARROW else "\n".join(wrap(words, 1 + max(16, len(words) // 2)))


def legend(size: float = 10.0) -> dict[str, Any]:
    """Return how all legends look, with letters of this size on a screen."""
    narrow = {"handlelength": 1.4, "columnspacing": 0.9, "handletextpad": 0.5, "borderpad": 0.1}
    looks: dict[str, Any] = {"frameon": False, "fontsize": letters(min(size, 9.0)), "labelcolor": INK} | narrow
    return looks if width() < _NARROW else {"frameon": False, "fontsize": letters(size), "labelcolor": INK}


def figure(body: float, designed: int = 1, *, words: float = 0.0, foot: float = 0.0, more: float = 0.0) -> Figure:
    """Return an empty figure as wide as the style says, with room for a head, if it has one, and a foot.

    `body`: inches of the panels in a figure of 12 inches that has `designed` of them beside one another. The others are
    inches where letters have 10 points: `words` of legends and the like among the panels, `foot` of text below them, `more`
    of text above them beyond a title and one line of facts.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    wide, text = width(), letters(1.0)
    above, foot = text * ((0.0 if on_paper() else _HEAD) + more), text * foot
    height = body * wide / 12.0 * designed / across(designed) + text * words + above + foot
    room = (0.0, foot / height, 1.0, 1.0 - (above + foot) / height)
    pad = 0.1 * min(1.0, wide / 12.0 + 0.1)
    layout = ConstrainedLayoutEngine(rect=room, w_pad=pad, h_pad=0.6 * pad, hspace=0.03, wspace=0.03)
    made = Figure(figsize=(wide, height), layout=layout, facecolor="white")
    FigureCanvasAgg(made)
    return made


def head(made: Figure, title: str, facts: str) -> None:
    """Write a title, and under it in smaller letters what the picture shows; for a paper into the file alone."""
    from textwrap import shorten

    made.set_label(f"{title}\n{facts}")
    if on_paper():
        return
    height = made.get_figheight() / letters(1.0)
    bold: dict[str, Any] = {"fontsize": letters(15), "fontweight": "bold", "color": INK}
    made.text(0.012, 1.0 - 0.32 / height, shorten(title, 105, placeholder=" ..."), **bold)
    told = made.text(0.012, 1.0 - 0.56 / height, facts, fontsize=letters(10.5), color=SOFT)
    room = 0.976 * made.bbox.width / max(told.get_window_extent().width, 1.0)
    told.set_fontsize(letters(10.5) * min(room, 1.0))  # what is long is smaller, not cut


def lines(axes: Axes, paths: Sequence[Array], colours: Sequence[str], **looks: Any) -> None:
    """Draw paths (s, 2) in these colours, all of one colour as one line, broken between them.

    A line costs some 100 us beside its points, and only a line leaves out the points that nobody can see.
    """
    pieces: dict[str, list[Array]] = {}
    for path, shade in zip(paths, colours, strict=True):
        pieces.setdefault(shade, [_BREAK]).extend((path, _BREAK))
    for shade, parts in pieces.items():
        axes.plot(*np.concatenate(parts[1:-1]).T, color=shade, **looks)


def plain(axes: Axes) -> None:
    """Remove what carries no information."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(SOFT)
    axes.tick_params(which="both", colors=SOFT, labelsize=letters(9.5))
    axes.xaxis.label.set_fontsize(letters())
    axes.yaxis.label.set_fontsize(letters())
    axes.grid(visible=True, color=FAINT, linewidth=stroke(0.6))
    axes.set_axisbelow(True)


_UNDATED: dict[str, dict[str, Any]] = {
    "png": {"Software": None},
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Producer": None, "Creator": None},
}
_NAMES = {"png": ("Title", "Description"), "svg": ("Title", "Description"), "pdf": ("Title", "Subject")}
"""What the file calls the title and the facts of a picture."""


@contextmanager
def _without_glyphs(path: Path) -> Iterator[None]:
    """Tell in a line that a picture's font lacks characters, in place of a warning for each of them."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        yield
    lacking = [warning for warning in told if "missing from" in str(warning.message)]
    if lacking:
        cure = "boxes stand for them; a --style with another font.family shows them"
        print(f"vedette: note: {path.name}: the font lacks {len(lacking)} characters: {cure}", file=sys.stderr)
    for warning in told:
        if warning not in lacking:
            warnings.warn_explicit(warning.message, warning.category, warning.filename, warning.lineno)


def save(made: Figure, path: Path) -> None:
    """Write a PNG, SVG or PDF, by the path's suffix; the same figure gives the same bytes."""
    from matplotlib import rc_context

    form = path.suffix[1:].lower()
    if form not in _NAMES:
        raise ConfigError.at("path", f"a picture must end in {', '.join(f'.{one}' for one in _NAMES)}, got {path.name!r}")
    title, _, facts = str(made.get_label()).partition("\n")
    named = {name: text for name, text in zip(_NAMES[form], (title, facts), strict=True) if text}
    settings: dict[Any, Any] = {"svg.hashsalt": path.stem, "svg.fonttype": "none", "pdf.fonttype": 42}
    with (
        _without_glyphs(path),
        rc_context(settings | {"figure.autolayout": False, "figure.constrained_layout.use": False}),
    ):
        if (layout := made.get_layout_engine()) is not None:
            # savefig draws twice while there is a layout engine: once for the layout alone
            if any(axes.get_subplotspec() for axes in made.axes):  # else there is nothing to lay out, as without a track
                layout.execute(made)
            made.set_layout_engine(None)
        made.savefig(path, format=form, metadata=_UNDATED[form] | named)
