"""The lines of the files of tracks: each number becomes text once, for the CSV file and for the JSON lines."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from functools import cached_property
from itertools import pairwise
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from vedette.space import Array, Space
from vedette_files.codes import labels
from vedette_files.georeference import PLAIN, Terms
from vedette_files.jsonl.recording import line, units
from vedette_files.jsonl.scans import identity_value
from vedette_files.texts import texts
from vedette_files.tracks.rows import WITHIN, TrackRows, triangles
from vedette_files.tracks.table import columns_of

Texts = NDArray[np.object_]

FORMAT = "vedette tracks"
VERSION = 1

_QUOTE = '"'
_ROWS = 2_000
"""Rows whose numbers are in memory as text at a time."""


def csv_head(space: Space, modes: int, terms: Terms = PLAIN, extra: Sequence[str] = ()) -> str:
    """Return the header of a CSV file of tracks over `space` with so many `modes`, and `extra` columns of `EXTRA`."""
    return ",".join(columns_of(space, modes, terms, extra)) + "\n"


def jsonl_head(space: Space) -> str:
    """Return the first line of a file of tracks over `space`."""
    return line({"format": FORMAT, "version": VERSION, "axes": units(space)})


def chunks(rows: TrackRows) -> Iterator[Chunk]:
    """Yield the lines of some rows at a time, in their order, and after them what is told of tracks without rows."""
    count = len(rows.track)
    for i in range(0, count, _ROWS) if count else (0,):
        yield Chunk(rows, i, min(i + _ROWS, count))


@final
class Chunk:
    """Rows `begin` to `end` of some tracks as text. A number that is not finite is an empty cell, and null in JSON."""

    def __init__(self, rows: TrackRows, begin: int, end: int) -> None:
        self._all, self._end = rows, end
        self._rows = rows if (begin, end) == (0, len(rows.track)) else rows.take(np.arange(begin, end))
        self._first = np.diff(rows.track[max(begin - 1, 0) : end], prepend=-1)[min(begin, 1) :] != 0

    def csv(self, terms: Terms = PLAIN) -> str:
        """Return the lines of a CSV file."""
        rows, (before, after) = self._rows, self._numbers
        in_terms = terms.table(rows.time, rows.space, rows.mean).values()
        more = [list(map(_cell, np.asarray(cells).tolist())) for cells in in_terms]
        if terms.named:
            more.insert(0, list(map(_quoted, labels(rows.identity, len(rows.track)))))
        sure = ["1" if confirmed else "0" for confirmed in rows.confirmed.tolist()]
        if not self._finite:
            before, after = (np.where(cells == "null", "", cells) for cells in (before, after))
        cells = zip(map(str, rows.track.tolist()), *before.T.tolist(), sure, *after.T.tolist(), *more, strict=True)
        return "\n".join([*map(",".join, cells), ""])

    def jsonl(self) -> str:
        """Return JSON lines: one a row, and one more for each track that merged into another."""
        rows, n, modes, (before, after) = self._rows, len(self._rows.space), self._rows.modes.shape[1], self._numbers
        cells = before[:, self._places(n)]
        cells[rows.below.row, 1 + n + rows.below.key] = _texts(rows.below.value)
        sure = ["true" if confirmed else "false" for confirmed in rows.confirmed.tolist()]
        weights, returns = self._weights()
        vector = "[" + ", ".join(["%s"] * n) + "]"
        form = f'{{"track": %s, "time": %s, "mean": {vector}, "cov": [{", ".join([vector] * n)}], "confirmed": %s'
        form += ', "existence": %s, "hit": %s, "nis": %s, "weights": [%s]'
        form += f', "mode_prob": [{", ".join(["%s"] * modes)}]%s' if modes else "%s"
        form += "".join(f', "{name}": %s' for name in rows.extra)
        later = after.T.tolist()
        columns = [rows.track.tolist(), *cells.T.tolist(), sure, *later[:3], weights, *later[3 : 3 + modes], returns]
        columns += later[3 + modes :]
        if rows.identity is not None:
            form += ', "identity": %s'
            columns.append([json.dumps(identity_value(code)) for code in rows.identity.tolist()])
        return "".join([*map((form + "%s").__mod__, zip(*columns, self._ends(), strict=True)), *self._without()])

    @staticmethod
    def _places(n: int) -> list[int]:
        """Return which of the numbers before `confirmed` stand in a line of JSON: time, mean, and the covariance whole."""
        where = np.zeros((n, n), dtype=int)
        where.ravel()[triangles(n)[0]] = 1 + 2 * n + np.arange(n * (n + 1) // 2)
        return [*range(1 + n), *np.maximum(where, where.T).ravel().tolist()]

    @cached_property
    def _numbers(self) -> tuple[Texts, Texts]:
        """The numbers of each row as text, before and after `confirmed`; `null` where one is not finite."""
        rows, n = self._rows, len(self._rows.space)
        extra = [getattr(rows, name) for name in rows.extra]
        diagonal = np.flatnonzero(triangles(n)[0] % (n + 1) == 0)
        deviations = np.sqrt(np.maximum(rows.cov[:, diagonal], 0.0))
        before = np.column_stack([rows.time, rows.mean, deviations, rows.cov])
        after = np.column_stack([rows.existence, rows.hit, rows.nis, rows.modes, *extra])
        self._finite = bool(np.isfinite(before).all() and np.isfinite(after).all())
        return _texts(before), _texts(after)

    def _weights(self) -> tuple[list[str], list[str]]:
        """Return of each row its weights, and which returns they are of, as JSON; none where all of a scan have one."""
        rows, ragged = self._rows, self._rows.weights
        edges, within = np.asarray(ragged.edges(len(rows.track))), rows.columns == WITHIN
        begin = np.concatenate([[0], np.cumsum(1 + np.where(within, np.diff(edges), rows.columns))])
        told = np.full(begin[-1], "0.0", dtype=object)
        told[begin[:-1]] = _texts(rows.miss)
        own = np.where(within[ragged.row], np.arange(len(ragged.row)) - edges[ragged.row], ragged.key)
        told[begin[ragged.row] + 1 + own] = _texts(ragged.value)
        whole, keys = told.tolist(), ragged.key.tolist()
        weights = [", ".join(whole[i:j]) for i, j in pairwise(begin.tolist())]
        spans = zip(within.tolist(), pairwise(edges.tolist()), strict=True)
        return weights, [f', "returns": {keys[i:j]}' if some else "" for some, (i, j) in spans]

    def _ends(self) -> list[str]:
        """Return how the line of each row ends: with the parents of a track that begins, and a line of one that merged."""
        rows, numbers = self._rows, self._rows.track.tolist()
        ends = ["}\n"] * len(numbers)
        if rows.parents:
            for i in np.flatnonzero(self._first).tolist():
                if numbers[i] in rows.parents:
                    ends[i] = f', "parents": {list(rows.parents[numbers[i]])}}}\n'
        if rows.merged:
            after = -1 if self._end == len(self._all.track) else self._all.track[self._end]
            for i in np.flatnonzero(np.diff(rows.track, append=after)).tolist():
                if numbers[i] in rows.merged:
                    ends[i] += _merged(numbers[i], *rows.merged[numbers[i]])
        return ends

    def _without(self) -> list[str]:
        """Return, after the last row, the lines of tracks without rows that merged."""
        if self._end < len(self._all.track):
            return []
        without = sorted(self._all.merged.keys() - set(self._all.track.tolist()))
        return [_merged(number, *self._all.merged[number]) for number in without]


def _texts(numbers: Array) -> Texts:
    return np.array(texts(numbers), dtype=object).reshape(numbers.shape)


def _merged(number: int, time: float, other: int) -> str:
    return line({"track": number, "time": time, "merged_into": other})


def _quoted(name: str) -> str:
    """Return a name as a cell: in quotes where it has a comma, a quote or an end of line."""
    return f'"{name.replace(_QUOTE, _QUOTE * 2)}"' if any(mark in name for mark in ',"\r\n') else name


def _cell(value: Any) -> str:
    if isinstance(value, str):
        return value
    return repr(value) if np.isfinite(value) else ""
