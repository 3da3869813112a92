"""Errors and their normalised squares against time: the data of the picture of errors and the summary's verdicts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from functools import reduce
from operator import and_
from typing import Any, final

import numpy as np
from attrs import Factory, define, field, frozen

from vedette import Array, Experiment, Indices, Mask, Result, Trajectory
from vedette.config import plain
from vedette.metrics import (
    NONE,
    Block,
    Entries,
    Figure,
    RunningJudge,
    Score,
    chi_square_band,
    positions,
    space_of,
    velocities,
)

BAND = 0.05
"""Probability with which a correct filter's normalised squared error leaves the band that is shown."""


@frozen(eq=False)
class Trace:
    """How one true object was followed at the `s` judged scans while it existed.

    times (s,) s; track (s,) indexes the result's tracks, NONE where none covers it, and there all else is NaN.
    error (s,) m and speed_error (s,) m/s are lengths; sigma (s,) and speed_sigma (s,) what the filter itself expects of
    their root mean square; nees (s,) that of the position over its `axes`; modes (s, r) the mode probabilities, if any.
    """

    name: str
    times: Array
    track: Indices
    error: Array
    sigma: Array
    speed_error: Array
    speed_sigma: Array
    nees: Array
    axes: int
    modes: Array | None

    @property
    def covered(self) -> Mask:
        """Where a track covers it (s,)."""
        return self.track != NONE


@frozen(eq=False)
class Normalised:
    """Squared errors over their own covariances, one for each `e` entry: times (e,), track (e,), value (e,), axes (e,)."""

    times: Array
    track: Indices
    value: Array
    axes: Indices

    def inside(self) -> float | None:
        """Return the fraction of the values in the band of chi-square; None if there is none."""
        return Inside().add(self.value, self.axes).part


@final
@define
class Inside:
    """Counts the normalised squared errors that lie in the band of chi-square; `axes` says how many have so many axes."""

    inside: int = 0
    count: int = 0
    axes: dict[int, int] = field(factory=dict)

    def add(self, value: Array, axes: Indices) -> Inside:
        """Count the values (e,) over so many axes (e,) each."""
        self.count += len(value)
        for count in np.unique(axes).tolist():
            low, high = band(count)
            values = value[axes == count]
            self.inside += int(np.count_nonzero((low <= values) & (values <= high)))
            self.axes[count] = self.axes.get(count, 0) + len(values)
        return self

    @property
    def part(self) -> float | None:
        """The fraction inside; None if there is none."""
        return self.inside / self.count if self.count else None


@frozen(eq=False)
class Judged:
    """What the judge said of a run: its score, and its blocks, in which `names` (t,) are those of the result's tracks."""

    score: Score
    blocks: tuple[Block, ...]
    names: Indices

    @classmethod
    def of(cls, experiment: Experiment, result: Result, figures: Sequence[Figure] = ()) -> Judged:
        """Judge a result anew: one whose tracks are not those that were judged as they went, or that nobody judged."""
        tracker, options, tracks = experiment.tracker, experiment.judge, result.tracks
        judging = RunningJudge(
            result.recording.truth,
            space_of(tracks),
            options,
            tracker.gate.probability,
            sensors=tracker.sensors,
            figures=figures,
            keep=np.inf,
            nobody=result.recording.nobody,
        )
        blocks = judging.take(tracks, result.scans)
        return cls(judging.score(), blocks, np.arange(len(tracks)))

    @property
    def bands(self) -> Bands:
        """How many squared errors lie in their bands."""
        bands = Bands()
        for block in self.blocks:
            bands.add(block)
        return bands

    def traces(self, truth: Sequence[Trajectory]) -> tuple[Trace, ...]:
        """Return a trace for each of the first true objects, in the order of the recording; none if no scan is judged."""
        if not self.score.scans:
            return ()
        parts: list[list[Trace]] = [[] for _ in truth]
        for block in self.blocks:
            for j in np.flatnonzero(block.which < len(truth)).tolist():
                number = int(block.which[j])
                parts[number].append(_trace(block, j, truth[number].name, self.names))
        return tuple(_joined(path.name, part) for path, part in zip(truth, parts, strict=True))

    def position_nees(self) -> Normalised:
        """Return the NEES of the positions of all covered objects."""
        rows = list[Array]()
        for block in self.blocks:
            seen = np.flatnonzero(np.isfinite(block.pairs.nees))
            entry, axes = block.pairs.entry[seen], len(positions(block.found.truth.space))
            rows.append(self._rows(block, entry, block.pairs.nees[seen], np.full(len(seen), axes)))
        return _normalised(rows)

    def innovations(self) -> Normalised:
        """Return the NIS of confirmed tracks where a return was probably theirs (over 1/2), given that one was."""
        rows = list[Array]()
        for block in self.blocks:
            entries = block.found.entries
            seen = np.flatnonzero(with_innovation(entries, block.chosen))
            rows.append(self._rows(block, seen, entries.nis[seen] / entries.hit[seen], block.axes[entries.scan[seen]]))
        return _normalised(rows)

    def _rows(self, block: Block, entry: Indices, value: Array, axes: Indices) -> Array:
        """Return times, tracks, values and axes of some entries, (4, e)."""
        entries = block.found.entries
        track = np.searchsorted(self.names, entries.track[entry])
        return np.stack([block.times[entries.scan[entry]], track, value, axes])


@frozen(eq=False)
class Bands:
    """How many squared errors of a run lie in their bands: the NEES of covered objects' positions, the tracks' NIS."""

    nees: Inside = Factory(Inside)
    nis: Inside = Factory(Inside)

    def add(self, block: Block) -> None:
        """Count a block of a run that is judged as it goes."""
        match, spot = block.found, positions(block.found.truth.space)
        values = block.pairs.nees[np.isfinite(block.pairs.nees)]
        self.nees.add(values, np.full(len(values), len(spot)))
        chosen = with_innovation(match.entries, block.chosen)
        scan = match.entries.scan[chosen]
        self.nis.add(match.entries.nis[chosen] / match.entries.hit[chosen], block.axes[scan])


def band(axes: int) -> tuple[float, float]:
    """Return the chi-square band of one normalised squared error over `axes` axes."""
    low, high = chi_square_band(axes, BAND)
    return axes * low, axes * high


def _trace(block: Block, j: int, name: str, names: Indices) -> Trace:
    match, pairs = block.found, block.pairs
    space, times = match.truth.space, block.times[match.scans]
    rows = pairs.truth == j
    error, cov = pairs.error[rows], match.entries.cov[pairs.entry[rows]]
    spot, speed = positions(space), velocities(space)

    def spread(values: Array) -> Array:
        """Spread values of the covered scans (q, ..) among all scans (s, ..)."""
        everywhere = np.full((len(times), *np.shape(values)[1:]), np.nan)
        everywhere[pairs.scan[rows]] = values
        return everywhere[alive]

    alive = match.truth.alive[:, j]
    cover = match.cover[alive, j]
    modes, unknown = match.entries.mode_prob, np.full(len(error), np.nan)
    return Trace(
        name=name,
        times=times[alive],
        track=np.where(cover == NONE, NONE, np.searchsorted(names, cover)),
        error=spread(np.linalg.norm(error[:, spot], axis=-1)),
        sigma=spread(sigma_of(cov, spot)),
        speed_error=spread(np.linalg.norm(error[:, speed], axis=-1) if speed else unknown),
        speed_sigma=spread(sigma_of(cov, speed) if speed else unknown),
        nees=spread(pairs.nees[rows]),
        axes=len(spot),
        modes=None if modes is None else spread(modes[pairs.entry[rows]]),
    )


def _joined(name: str, parts: Sequence[Trace]) -> Trace:
    """Return the trace of an object from those of the blocks, which follow one another."""
    if not parts:
        none = np.zeros(0)
        return Trace(name, none, none.astype(np.intp), none, none, none, none, none, 0, None)
    columns = ("times", "track", "error", "sigma", "speed_error", "speed_sigma", "nees")
    whole = {column: np.concatenate([getattr(part, column) for part in parts]) for column in columns}
    modes = [part.modes for part in parts if part.modes is not None]
    return Trace(name, axes=parts[0].axes, modes=np.concatenate(modes) if modes else None, **whole)


def sigma_of(cov: Array, part: list[int]) -> Array:
    """Return the root of the trace over some axes: (q, n, n) -> (q,)."""
    return np.sqrt(np.sum(np.diagonal(cov, axis1=-2, axis2=-1)[:, part], axis=-1))


def _normalised(rows: Sequence[Array]) -> Normalised:
    times, track, value, axes = np.concatenate([np.zeros((4, 0)), *rows], axis=1)
    return Normalised(times, track.astype(np.intp), value, axes.astype(np.intp))


def with_innovation(entries: Entries, scans: Indices) -> Mask:
    """Return the entries at some of the scans where a return was probably the track's."""
    return np.isin(entries.scan, scans) & (entries.nis > 0) & (entries.hit > 0.5)


def mode_names(experiment: Experiment, count: int) -> tuple[str, ...]:
    """Return names for the `count` modes of the estimator: their motions, or the parts of these that not all have."""
    given = [mode.get("motion", mode) for mode in plain(experiment.tracker.estimator).get("modes", [])]
    if not given or len(given) != count:
        return tuple(f"mode {i + 1}" for i in range(count))
    parts = [Counter(_kinds(motion)) for motion in given]
    common = reduce(and_, parts)
    own = [" + ".join((each - common).elements()) or motion["kind"] for each, motion in zip(parts, given, strict=True)]
    return tuple(name if own.count(name) == 1 else f"{name} ({i + 1})" for i, name in enumerate(own))


def _kinds(given: Any) -> Iterator[str]:
    """Yield the kinds of a part and, after it, of those inside of it."""
    if isinstance(given, dict):
        yield from [given["kind"]] if "kind" in given else []
    for inner in given.values() if isinstance(given, dict) else given if isinstance(given, list | tuple) else ():
        yield from _kinds(inner)
