"""From the series of a run to its tracks: the rows of those that were ever confirmed, whole or in pieces as the run goes."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any, final

import numpy as np
from attrs import evolve

from vedette import Indices, Space, Track
from vedette_files.codes import code, label
from vedette_files.series import Tables, open_series
from vedette_files.tracks.rows import Ragged, TrackRows

UNNAMED = -2
"""In place of a code until a return has named its object; -1: none is likelier than not."""

_NAMES = re.compile(r'"identity": ("(?:[^"\\]|\\.)*")')

_GIVEN = ("track", "mean", "cov", "confirmed", "existence", "hit", "miss", "nis", "modes")


@final
class SeriesTracks:
    """Takes the tables of a run block by block, and hands out its tracks. It holds those that may still be confirmed."""

    def __init__(self, space: Space) -> None:
        self._space = space
        self._parts = list[TrackRows]()
        self._scans = self._entries = 0
        self._alive = np.zeros(0, np.int64)
        self._told: set[int] = set()
        self._parents: dict[int, tuple[int, ...]] = {}
        self._merged: dict[int, tuple[int, float, int]] = {}

    def add(self, tables: Tables) -> None:
        """Take the next scans, with their tables as `series.npz` has them."""
        scans, entries = tables["scans"], tables["entries"]
        scan = entries["scan"] - self._scans
        given: dict[str, Any] = {name: entries[name] for name in _GIVEN}
        self._parts.append(
            TrackRows(
                space=self._space,
                time=scans["time"][scan],
                columns=scans["columns"][scan].astype(np.int64),
                confirmed_at=entries.get("confirmed_at"),
                link=entries.get("link"),
                identity=entries["identity"],
                below=Ragged.of(*(tables["below"][name] for name in ("entry", "place", "value"))).after(self._entries),
                weights=Ragged.of(*(tables["weights"][name] for name in ("entry", "return", "weight"))).after(self._entries),
                **given,
            )
        )
        for child, parent in zip(tables["splits"]["track"].tolist(), tables["splits"]["parent"].tolist(), strict=True):
            self._parents[child] = (*self._parents.get(child, ()), parent)
        merges = tables["merges"]
        for at, ended, other in zip(merges["scan"].tolist(), merges["track"].tolist(), merges["into"].tolist(), strict=True):
            self._merged[ended] = at, float(scans["time"][at - self._scans]), other
        if self._merged:
            for row in np.flatnonzero(np.isin(entries["track"], list(self._merged))).tolist():
                number, at = int(entries["track"][row]), int(entries["scan"][row])
                if number in self._merged and at > self._merged[number][0]:
                    del self._merged[number]  # a hypothesis that has it became the best
        if len(scans["time"]):
            self._alive = entries["track"][scan == len(scans["time"]) - 1]
        self._scans += len(scans["time"])
        self._entries += len(scan)

    def hand_out(self) -> TrackRows:
        """Return the rows of the tracks that were ever confirmed, track by track: nothing is returned twice.

        What was returned is dropped, and so are tracks that ended unconfirmed. Those that may still be confirmed stay.
        """
        if not self._parts:
            return TrackRows.of((), self._space)
        rows = TrackRows.join(self._parts, self._space)
        codes = np.zeros(0, np.int64) if rows.identity is None else rows.identity
        if named := bool(np.any(codes != UNNAMED)):
            rows = evolve(rows, identity=np.maximum(codes, -1))
        sure = np.isin(rows.track, [*self._told, *np.unique(rows.track[rows.confirmed]).tolist()])
        told = np.flatnonzero(sure)
        confirmed = rows.take(told[np.argsort(rows.track[told], kind="stable")])
        numbers = set(confirmed.track.tolist())
        parents = {number: self._parents[number] for number in numbers - self._told if number in self._parents}
        merged = {number: end[1:] for number, end in self._merged.items() if number in numbers or number in self._told}
        alive, known = set(self._alive.tolist()), self._told | numbers
        self._told = known & alive
        waiting = alive - known
        self._parts = [rows.take(np.flatnonzero(np.isin(rows.track, list(waiting))))]
        self._parents = {number: self._parents[number] for number in waiting if number in self._parents}
        self._merged = {}
        return evolve(confirmed, identity=confirmed.identity if named else None, parents=parents, merged=merged)


def tracks_of_run(series: Path, lines: Path) -> tuple[Track, ...]:
    """Return the tracks of a run by its series, which are read sooner than its JSON lines; these tell long names alone."""
    with open_series(series) as blocks:
        rows = SeriesTracks(Space.of(**dict(blocks.about["axes"])))
        for tables in blocks.blocks():
            rows.add(tables)
        told = rows.hand_out()
    if told.identity is not None:
        _hold_names(told.identity, lines)
    return told.tracks()


def _hold_names(codes: Indices, lines: Path) -> None:
    """Let this process know the names of codes that do not hold them, by the file of the tracks."""
    if any(label(one).startswith("#") for one in np.unique(codes).tolist()):
        with lines.open(encoding="utf-8") as file:
            for name in {found for line in file for found in _NAMES.findall(line)}:
                code(json.loads(name))
