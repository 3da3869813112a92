"""Errors and their normalised squares against time: the data of the picture of errors and the summary's verdicts."""

from __future__ import annotations

from typing import final

import numpy as np
from attrs import Factory, define, field, frozen

from vedette.config.parameters import plain
from vedette.experiment import Experiment, Result
from vedette.metrics.consistency import chi_square_band, nees
from vedette.metrics.coverage import NONE, Indices
from vedette.metrics.histories import Entries, positions, velocities
from vedette.metrics.judgement import nis_ratio
from vedette.metrics.matching import Match, Pairs, match
from vedette.metrics.running import Block
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
        judged = Judged.of(experiment, result)
        errors, seen = judged.position_nees(), judged.innovations()
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


@final
@frozen(eq=False)
class Judged:
    """A run that kept all, matched with its truth once for all that is drawn and told of it."""

    experiment: Experiment
    result: Result
    found: Match

    @classmethod
    def of(cls, experiment: Experiment, result: Result) -> Judged:
        """Match the tracks of a run with its truth."""
        return cls(experiment, result, match(result.tracks, result.recording.truth, result.scans, experiment.judge))

    def traces(self, most: int | None = None) -> tuple[Trace, ...]:
        """Return a trace for each true object, or for the first of the recording; none if no scan is judged."""
        if not self.found.scans.size:
            return ()
        names = [path.name for path in self.result.recording.truth[:most]]
        times, pairs = self._times[self.found.scans], self.found.pairs()
        return tuple(_trace(self.found, pairs, j, name, times) for j, name in enumerate(names))

    def position_nees(self) -> Normalised:
        """Return the NEES of the positions of all covered objects, object after object."""
        pairs, spot = self.found.pairs(), positions(self.found.truth.space)
        order = np.argsort(pairs.truth, kind="stable")
        entry, truth = pairs.entry[order], pairs.truth[order]
        error, cov = pairs.error[order][:, spot], self.found.entries.cov[entry][:, spot][:, :, spot]
        value = nees_of(error, cov)
        if not np.isfinite(value).all():  # a singular covariance takes only the object that has it
            objects = np.split(np.arange(len(truth)), np.flatnonzero(np.diff(truth)) + 1)
            value = np.concatenate([nees_of(error[rows], cov[rows]) for rows in objects])
        kept = np.isfinite(value)
        times, track = self._times[self.found.scans[pairs.scan[order]]], self.found.entries.track[entry]
        return Normalised(times[kept], track[kept], value[kept], np.full(np.count_nonzero(kept), len(spot), dtype=np.intp))

    def innovations(self) -> Normalised:
        """Return the NIS of confirmed tracks where a return was probably theirs (over 1/2), given that one was."""
        entries, scans = self.found.entries, self.result.scans
        measured = np.array([scan.detections.z.shape[-1] for scan in scans], dtype=np.intp)
        chosen = with_innovation(entries, self.experiment.judge.choose(scans))
        scan = entries.scan[chosen]
        return Normalised(
            self._times[scan], entries.track[chosen], entries.nis[chosen] / entries.hit[chosen], measured[scan]
        )

    def nis_of_expected(self) -> float | None:
        """Return the NIS over what is expected, as the summary tells it."""
        scans = self.result.scans
        chosen = self.experiment.judge.choose(scans)
        return nis_ratio(self.found.entries, scans, chosen, self.experiment.tracker.gate.probability)

    @property
    def _times(self) -> Array:
        return np.array([scan.time for scan in self.result.scans])


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
