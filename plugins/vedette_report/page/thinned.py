"""The series of a run as far as a page can show them: every scan, or one in so many of a long run."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from vedette_files import Column, Series, Tables, open_series

MOST = {"scans": 200_000, "returns": 1_000_000, "entries": 1_000_000, "weights": 4_000_000}
"""Rows that a page shows at most; chosen by hand so that the page of some 60 MB is still drawn by a browser."""


def read_thinned(path: Path) -> tuple[Series, int]:
    """Return the series, read block by block, of one scan in `every`, and that number: 1 unless there are too many rows.

    Scans and entries are numbered anew. InputError as from `read_series`.
    """
    with open_series(path) as arrays:
        rows = arrays.rows()
        every = max(1, *(-(-rows.get(table, 0) // most) for table, most in MOST.items()))
        parts, thin = list[Tables](), _Thin(every)
        for block in arrays.blocks():
            parts.append(thin.of(block))
        tables = {
            table: {name: np.concatenate([part[table][name] for part in parts]) for name in columns}
            for table, columns in (parts[0] if parts else {}).items()
        }
        return Series(arrays.about, tables), every


class _Thin:
    """Takes one scan in `every` of each block, and knows how many scans and entries came before it, and were kept."""

    def __init__(self, every: int) -> None:
        self._every = every
        self._scans = self._entries = self._kept = 0

    def of(self, block: Tables) -> Tables:
        """Return the rows of the next block that are kept."""
        every, first = self._every, -self._scans % self._every
        own = block["entries"]["scan"] % every == 0
        number = self._kept + np.cumsum(own) - 1
        part: dict[str, dict[str, Column]] = {}
        for table, columns in block.items():
            if table == "scans":
                part[table] = {name: values[first::every] for name, values in columns.items()}
            elif "entry" in columns:
                entry = columns["entry"] - self._entries
                kept = own[entry]
                part[table] = {name: values[kept] for name, values in columns.items()}
                part[table]["entry"] = number[entry[kept]]
            else:
                kept = columns["scan"] % every == 0
                part[table] = {name: values[kept] for name, values in columns.items()}
                part[table]["scan"] = part[table]["scan"] // every
        self._scans += len(block["scans"]["time"])
        self._entries, self._kept = self._entries + len(own), self._kept + int(np.count_nonzero(own))
        return part
