"""Boxes that a table holds by two of their corners, as x1, y1, x2, y2: a row of one object, whose place is the middle."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from vedette_files.tables.composed import MIDDLE
from vedette_files.tables.numbers import is_number
from vedette_tools.drafting.titles import Meaning, meaning

CORNERS = (
    ("x1", "x2", "y1", "y2"),
    ("x0", "x1", "y0", "y1"),
    ("xmin", "xmax", "ymin", "ymax"),
    ("minx", "maxx", "miny", "maxy"),
    ("xtl", "xbr", "ytl", "ybr"),
    ("left", "right", "top", "bottom"),
)
"""How titles of the edges of a box end, in small letters and without marks: in x, then in y."""

MOST = 0.99
"""In such a part of the rows the second corner lies beyond the first in both axes. By hand: seldom of two objects."""


def box_of(columns: Mapping[str, Sequence[str]], read: Mapping[str, Meaning]) -> tuple[dict[str, Meaning], str]:
    """Return x and y as the middles of boxes, and what says so, unless positions are `read` from other columns."""
    bare = {re.sub(r"[^a-z0-9]", "", title.lower()): title for title in columns}
    for ends in CORNERS:
        for name in bare:
            stem = name.removesuffix(ends[0])
            edges = [bare.get(f"{stem}{end}", "") for end in ends] if name.endswith(ends[0]) else [""]
            held = {read[axis].title for pair in PLACES for axis in pair if set(pair) <= set(read)}
            if all(edges) and held <= {*edges} and _apart(columns, edges):
                unit = meaning(edges[0]).unit
                pairs = {"x": MIDDLE.join(edges[:2]), "y": MIDDLE.join(edges[2:])}
                told = f"{', '.join(edges)} are two corners of a box, of which the middle is read; its size is not"
                return {axis: Meaning(title, axis, unit, False, True) for axis, title in pairs.items()}, told
    return {}, ""


PLACES = (("x", "y"), ("latitude", "longitude"), ("range", "bearing"), ("east", "north"))
"""Pairs of axes that tell a place."""


def _apart(columns: Mapping[str, Sequence[str]], edges: Sequence[str]) -> bool:
    """Return whether the second edge in x, and in y, lies beyond the first in all rows but few."""
    cells = [row for row in zip(*(columns[edge] for edge in edges), strict=True) if all(map(is_number, row))]
    if not cells:
        return False
    left, right, top, bottom = np.array(cells, dtype=float).T
    return bool(np.mean((left < right) & (top < bottom)) >= MOST)
