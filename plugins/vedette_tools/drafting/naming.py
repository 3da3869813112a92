"""The column by which returns name their objects."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from vedette_files.tables.numbers import degrees, is_number
from vedette_files.tables.times import stamp
from vedette_tools.drafting.several import is_angle
from vedette_tools.drafting.titles import ANSWERED, NAMES, OTHER_IDS, PROPERTIES, SENT

ENDS = ("_id", "_uuid", "_guid", "_no", "_nr", "_num", "_number", "_nummer")
"""How titles of names end, by their words alone."""

OFTEN, ONCE = 2.0, 0.9
"""A name of an object stands in so many rows, and in such a part of them alone at its time."""

FEW, SOME, LONE = 5, 20, 0.8
"""So few words may be kinds of the rows of one thing, if so many rows between others of one kind tell its path, and there
are such a part as many times as rows: some loggers mark a place in the second of a fix. By hand."""


def named_by(
    columns: Mapping[str, list[str]], times: Sequence[str], taken: Collection[str], places: Sequence[Sequence[str]] = ()
) -> str:
    """Return the column by which returns name their objects, or "": it holds some names often, and each once at a time.

    taken: what is read besides: a row that repeats it, as one that holds a position until the next one comes, says no more.
    places: the columns of positions; words that go to and fro along the path of one thing are kinds of its rows.
    """
    plain = {name: title for name, title in by_words(columns).items() if title not in taken}
    read = [columns[title] for title in taken if title in columns]
    others = [words for words in plain if words.endswith(ENDS) and not OTHER_IDS & {*words.split("_")}]
    for name in (*NAMES, *others):
        title = plain.get(name) or next(
            (title for words, title in plain.items() if name in (*SENT, *ANSWERED) and words.endswith(name)), ""
        )
        rows = dict.fromkeys(zip(columns[title], times, *read, strict=True)) if title else ()
        told = [row[:2] for row in rows if row[0]]
        once = len(set(told)) >= ONCE * len(told) > 0
        often = name in SENT or len(told) >= OFTEN * len({cell for cell, _ in told})  # what is sent is a name however seldom
        alone = name not in SENT and len({*times}) == len(times)
        if once and often and not _counted(told) and not (alone and of_one(columns[title], times, places)):
            return title
    return _sorted_by(columns, times, taken)


def of_one(names: Sequence[str], times: Sequence[str], places: Sequence[Sequence[str]]) -> bool:
    """Return whether a few names go to and fro along the path of one thing: mostly one at a time, and the usual position
    where the name changes is no farther from the middle of those around it than a tenth of all others are.
    """
    changes = sum(before != after for before, after in pairwise(names))
    few = 1 < len({*names}) <= min(FEW, changes)  # some name comes again
    if not (few and places) or len({*times}) < LONE * len(times):
        return False
    if not all(is_angle(cell) for column in places for cell in column):
        return False
    spots = np.array([[degrees(cell) for cell in column] for column in places])
    apart = np.abs(spots[:, 1:-1] - 0.5 * (spots[:, :-2] + spots[:, 2:]))
    changed = np.array([len({*names[i : i + 3]}) > 1 for i in range(len(names) - 2)])
    if np.sum(~changed) < SOME:
        return False
    usual = np.quantile(apart[:, ~changed], 0.9, axis=-1)
    return bool(np.all(np.median(apart[:, changed], axis=-1) <= usual))


def _sorted_by(columns: Mapping[str, list[str]], times: Sequence[str], taken: Collection[str]) -> str:
    """Return the column by whose cells rows are sorted before their times, which go back where it changes alone; or ""."""
    order: Sequence[Any] = [*map(float, times)] if all(map(is_number, times)) else times
    back = {i for i, (before, after) in enumerate(pairwise(order)) if after < before}
    found: dict[str, int] = {}
    for title, cells in columns.items() if back else ():
        changes = {i for i, (before, after) in enumerate(pairwise(cells)) if after != before}
        twice = sum(order[i] == order[i + 1] for i in {*range(len(cells) - 1)} - changes)
        apart = len({*cells}) == 1 + len(changes) <= len(cells) / OFTEN
        if apart and back <= changes and twice <= (1 - ONCE) * len(cells) and title not in taken and all(cells):
            found[title] = len(changes)
    return max(found, key=lambda title: found[title], default="")


def rows_sorted_by(rows: Iterable[Mapping[str, str]], time: str, pattern: str) -> str:
    """Return the column by whose cells all rows of a table are sorted before their times, or "".

    rows: cells by title, that of the time among them; `pattern`: of dates.
    """
    names: dict[str, set[str]] = {}
    before: Mapping[str, str] = {}
    last, total = 0.0, 0
    for row in rows:
        try:
            moment = stamp(row[time], pattern)[1]
        except ValueError:
            continue
        names = names or {title: set() for title in row if title != time}
        total += 1
        for title in [*names]:
            cell, fresh = row[title], row[title] != before.get(title)
            if not cell or (fresh and cell in names[title]) or (moment < last and not fresh):
                del names[title]
            elif fresh:
                names[title].add(cell)
        if not names:
            return ""
        before, last = row, moment
    held = {title: len(each) for title, each in names.items() if 1 < len(each) <= total / OFTEN}
    return max(held, key=lambda title: held[title], default="")


def _counted(told: Iterable[tuple[str, str]]) -> bool:
    """Return whether names, with their times, only number what is there at a time: 0 and 1, then 0 to 4, then 0 to 2."""
    at = defaultdict[str, set[str]](set)
    for name, time in told:
        at[time].add(name)
    sizes = list(map(len, at.values()))
    fewer = sum(after < before for before, after in pairwise(sizes))
    return fewer > 2 < len({*sizes}) and any(
        all(names == {str(first + i) for i in range(len(names))} for names in at.values()) for first in (0, 1)
    )


def by_words(columns: Iterable[str]) -> dict[str, str]:
    """Return titles by their words alone: playerId by player_id and playerid; ACAddr.val, of a record, by acaddr."""
    plain = {title: title.removeprefix(PROPERTIES).removesuffix(".val") for title in columns}
    apart = {title: re.sub(r"(?<=[a-z])(?=[A-Z])", "_", text) for title, text in plain.items()}
    return {
        re.sub(r"[^a-z0-9]+", "_", text.lower()).strip("_"): title for each in (apart, plain) for title, text in each.items()
    }
