"""Names of objects, as MMSI, ICAO addresses and call signs, as the codes by which returns carry them, and back."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterable
from hashlib import blake2b
from typing import final

from vedette.space import Indices

_LETTERS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz-_"
_LONGEST = 10
"""Characters of a name that fits into a code."""
_TEXT, _HASHED = 1 << 60, 1 << 62
_HELD = 1 << 25
"""Characters of longer names that a process holds, and 100 more for each of them: 250,000 of UUIDs. Those that were not read
for the longest time are dropped, as a service may run for years. Set by hand, for some 50 MB.
"""


@final
class _LongNames:
    """Holds what names were read that do not fit into a code, by their codes."""

    def __init__(self, most: int) -> None:
        self._most, self._size = most, 0
        self._names: OrderedDict[int, str] = OrderedDict()

    def hold(self, number: int, name: str) -> None:
        if number not in self._names:
            self._size += len(name) + 100
        self._names[number] = name
        self._names.move_to_end(number)
        while self._size > self._most:
            self._size -= len(self._names.popitem(last=False)[1]) + 100

    def get(self, number: int) -> str | None:
        return self._names.get(number)


_LONG = _LongNames(_HELD)


def code(name: str) -> int:
    """Return the code of a name: -1 of none, a number itself, 10 letters and digits so that they can be read again.

    Longer names, and those of other characters, are held by the process, for `label`.

    >>> [code(name) for name in ("235070762", "", "4067f2")]
    [235070762, -1, 1152921509994203779]
    >>> label(code("4067f2")), label(-1), label(code("St. Peter Line"))
    ('4067f2', '', 'St. Peter Line')
    """
    if not name:
        return -1
    if len(name) <= 15 and name.isascii() and name.isdigit() and (name[0] != "0" or name == "0"):
        return int(name)
    if len(name) <= _LONGEST and all(letter in _LETTERS for letter in name):
        number = 0
        for letter in name:
            number = number * 64 + _LETTERS.index(letter) + 1
        return _TEXT + number
    digest = blake2b(name.encode(), digest_size=8).digest()
    number = _HASHED + (int.from_bytes(digest, "big") >> 4)
    _LONG.hold(number, name)
    return number


NAMELESS = ("", "nan", "none", "null", "<na>")
"""What stands in a cell that names no object, in small letters."""


def code_of_cell(cell: str) -> int:
    """Return the code of the name in a table's cell: numbers are floats in a column with gaps, as pandas writes them, and
    what is written for a gap is none.

    >>> code_of_cell("235070762.0"), code_of_cell("0.0"), code_of_cell("007.0") == code("007.0"), code_of_cell("NaN")
    (235070762, 0, True, -1)
    """
    if cell.lower() in NAMELESS:
        return code("")
    whole = cell.removesuffix(".0")
    return code(whole if whole.isdigit() and (whole == "0" or whole[0] != "0") else cell)


def label(number: int) -> str:
    """Return the name that a code is of, "" of none, and # and a number of a long one that this process has not read."""
    if number < 0:
        return ""
    if number >= _HASHED:
        return _LONG.get(number) or f"#{number - _HASHED:x}"
    if number < _TEXT:
        return str(number)
    letters, number = [], number - _TEXT
    while number > 0:
        number, rest = divmod(number - 1, 64)
        letters.append(_LETTERS[rest])
    return "".join(reversed(letters))


def labels(codes: Indices | None, count: int) -> list[str]:
    """Return the names of so many codes, "" where there are none."""
    return [""] * count if codes is None else [label(code) for code in codes.tolist()]


def long_names(codes: Iterable[int]) -> list[str]:
    """Return the names of these codes that cannot be read from them: where codes are kept, these are, too; see `code`."""
    return sorted({name for number in codes if number >= _HASHED and (name := _LONG.get(number))})
