"""The column by which returns name their objects."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence

from vedette_tools.drafting.titles import NAMES, PROPERTIES, SENT

OFTEN, ONCE = 2.0, 0.9
"""A name of an object stands in so many rows, and in such a part of them alone at its time."""


def named_by(columns: Mapping[str, list[str]], times: Sequence[str], taken: Collection[str]) -> str:
    """Return the column by which returns name their objects, or "": it holds some names often, and each once at a time."""
    plain = {name: title for name, title in by_words(columns).items() if title not in taken}
    rows = list(dict.fromkeys(zip(times, *columns.values(), strict=True)))  # a row that stands twice says no more
    place = {title: 1 + i for i, title in enumerate(columns)}
    for name in NAMES:
        title = plain.get(name) or next(
            (title for words, title in plain.items() if name in SENT and words.endswith(name)), ""
        )
        told = [(row[place[title]], row[0]) for row in rows if row[place[title]]] if title else []
        if len(told) >= OFTEN * len({cell for cell, _ in told}) and len(set(told)) >= ONCE * len(told) > 0:
            return title
    return ""


def by_words(columns: Iterable[str]) -> dict[str, str]:
    """Return titles by their words alone."""
    return {re.sub(r"[^a-z0-9]+", "_", title.lower().removeprefix(PROPERTIES)).strip("_"): title for title in columns}
