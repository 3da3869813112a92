"""What of a table cannot be read as its first rows let it seem: it is read otherwise, or told."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from attrs import evolve

from vedette.errors import LATE, Problem, VedetteError
from vedette.types import Recording
from vedette_files.readers import NOT_OF_SCAN
from vedette_files.tables.rows import rows
from vedette_tools.drafting.naming import rows_sorted_by
from vedette_tools.drafting.reading import opened
from vedette_tools.drafting.table import AID, Table

UNREAD = 0.5
"""A table of which more rows cannot be read is not the one that its header says."""

LACKING = 0.01
"""Where such a part of the rows has no height, it is not read: their objects are tracked in the plane. By hand."""

KINDS = 3
"""So many kinds of faults are told."""

_OF_ROW = re.compile(r", got .*|\d[\d.e+-]*")
"""What a fault says of its row alone."""


def readable(table: Table) -> tuple[Table, Recording]:
    """Open a table, as it must be read so that no rows are refused that can be taken; it says what was changed."""
    recording = opened(table)
    read = recording.rows["detections"]
    again = any(problem.kind == NOT_OF_SCAN for problem in recording.refused)
    if table.scan and (again or read.refused > UNREAD * read.total):
        told = f"{table.scan} numbers no scans, for it begins again: rows of one time are one"
        table = evolve(table, scan="", assumed=(*table.assumed, told))
        recording = opened(table)
    late = next((str(problem).partition(";")[0] for problem in recording.refused if problem.kind == LATE), "")
    name = _sorted_by(table) if late and table.use == AID and not table.identity else ""
    if name:
        told = f"rows are sorted by {name} before their times, so it names objects"
        left_out = tuple(title for title in table.left_out if title != name)
        table = evolve(table, identity=name, left_out=left_out, sort=True, assumed=(*table.assumed, told))
        recording = opened(table)
    elif late:
        told = f"rows are sorted by time, for some go back: {late}; no clock was set back"
        table = evolve(table, sort=True, assumed=(*table.assumed, told))
        recording = opened(table)
    if table.third:
        begins, total = f"{table.measured[table.third]} must ", recording.rows["detections"].total
        lacking = sum(problem.rows for problem in recording.refused if problem.text.startswith(begins))
        if lacking > LACKING * total:
            table = table.without_third(f"{lacking:,} of {total:,} rows have none")
            recording = opened(table)
    return table, recording


def _sorted_by(table: Table) -> str:
    """Return the column by whose cells the rows are sorted before their times, or ""."""
    titles = Counter(table.left_out)
    wanted = {title: title for title, count in titles.items() if count == 1 and not title.startswith("(")}
    source = table.frame_table or Path(table.path)
    try:
        given = rows(source, wanted | {table.time.title: table.time.title}, "source.detections", table.dialect, [])
        return rows_sorted_by((row.cells for row in given), table.time.title, table.dates)
    except VedetteError:
        return ""


def told_of(refused: Sequence[Problem]) -> str:
    """Name the first row of each kind of fault, the most frequent kinds first, with how many rows have it."""
    kinds: dict[str, list[Problem]] = {}
    for problem in refused:
        kinds.setdefault(_OF_ROW.sub("", problem.text), []).append(problem)
    counts = {kind: sum(problem.rows for problem in of_kind) for kind, of_kind in kinds.items()}
    often = sorted(kinds, key=lambda kind: -counts[kind])
    if len(often) == 1:
        return f", the first of them {refused[0]}"
    told = "; ".join(f"{counts[kind]:,} as {kinds[kind][0]}" for kind in often[:KINDS])
    rest = sum(counts[kind] for kind in often[KINDS:])
    return f": {told}; {rest:,} for other reasons" if rest else f": {told}"
