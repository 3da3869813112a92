"""Columns that are hardly what their titles say: a time that holds words, or stands still, or begins again and again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

from vedette.errors import InputError
from vedette_files.tables.numbers import LARGEST, is_number
from vedette_files.tables.times import LOOKED_AT, stamp
from vedette_tools.drafting.dates import is_day, is_moment, pattern_of
from vedette_tools.drafting.titles import Meaning, meaning, words_of

BEGINS = {"start", "begin", "end", "stop", "first", "eta"}
"""Words of titles of times at which something began or ended, not of those of its rows."""

OF_A_MINUTE = 64
"""Whole numbers below this are the seconds of a minute, with the codes that AIS has for none."""

RISING = 0.1
"""Times that go back in such a part of the rows are in no order. By hand: rows of some objects, one after the other, go
back once an object."""


def doubtful(columns: Mapping[str, Sequence[str]]) -> list[str]:
    """Return the titles of columns that are taken as what their titles say only where no other is.

    Their cells are mostly words or empty, or a time's are all the same; or they are no times, or beyond all latitudes and
    longitudes; or the times are those at which something began, or no times of the rows.
    """
    return [
        title
        for title, cells in columns.items()
        if 2 * sum(any(map(str.isdigit, cell)) for cell in cells) <= len(cells)
        or (meaning(title).axis == "time" and (_is_still(cells) or (_begins_again(cells) and _dates_beside(columns, cells))))
        or _is_doubtful(title, cells)
    ]


def is_no_time(found: Mapping[str, Meaning], columns: Mapping[str, Sequence[str]]) -> bool:
    """Return whether the time that was found by its title is the same in all rows, though frames are counted; or whether it
    is in no order, or goes back as the seconds of a minute do, where another column holds as many dates or more.
    """
    cells = columns[found["time"].title]
    if "scan" in found and _is_still(cells) and not _is_still(columns[found["scan"].title]):
        return True
    return _begins_again(cells) and _dates_beside(columns, cells)


def rising(columns: Mapping[str, Sequence[str]], read: Mapping[str, Meaning]) -> list[str]:
    """Return the titles of numbers that never go back, and do not stand still, but of those that are read."""
    taken = {each.title for each in read.values()}
    held = {title: cells for title, cells in columns.items() if title not in taken and cells and all(map(is_number, cells))}
    times = {title: [*map(float, cells)] for title, cells in held.items()}
    return [title for title, each in times.items() if each[0] < each[-1] and all(a <= b for a, b in pairwise(each))]


def one_moment(place: str, cell: str, others: Sequence[str] = ()) -> InputError:
    """Return the error of a table whose rows all hold the same time; `others` are columns that may hold it."""
    other = f", as {others[0]}, which rises" if others else ""
    if not cell:
        told = "is the time, and empty in all rows, as in a planned route or a track that was shared without its times"
        return InputError(f"{place}: {told}: without times nothing moves; name another column, --time COLUMN{other}")
    several = "add rows of other moments, for one shows no motion"
    return InputError(f"{place}: is the time, and {cell!r} in all rows; name another, --time COLUMN{other}; {several}")


def _is_still(cells: Sequence[str]) -> bool:
    return len({*cells}) == 1 and not is_day(cells[0])


def _dates_beside(columns: Mapping[str, Sequence[str]], cells: Sequence[str]) -> bool:
    """Return whether a column holds at least as many different dates as others hold times."""
    return any(len({*dates}) >= len({*cells}) > 1 and _moments(dates) for dates in columns.values())


def _begins_again(cells: Sequence[str]) -> bool:
    there = [cell for cell in cells if cell]
    if not all(map(is_number, there)):
        return False
    times = [*map(float, there)]
    back = sum(after < before for before, after in pairwise(times))
    of_a_minute = all(time.is_integer() and 0 <= time < OF_A_MINUTE for time in times)
    return back > RISING * len(times) or (of_a_minute and back > 1)


def _is_doubtful(title: str, cells: Sequence[str]) -> bool:
    some, axis = [cell for cell in cells if cell][:LOOKED_AT], meaning(title).axis
    if axis == "time":
        begins = bool(BEGINS & {*words_of(title)})
        return begins or (bool(some) and not any(map(_is_time, some)) and not pattern_of(some)[0])
    if axis in LARGEST:
        return bool(some) and all(is_number(cell) and abs(float(cell)) > LARGEST[axis] for cell in some)
    return False


def _moments(cells: Sequence[str]) -> bool:
    some = [cell for cell in cells if cell][:LOOKED_AT]
    return bool(some) and all(map(is_moment, some))


def _is_time(cell: str) -> bool:
    try:
        return is_day(cell) or bool(stamp(cell))
    except ValueError:
        return False
