"""Names of objects, as MMSI, ICAO addresses and call signs, as the codes by which returns carry them, and back."""

from __future__ import annotations

from hashlib import blake2b

from vedette.space import Indices

_LETTERS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz-_"
_LONGEST = 10
"""Characters of a name that fits into a code."""
_TEXT, _HASHED = 1 << 60, 1 << 62


def code(name: str) -> int:
    """Return the code of a name: -1 of none, a number itself, 10 letters and digits so that they can be read again.

    >>> [code(name) for name in ("235070762", "", "4067f2")]
    [235070762, -1, 1152921509994203779]
    >>> label(code("4067f2")), label(-1)
    ('4067f2', '')
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
    return _HASHED + (int.from_bytes(blake2b(name.encode(), digest_size=8).digest(), "big") >> 4)


def code_of_cell(cell: str) -> int:
    """Return the code of the name in a table's cell: numbers are floats in a column with gaps, as pandas writes them.

    >>> code_of_cell("235070762.0"), code_of_cell("0.0"), code_of_cell("007.0") == code("007.0")
    (235070762, 0, True)
    """
    whole = cell.removesuffix(".0")
    return code(whole if whole.isdigit() and (whole == "0" or whole[0] != "0") else cell)


def label(number: int) -> str:
    """Return the name that a code is of, "" of none; of a name too long for a code, # and a number that stands for it."""
    if number < 0:
        return ""
    if number >= _HASHED:
        return f"#{number - _HASHED:x}"
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
