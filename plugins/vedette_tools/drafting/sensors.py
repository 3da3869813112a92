"""The sensors that a column names, and those whose returns are what objects report of themselves."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vedette_tools.drafting.naming import by_words
from vedette_tools.drafting.several import GEODETIC, HELD
from vedette_tools.drafting.titles import OF_REPORTS, SENT, Meaning, words_of

MOST_SENSORS = 20
"""A column of more names than these is not taken to name sensors."""


def who_of(
    measured: Mapping[str, Meaning], columns: Mapping[str, list[str]], assumed: list[str]
) -> tuple[str, tuple[str, ...]]:
    """Return the column that names sensors, and their names; none unless it names several, but not too many."""
    named = measured.get("sensor")
    who = named.title if named is not None and (named.sure or "type" not in words_of(named.title)) else ""
    sensors = tuple(sorted({cell for cell in columns[who] if cell})) if who else ()
    if len(sensors) == 1:
        assumed.append(f"all returns are of one sensor: {who} names only {sensors[0]}")
    if len(sensors) > MOST_SENSORS:
        assumed.append(f"{who} has more than {MOST_SENSORS} names, so all returns are of one sensor")
    return (who, sensors) if 1 < len(sensors) <= MOST_SENSORS else ("", ())


def reports_of(pairs: Mapping[str, tuple[str, str]], columns: Mapping[str, list[str]], who: str) -> tuple[str, ...]:
    """Return the sensors whose returns are positions on the earth that objects report of themselves."""
    told = [columns[title] for plain, title in by_words(columns).items() if is_sent(plain)]

    def sent(sensor: str) -> bool:
        rows = np.array(columns[who]) == sensor if who else slice(None)
        filled = (np.array(cells)[rows] != "" for cells in told)
        return len(pairs) > 1 > len(who) or any(each.size and each.mean() >= HELD for each in filled)

    return tuple(sensor or "sensor" for sensor, pair in pairs.items() if pair == GEODETIC and told and sent(sensor))


def is_sent(plain: str) -> bool:
    """Return whether a title, by its words alone, is of what objects report of themselves."""
    return plain in OF_REPORTS or plain.endswith(SENT)
