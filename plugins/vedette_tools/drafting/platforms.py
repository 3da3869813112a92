"""Where the own platform is: in columns of the table of returns, or in a file beside it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from vedette.errors import InputError
from vedette_files.tables.columnar import TablePath, is_columnar
from vedette_files.tables.rows import COMMAS, listed
from vedette_tools.drafting.first_rows import first_rows
from vedette_tools.drafting.several import FLAT, GEODETIC
from vedette_tools.drafting.titles import Meaning, chosen


def file_beside(path: TablePath, platform: Path | None) -> tuple[Meaning, dict[str, Meaning], dict[str, list[str]]] | None:
    """Return the time, the columns by axis and the cells of a file of the own platform, None without one."""
    if platform is None:
        return None
    if not isinstance(path, Path) or platform.resolve().parent != path.resolve().parent:
        raise InputError(f"{platform}: must lie in the folder of the returns, for a config names one folder: copy it there")
    titles, rows, dialect, _ = first_rows(platform)
    if dialect != (COMMAS if is_columnar(path) else first_rows(path)[2]):
        raise InputError(f"{platform}: must have the delimiter and the decimal sign of {path.name}")
    measured, own = chosen(titles)
    if "time" not in measured:
        raise InputError(f"{platform}: no column looks like a time among {listed(titles)}; name it `time` or `t`")
    if not platform_of(measured | own):
        cure = "name them east and north, or latitude and longitude"
        raise InputError(f"{platform}: no columns look like a position of the platform among {listed(titles)}; {cure}")
    return measured["time"], measured | own, {title: [row[i] for row in rows] for i, title in enumerate(titles)}


def platform_of(own: Mapping[str, Meaning]) -> dict[str, Meaning]:
    """Return the platform's columns: its position, and its heading if there is one."""
    if set(GEODETIC) <= set(own):
        pair = {axis: own[axis] for axis in GEODETIC}
    elif {"east", "north"} <= set(own):
        pair = {"x": own["north"], "y": own["east"]}
    elif set(FLAT) <= set(own):
        pair = {axis: own[axis] for axis in FLAT}
    else:
        return {}
    return pair | ({"heading": own["heading"]} if "heading" in own else {})
