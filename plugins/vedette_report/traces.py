"""Errors and their normalised squares against time: the data of the picture of errors and the summary's verdicts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import numpy as np
from attrs import Factory, define, field, frozen

from vedette.config import plain
from vedette.experiment import Experiment, Result
from vedette.metrics import (
    NONE,
    Block,
    Entries,
    Indices,
    Match,
    Pairs,
    chi_square_band,
    match,
    nees,
    nis_ratio,
    positions,
    velocities,
)
from vedette.space import Array, Mask

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
        covered: Mask = self.track != NONE
        return covered


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
        for each in np.unique(axes).tolist():
            low, high = band(each)
            own = value[axes == each]
            self.inside += int(np.count_nonzero((low <= own) & (own <= high)))
            self.axes[each] = self.axes.get(each, 0) + len(own)
        return self

    @property
    def part(self) -> float | None:
        """The fraction inside; None if there is none."""
        return self.inside / self.count if self.count else None


@frozen(eq=False)
class Bands:
    """How many squared errors of a run lie in their bands: the NEES of covered objects' positions, the tracks' NIS."""

    nees: Inside = Factory(Inside)
    nis: Inside = Factory(Inside)

    @classmethod
    def of(cls, experiment: Experiment, result: Result) -> Bands:
        """Return those of a run that kept all."""
        errors, seen = position_nees(traces(experiment, result)), innovations(experiment, result)
        return cls(Inside().add(errors.value, errors.axes), Inside().add(seen.value, seen.axes))

    def add(self, block: Block) -> None:
        """Count a block of a run that is judged as it goes."""
        found, spot = block.found, positions(block.found.truth.space)
        pairs = found.pairs()
        values = nees_of(pairs.error[:, spot], found.entries.cov[pairs.entry][:, spot][:, :, spot])
        values = values[np.isfinite(values)]
        self.nees.add(values, np.full(len(values), len(spot)))
        chosen = with_innovation(found.entries, block.chosen)
        scan = found.entries.scan[chosen]
        self.nis.add(found.entries.nis[chosen] / found.entries.hit[chosen], block.axes[scan])


def band(axes: int) -> tuple[float, float]:
    """Return the chi-square band of one normalised squared error over `axes` axes."""
    low, high = chi_square_band(axes, BAND)
    return axes * low, axes * high


def traces(experiment: Experiment, result: Result) -> tuple[Trace, ...]:
    """Return a trace for each true object, in the order of the recording; none if the tracks' positions are unknown."""
    found = match(result.tracks, result.recording.truth, result.scans, experiment.judge)
    if not found.scans.size:
        return ()
    times = np.array([result.scans[i].time for i in found.scans])
    pairs = found.pairs()
    return tuple(_trace(found, pairs, j, path.name, times) for j, path in enumerate(result.recording.truth))


def _trace(found: Match, pairs: Pairs, j: int, name: str, times: Array) -> Trace:
    space = found.truth.space
    own = pairs.truth == j
    error, cov = pairs.error[own], found.entries.cov[pairs.entry[own]]
    spot, speed = positions(space), velocities(space)

    def spread(values: Array) -> Array:
        """Spread values of the covered scans (q, ..) among all scans (s, ..)."""
        everywhere = np.full((len(times), *np.shape(values)[1:]), np.nan)
        everywhere[pairs.scan[own]] = values
        return everywhere[alive]

    alive = found.truth.alive[:, j]
    modes, unknown = found.entries.mode_prob, np.full(len(error), np.nan)
    return Trace(
        name=name,
        times=times[alive],
        track=found.cover[alive, j],
        error=spread(np.linalg.norm(error[:, spot], axis=-1)),
        sigma=spread(sigma_of(cov, spot)),
        speed_error=spread(np.linalg.norm(error[:, speed], axis=-1) if speed else unknown),
        speed_sigma=spread(sigma_of(cov, speed) if speed else unknown),
        nees=spread(nees_of(error[:, spot], cov[:, spot][:, :, spot])),
        axes=len(spot),
        modes=None if modes is None else spread(modes[pairs.entry[own]]),
    )


def sigma_of(cov: Array, part: list[int]) -> Array:
    """Return the root of the trace over some axes: (q, n, n) -> (q,)."""
    sigma: Array = np.sqrt(np.sum(np.diagonal(cov, axis1=-2, axis2=-1)[:, part], axis=-1))
    return sigma


def nees_of(error: Array, cov: Array) -> Array:
    """Return the normalised squared errors (q,), NaN if a covariance is singular."""
    try:
        return nees(error, cov)
    except ValueError:  # a covariance is singular: then there is none
        return np.full(len(error), np.nan)


def position_nees(found: Sequence[Trace]) -> Normalised:
    """Return the NEES of all traces together."""
    kept = [trace.covered & np.isfinite(trace.nees) for trace in found]
    pairs = list(zip(found, kept, strict=True))
    none = np.zeros(0)
    return Normalised(
        np.concatenate([none, *(trace.times[mask] for trace, mask in pairs)]),
        np.concatenate([none, *(trace.track[mask] for trace, mask in pairs)]).astype(np.intp),
        np.concatenate([none, *(trace.nees[mask] for trace, mask in pairs)]),
        np.concatenate([none, *(np.full(np.count_nonzero(mask), trace.axes) for trace, mask in pairs)]).astype(np.intp),
    )


def innovations(experiment: Experiment, result: Result) -> Normalised:
    """Return the NIS of confirmed tracks where a return was probably theirs (over 1/2), given that one was."""
    found = match(result.tracks, (), result.scans, experiment.judge).entries
    measured = np.array([scan.detections.z.shape[-1] for scan in result.scans], dtype=np.intp)
    times = np.array([scan.time for scan in result.scans])
    chosen = with_innovation(found, experiment.judge.choose(result.scans))
    scan = found.scan[chosen]
    return Normalised(times[scan], found.track[chosen], found.nis[chosen] / found.hit[chosen], measured[scan])


def nis_of_expected(experiment: Experiment, result: Result) -> float | None:
    """Return the NIS over what is expected, as the summary tells it."""
    found = match(result.tracks, (), result.scans, experiment.judge).entries
    chosen = experiment.judge.choose(result.scans)
    return nis_ratio(found, result.scans, chosen, experiment.tracker.gate.probability)


def with_innovation(entries: Entries, scans: Indices) -> Mask:
    """Return the entries at some of the scans where a return was probably the track's."""
    return np.isin(entries.scan, scans) & (entries.nis > 0) & (entries.hit > 0.5)


def mode_names(experiment: Experiment, count: int) -> tuple[str, ...]:
    """Return names for the `count` modes of the estimator: their motions, numbered where these are alike."""
    given = plain(experiment.tracker.estimator).get("modes", [])
    plain_names = [mode.get("motion", mode)["kind"] for mode in given]
    if len(plain_names) != count:
        return tuple(f"mode {i + 1}" for i in range(count))
    return tuple(name if plain_names.count(name) == 1 else f"{name} ({i + 1})" for i, name in enumerate(plain_names))
