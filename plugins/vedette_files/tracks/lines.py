"""The lines of the files of tracks: each number becomes text once, for the CSV file and for the JSON lines."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from functools import cached_property
from itertools import chain
from operator import itemgetter
from typing import Any, final

import numpy as np

from vedette.space import Array, Space
from vedette_files.codes import labels
from vedette_files.georeference import PLAIN, Terms
from vedette_files.jsonl.recording import line, units
from vedette_files.jsonl.scans import identity_value
from vedette_files.tracks.rows import WITHIN, TrackRows, triangles
from vedette_files.tracks.table import columns_of

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
        self._finite = True

    def csv(self, terms: Terms = PLAIN) -> str:
        """Return the lines of a CSV file."""
        rows, before, after = self._rows, *self._numbers
        in_terms = terms.table(rows.time, rows.space, rows.mean).values()
        more = [list(map(_cell, np.asarray(cells).tolist())) for cells in in_terms]
        if terms.named:
            more.insert(0, list(map(_quoted, labels(rows.identity, len(rows.track)))))
        sure = ["1" if confirmed else "0" for confirmed in rows.confirmed.tolist()]
        numbers = [[",".join(line) for line in lines] for lines in (before, after)]
        if not self._finite:
            numbers = [[line.replace("null", "") for line in lines] for lines in numbers]
        cells = zip(map(str, rows.track.tolist()), numbers[0], sure, numbers[1], *more, strict=True)
        return "\n".join([*map(",".join, cells), ""])

    def jsonl(self) -> str:
        """Return JSON lines: one a row, and one more for each track that merged into another."""
        rows, n = self._rows, len(self._rows.space)
        place, back = itemgetter(*self._places(n)), dict[int, list[tuple[int, str]]]()
        for row, key, value in zip(rows.below.row.tolist(), rows.below.key.tolist(), rows.below.value.tolist(), strict=True):
            back.setdefault(row, []).append((1 + n + key, repr(value) if np.isfinite(value) else "null"))
        matrix = ", ".join(["[" + ", ".join(["%s"] * n) + "]"] * n)
        head = '{"track": %s, "time": %s, "mean": [' + ", ".join(["%s"] * n) + f'], "cov": [{matrix}], "confirmed": '
        modes = rows.modes.shape[1]
        last = np.diff(rows.track, append=-1 if self._end == len(self._all.track) else self._all.track[self._end]) != 0
        codes = None if rows.identity is None else rows.identity.tolist()
        lines = list[str]()
        for i, (number, before, sure, after, weights, first, ends) in enumerate(
            zip(
                rows.track.tolist(), self._numbers[0], rows.confirmed.tolist(), self._numbers[1], self._weights(),
                self._first.tolist(), last.tolist(), strict=True,
            )
        ):  # fmt: skip
            texts = place(before)
            if i in back:
                texts = list(texts)
                for spot, text in back[i]:
                    texts[spot] = text
            parts = [head % (number, *texts), "true" if sure else "false"]
            parts.append(', "existence": {}, "hit": {}, "nis": {}, "weights": '.format(*after[:3]) + weights[0])
            if modes:
                parts.append(f', "mode_prob": [{", ".join(after[3 : 3 + modes])}]')
            parts.append(weights[1])
            for name, text in zip(rows.extra, after[3 + modes :], strict=True):
                parts.append(f', "{name}": {text}')
            if codes is not None:
                parts.append(f', "identity": {json.dumps(identity_value(codes[i]))}')
            if first and number in rows.parents:
                parts.append(f', "parents": {list(rows.parents[number])}')
            lines.append("".join([*parts, "}\n"]))
            if ends and number in rows.merged:
                lines.append(_merged(number, *rows.merged[number]))
        if self._end == len(self._all.track):
            without = sorted(rows.merged.keys() - set(self._all.track.tolist()))
            lines += [_merged(number, *rows.merged[number]) for number in without]
        return "".join(lines)

    @staticmethod
    def _places(n: int) -> list[int]:
        """Return which of the numbers before `confirmed` stand in a line of JSON: time, mean, and the covariance whole."""
        where = np.zeros((n, n), dtype=int)
        where.ravel()[triangles(n)[0]] = 1 + 2 * n + np.arange(n * (n + 1) // 2)
        return [*range(1 + n), *np.maximum(where, where.T).ravel().tolist()]

    @cached_property
    def _numbers(self) -> tuple[list[list[str]], list[list[str]]]:
        """The numbers of each row as text, before and after `confirmed`; `null` where one is not finite."""
        rows, n = self._rows, len(self._rows.space)
        extra = [getattr(rows, name) for name in rows.extra]
        diagonal = np.flatnonzero(triangles(n)[0] % (n + 1) == 0)
        deviations = np.sqrt(np.maximum(rows.cov[:, diagonal], 0.0))
        before = np.column_stack([rows.time, rows.mean, deviations, rows.cov])
        return self._texts(before), self._texts(np.column_stack([rows.existence, rows.hit, rows.nis, rows.modes, *extra]))

    def _texts(self, numbers: Array) -> list[list[str]]:
        texts, width = list(map(repr, numbers.ravel().tolist())), numbers.shape[1]
        unknown = np.flatnonzero(~np.isfinite(numbers.ravel())).tolist()
        self._finite &= not unknown
        for i in unknown:
            texts[i] = "null"
        return [texts[i : i + width] for i in range(0, len(texts), width)]

    def _weights(self) -> Iterator[tuple[str, str]]:
        """Yield of each row its weights, and which returns they are of, as JSON."""
        rows = self._rows
        texts = list(chain.from_iterable(self._texts(rows.weights.value[:, None])))
        misses = chain.from_iterable(self._texts(rows.miss[:, None]))
        keys, edges = rows.weights.key.tolist(), rows.weights.edges(len(rows.track))
        for i, (miss, count) in enumerate(zip(misses, rows.columns.tolist(), strict=True)):
            weights, returns = texts[edges[i] : edges[i + 1]], keys[edges[i] : edges[i + 1]]
            if count == WITHIN:
                yield f"[{', '.join([miss, *weights])}]", f', "returns": {returns}'
                continue
            row = ["0.0"] * count
            for key, text in zip(returns, weights, strict=True):
                row[key] = text
            yield f"[{', '.join([miss, *row])}]", ""


def _merged(number: int, time: float, other: int) -> str:
    return line({"track": number, "time": time, "merged_into": other})


def _quoted(name: str) -> str:
    """Return a name as a cell: in quotes where it has a comma, a quote or an end of line."""
    return f'"{name.replace(_QUOTE, _QUOTE * 2)}"' if any(mark in name for mark in ',"\r\n') else name


def _cell(value: Any) -> str:
    if isinstance(value, str):
        return value
    return repr(value) if np.isfinite(value) else ""
