"""Tracks after scans as rows of typed columns: what the files of tracks are written from."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
from attrs import evolve, field, frozen

from vedette import Array, Indices, Mask, Space, Track, kernels

WITHIN = -1
"""In place of a number of weights: those of the returns within the track's gate, and the row names these."""

EXTRA = ("confirmed_at", "link")
"""Columns of numbers that not every run has: of retroactive runs, and of those that keep hypotheses."""

_COLUMNS = (
    "track",
    "time",
    "mean",
    "cov",
    "confirmed",
    "existence",
    "hit",
    "miss",
    "nis",
    "modes",
    "confirmed_at",
    "link",
    "identity",
    "columns",
)


@frozen(eq=False)
class Ragged:
    """Values of which each row has some: row (v,), ascending; key (v,), whole numbers; value (v,)."""

    row: Indices
    key: Indices
    value: Array

    @classmethod
    def of(cls, row: Any, key: Any, value: Any) -> Ragged:
        """Make it of anything that numpy takes."""
        return cls(np.asarray(row, np.int64), np.asarray(key, np.int64), np.asarray(value, float))

    def after(self, rows: int) -> Ragged:
        """Return the same with rows numbered from this one on."""
        return evolve(self, row=self.row - rows)

    def take(self, rows: Indices, count: int) -> Ragged:
        """Return the values of some rows of `count`, numbered as they stand in `rows`, each at most once."""
        edges = np.searchsorted(self.row, np.arange(count + 1))
        sizes = np.diff(edges)[rows]
        chosen = kernels.counted(sizes, edges[rows])
        return Ragged(np.repeat(np.arange(len(rows)), sizes), self.key[chosen], self.value[chosen])

    def edges(self, count: int) -> list[int]:
        """Return where the values of each of `count` rows begin, and where the last ones end."""
        return np.searchsorted(self.row, np.arange(count + 1)).tolist()


@frozen(eq=False)
class TrackRows:
    """Tracks after scans, a row each (e,), track by track.

    cov (e, n (n+1) / 2) is the upper triangle row by row; `below` holds what of the lower half is not, bit by bit, the upper
    one: its key is row times n plus column. `columns` (e,) is how many returns the row has weights of, or WITHIN; `weights`
    holds those that are not 0, and within gates all, with the return as key. `identity` are codes of names, -1 for none.
    `parents` are told in a track's first row here, `merged` after its last one, also of a track without rows.
    """

    space: Space
    track: Indices
    time: Array
    mean: Array
    cov: Array
    confirmed: Mask
    existence: Array
    hit: Array
    miss: Array
    nis: Array
    modes: Array
    columns: Indices
    below: Ragged
    weights: Ragged
    confirmed_at: Array | None = None
    link: Array | None = None
    identity: Indices | None = None
    parents: Mapping[int, tuple[int, ...]] = field(factory=dict)
    merged: Mapping[int, tuple[float, int]] = field(factory=dict)

    @classmethod
    def of(cls, tracks: Sequence[Track], space: Space) -> TrackRows:
        """Return the rows of whole tracks, as given. ValueError for one over another space or with other modes."""
        modes, n = mode_count(tracks, space), len(space)
        upper, lower = triangles(n)

        def of_all(name: str, *shape: int, kind: type = float) -> Any:
            given = [getattr(track, name) for track in tracks]
            return np.concatenate([np.zeros((0, *shape), kind), *(values for values in given if values is not None)])

        cov = of_all("cov", n, n).reshape(-1, n * n)
        returns = [given for track in tracks for given in track.returns or [None] * len(track.times)]
        rows = list(zip(returns, [row for track in tracks for row in track.weights], strict=True))
        there = [np.flatnonzero(stands(row[1:])) if given is None else np.arange(len(given)) for given, row in rows]
        keys = [place if given is None else given for place, (given, _) in zip(there, rows, strict=True)]
        values = [row[1:][place] for place, (_, row) in zip(there, rows, strict=True)]
        later = any(track.confirmed_at is not None for track in tracks)
        return cls(
            space=space,
            track=np.repeat(np.array([track.id for track in tracks], np.int64), [len(track.times) for track in tracks]),
            time=of_all("times"),
            mean=of_all("mean", n),
            cov=cov[:, upper],
            confirmed=of_all("confirmed", kind=bool),
            existence=of_all("existence"),
            hit=of_all("hit"),
            miss=np.array([row[0] for _, row in rows]),
            nis=of_all("nis"),
            modes=of_all("mode_prob", modes) if modes else np.zeros((len(cov), 0)),
            columns=np.array([len(row) - 1 if given is None else WITHIN for given, row in rows], np.int64),
            below=below(cov, upper, lower),
            weights=Ragged.of(
                np.repeat(np.arange(len(rows)), list(map(len, values))),
                np.concatenate([np.zeros(0), *keys]),
                np.concatenate([np.zeros(0), *values]),
            ),
            confirmed_at=of_all("confirmed_at") if later else None,
            link=of_all("link") if any(track.link is not None for track in tracks) else None,
            identity=of_all("identity", kind=np.int64) if any(track.identity is not None for track in tracks) else None,
            parents={track.id: track.parents for track in tracks if track.parents},
            merged={track.id: track.merged for track in tracks if track.merged is not None},
        )

    @classmethod
    def join(cls, parts: Sequence[TrackRows], space: Space) -> TrackRows:
        """Return the rows of all parts, one part after the other, without what is told of whole tracks."""
        first = np.cumsum([0, *(len(part.track) for part in parts)])[:-1].tolist()
        whole: dict[str, Any] = {}
        for name in _COLUMNS:
            given = [getattr(part, name) for part in parts]
            whole[name] = None if given[0] is None else np.concatenate(given)
        for name in ("below", "weights"):
            ragged = [getattr(part, name).after(-begin) for part, begin in zip(parts, first, strict=True)]
            whole[name] = Ragged(*(np.concatenate([getattr(part, of) for part in ragged]) for of in ("row", "key", "value")))
        return cls(space=space, **whole)

    def take(self, rows: Indices) -> TrackRows:
        """Return some rows, each at most once."""
        chosen: dict[str, Any] = {name: getattr(self, name).take(rows, len(self.track)) for name in ("below", "weights")}
        for name in _COLUMNS:
            values = getattr(self, name)
            chosen[name] = None if values is None else values[rows]
        return evolve(self, **chosen)

    @property
    def extra(self) -> tuple[str, ...]:
        """The columns that not every run has, and this one does."""
        return tuple(name for name in EXTRA if getattr(self, name) is not None)

    def full_cov(self) -> Array:
        """Return the covariances (e, n, n)."""
        return full_covariances(self.cov, self.below.row, self.below.key, self.below.value)

    def tracks(self) -> tuple[Track, ...]:
        """Return the rows as tracks; one without rows is empty, and says only that it merged."""
        begin = np.flatnonzero(np.diff(self.track, prepend=-1))
        cov, edges = self.full_cov(), self.weights.edges(len(self.track))
        weights, returns = list[Array](), list[Any]()
        for count, miss, (i, j) in zip(self.columns.tolist(), self.miss.tolist(), pairwise(edges), strict=True):
            key, value = self.weights.key[i:j], self.weights.value[i:j]
            row = np.zeros(1 + (j - i if count == WITHIN else count))
            row[0], row[1 + (np.arange(j - i) if count == WITHIN else key)] = miss, value
            weights.append(row)
            returns.append(key if count == WITHIN else None)
        numbers = self.track[begin].tolist()
        without = sorted(self.merged.keys() - set(numbers))
        spans = [*pairwise([*begin.tolist(), len(self.track)]), *([(0, 0)] * len(without))]
        return tuple(
            Track(
                id=number,
                space=self.space,
                times=self.time[i:j],
                mean=self.mean[i:j],
                cov=cov[i:j],
                confirmed=self.confirmed[i:j],
                existence=self.existence[i:j],
                nis=self.nis[i:j],
                hit=self.hit[i:j],
                weights=tuple(weights[i:j]),
                mode_prob=self.modes[i:j] if self.modes.shape[1] else None,
                returns=tuple(returns[i:j]) if any(row is not None for row in returns[i:j]) else None,
                parents=self.parents.get(number, ()),
                merged=self.merged.get(number),
                confirmed_at=None if self.confirmed_at is None else self.confirmed_at[i:j],
                link=None if self.link is None else self.link[i:j],
                identity=None if self.identity is None else self.identity[i:j],
            )
            for number, (i, j) in zip([*numbers, *without], spans, strict=True)
        )


def mode_count(tracks: Sequence[Track], space: Space) -> int:
    """Return the number of modes of all tracks; ValueError for one over another space or with other modes."""
    counts = [0 if track.mode_prob is None else track.mode_prob.shape[1] for track in tracks]
    for track, count in zip(tracks, counts, strict=True):
        if track.space != space or count != counts[0]:
            raise ValueError(f"track {track.id} is over {track.space} with {count} modes, not {space} with {counts[0]}")
    return counts[0] if counts else 0


@cache
def triangles(n: int) -> tuple[Indices, Indices]:
    """Return the places of a matrix's upper triangle and of what is below its diagonal, row times n plus column."""
    return np.ravel_multi_index(np.triu_indices(n), (n, n)), np.ravel_multi_index(np.tril_indices(n, -1), (n, n))


def mirrored(places: Indices, n: int) -> Indices:
    """Return the places of a matrix's elements in its transpose."""
    return places % n * n + places // n


def full_covariances(cov: Array, row: Indices, place: Indices, value: Array) -> Array:
    """Return covariances (e, n, n) of their upper triangles (e, n (n+1) / 2) and what below is not the same."""
    n = math.isqrt(2 * cov.shape[1])
    upper, lower = triangles(n)
    whole = np.empty((len(cov), n * n))
    whole[:, upper] = cov
    whole[:, lower] = whole[:, mirrored(lower, n)]
    whole[row, place] = value
    return whole.reshape(-1, n, n)


def below(cov: Array, upper: Indices, lower: Indices) -> Ragged:
    """Return what of the lower half of matrices (e, n*n) is not, bit by bit, the upper one."""
    n = math.isqrt(cov.shape[1])
    bits = np.ascontiguousarray(cov).view(np.int64)
    row, column = np.nonzero(bits[:, lower] != bits[:, mirrored(lower, n)])
    return Ragged(row, lower[column], cov[row, lower[column]])


def stands(weights: Array) -> Mask:
    """Return which weights are not 0; -0 is written, too."""
    return (weights != 0) | np.signbit(weights)
