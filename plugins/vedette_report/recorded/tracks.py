"""The same figures on a recording: reported, not judged, as no recording is drawn from a filter's models.

Without truth, innovations alone speak: how large they are, whether one tells of the next, and how often there is one.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import partial

import numpy as np
from attrs import evolve, field, frozen

from vedette import Array, Experiment, InputError, Mask, Progress, Result, Space, Track, Trajectory
from vedette.config import warnings_of
from vedette.metrics import chi_square_band, free_axes, nees
from vedette.progress import silent
from vedette_report.detector_errors.in_tracks import Told, first_of, in_tracks, scans_at
from vedette_report.figures import figures_html
from vedette_report.noises import at_fault
from vedette_report.recorded import detected
from vedette_report.recorded.by_truth import by_truth
from vedette_report.recorded.credibility import Credibility, noncredibility
from vedette_report.recorded.off_path import OffPath, off_path
from vedette_report.recorded.pairing import Followed, followed
from vedette_report.recorded.pooled import pooled_nis
from vedette_report.recorded.used import Entry, Innovations, entries_of, gathered

FEW = 5
"""Of twice so many scans the first is told from later ones: by hand."""

ALIKE = 0.1
"""Innovations that are less alike tell by their size: by hand."""

LARGE = 1.1
"""Before detections tell of P_D, innovations so large tell of Q and R: by hand."""


@frozen(eq=False)
class Recorded:
    """What one track states about itself, and how that compares with the truth that it followed, if that is known.

    `anees` and `nis` are scaled so that 1 is expected; `whiteness` is the correlation of innovations at lag 1 by the
    sensors' own noise, None if no two successive scans have a return; `hits` is how often it was detected over what its
    sensors declare; `credibility` in dB, from the scans of this one run. `nees` (s,) at `times` (s,), 1
    expected, is the mean of `axes` squares. `target` is the object that it followed, with its
    other tracks. `lasting`: its sensors whose errors go on from return to return. `off`: its returns, from the truth.
    """

    truth: str | None
    track: int
    scans: int
    anees: float | None
    nis: float | None
    whiteness: float | None
    hits: float | None
    credibility: Credibility | None
    times: Array = field(repr=False)
    nees: Array | None = field(repr=False)
    axes: int
    innovations: Innovations = field(repr=False)
    target: Followed | None = field(default=None, repr=False)
    lasting: tuple[str, ...] = ()
    off: tuple[OffPath, ...] = field(default=(), repr=False)

    @property
    def lost(self) -> float | None:
        """When it lost its object, in s; None if it did not."""
        return None if self.target is None else self.target.lost_by(self.track)

    def _lost_at(self) -> str:
        """Return it in words, "" if it did not."""
        return "" if self.target is None or self.lost is None else self.target.terms.when(self.lost)

    @property
    def text(self) -> str:
        """One line of figures, and one on what innovations say of Q and R if they say anything."""
        white = "unknown" if self.whiteness is None else f"{self.whiteness:.2f}"
        parts = [f"track {self.track}, {self.scans} scans"]
        parts += [] if self.anees is None else [f"ANEES {self.anees:.2f}"]
        size = "unknown" if self.nis is None else f"{self.nis:.2f}"
        parts += [f"NIS {size} (1 is right)"]
        parts += [f"innovations correlate by {white}"]
        parts += [] if self.hits is None else [f"detected {self.hits:.2f} times as often as declared"]
        if self.credibility is not None:
            parts += [f"noncredibility {self.credibility.index:.1f} dB (inclination {self.credibility.inclination:+.1f} dB)"]
        parts += [f"lost it at {lost}"] if (lost := self._lost_at()) else []
        line = ", ".join(parts)
        line = line if self.truth is None else f"{self.truth}: {line}"
        return line + (f"\n  {self.hint}" if self.hint else "")

    @property
    def measured(self) -> int:
        """How many axes most scans measure."""
        return round(float(np.median(self.innovations.axes)))

    @property
    def hint(self) -> str:
        """What the innovations' size and correlation say of Q and R; "" if they are about right, or too few."""
        seen = self.innovations
        dof = float(np.sum(seen.hit * seen.axes))
        told = self.whiteness is not None and self.nis is not None
        fault = at_fault(self.nis or 1.0, self.whiteness or 0.0, dof, float(seen.pairs[0])) if told else ""
        fault = (fault and self.goes_on) or self._by_truth(bool(fault)) or fault
        if fault and (self.nis or 1.0) > LARGE:
            return fault  # its gate may be what shuts returns out
        return self._seldom_or_often() or fault or self._too_sure_at_first()

    @property
    def goes_on(self) -> str:
        """Why innovations tell nothing of Q and R: errors that go on do as an R that is too large; "" if they do not."""
        told = f"errors of {' and '.join(self.lasting)} are correlated in time, as is said below"
        return f"{told}: the size and correlation of innovations tell nothing of Q and R" if self.lasting else ""

    def _by_truth(self, fault: bool) -> str:
        """Return which of Q and R is wrong by its returns less the truth; "" if they do not tell."""
        sensors = {one.sensor for one in self.off}
        if self.lost is not None or self.lasting or not sensors or set(self.innovations.sensors) != sensors:
            return ""
        white = self.whiteness or 0.0
        return by_truth(self.off, self.nees, white if abs(white) > ALIKE else (self.nis or 1.0) - 1.0, fault)

    def _too_sure_at_first(self) -> str:
        """Return that only its first error is larger than is stated; "" if it is not, or later ones are, too."""
        if self.nees is None or len(self.nees) < 2 * FEW:
            return ""
        high = chi_square_band(self.axes, 1e-4)[1]
        if self.nees[0] <= high or np.median(self.nees[len(self.nees) // 2 :]) > high / 2:
            return ""
        told = f"its first squared error is {self.nees[0]:.2g} times as large as stated, later ones are not"
        return f"{told}: likely the start is wrong, or stated too exactly"

    @property
    def detections(self) -> Mapping[str, float]:
        """How often it was detected over what is declared, by sensor, where that is beyond chance."""
        return detected.otherwise([self.innovations])

    def _seldom_or_often(self) -> str:
        off, hit = self.detections, self.innovations.hit
        if off and not np.any(hit):
            return "it never takes a return: likely it starts elsewhere than stated, or P_D, Q or R are far too small"
        several, gated = len(set(self.innovations.sensors)) > 1, self.innovations.gated
        return "; ".join(f"{name}: " * several + detected.words(times, gated) for name, times in off.items())

    def as_all(self, every: Mapping[str, float], mixed: Collection[str]) -> bool:
        """Return whether it hints at nothing but sensors of which more is said over all tracks."""
        of = self.detections.items()
        alike = (name in mixed or (name in every and (times > 1) == (every[name] > 1)) for name, times in of)
        return bool(np.any(self.innovations.hit)) and self.hint == self._seldom_or_often() and all(alike)

    @property
    def row(self) -> tuple[str, ...]:
        """Its figures for a table."""
        index = None if self.credibility is None else self.credibility.index
        inclination = None if self.credibility is None else self.credibility.inclination
        figures = (self.anees, self.nis, self.whiteness, self.hits)
        decibels = ("-" if value is None else f"{value:{sign}.1f}" for value, sign in ((index, ""), (inclination, "+")))
        told = ("-" if value is None else f"{value:.2f}" for value in figures)
        return (self.truth or "-", f"{self.track}", f"{self.scans:,}", *told, *decibels, self._lost_at() or "-")

    def _repr_html_(self) -> str:
        return figures_html("Consistency of a track", {name: value or None for name, value in self.data().items()})

    def data(self) -> dict[str, object]:
        """Return the figures as plain data."""
        figures: dict[str, object] = {
            name: getattr(self, name) for name in ("truth", "track", "scans", "anees", "nis", "whiteness", "hits")
        }
        index = None if self.credibility is None else self.credibility.index
        inclination = None if self.credibility is None else self.credibility.inclination
        each = detected.of_each([self.innovations])
        figures["hits_by_sensor"] = {name: detected.ratio(looks) for name, looks in each.items()}
        more = {"noncredibility_db": index, "inclination_db": inclination, "lost_at_s": self.lost, "hint": self.hint}
        return figures | more


def recorded_consistency(experiment: Experiment, progress: Progress = silent) -> tuple[Recorded, ...]:
    """Run an experiment and report the tracks that covered each object, in turn; without truth, all ever confirmed.

    Of an object that no track covered, as the judge pairs them, the track that is nearest on average. InputError if no
    track can be compared: too few scans, or cameras alone, which give no returns.
    """
    result = experiment.run(progress=progress, keep_states=True)
    return recorded(experiment, result, in_tracks(experiment.tracker, result.scans, result.states))


def recorded(experiment: Experiment, result: Result, errors: Sequence[Told]) -> tuple[Recorded, ...]:
    """Report the tracks of a run that has kept its states, as `recorded_consistency` does; errors: as `in_tracks` tells."""
    tracker, entries = experiment.tracker, entries_of(experiment.tracker, result)
    p_gate = tracker.gate.probability
    seen_of = partial(gathered, {name: one.measurement.names for name, one in tracker.sensors.items()}, p_gate)
    known = {track.id: track for track in result.tracks if track.id in entries}
    records: list[Recorded | None] = []
    scans = first_of(result.scans)
    times = scans_at(scans)
    for path, own in zip(result.recording.truth, followed(experiment, result), strict=True):
        covered = False
        for track, at in zip(own.tracks, own.scans, strict=True):
            if track.id in known and np.any(at & _shared(track, path)):
                covered = True
                one = of_track(p_gate, track, seen_of(_at(entries[track.id], track, at)), path, at, own)
                off = () if one is None else off_path(tracker, scans, times, track, path, set(one.times.tolist()))
                records.append(one and evolve(one, off=off))
        if not covered:
            near = [(float(np.mean(_distance(one, path))), i) for i, one in known.items() if _shared(one, path).any()]
            if near:
                _, best = min(near)
                records.append(of_track(p_gate, known[best], seen_of(entries[best]), path))
    if not result.recording.truth:
        records = [of_track(p_gate, track, seen_of(entries[track.id])) for track in known.values()]
    lasting = dict.fromkeys(one.sensor for one in errors if one.compared.wins)
    told = tuple(
        evolve(one, lasting=tuple(name for name in lasting if name in one.innovations.sensors))
        for one in records
        if one is not None
    )
    if not told and 0 < result.intake.frames == result.intake.scans:
        raise InputError(
            "source: gives frames of a camera alone, and no returns to judge by; `vedette run` tells NIS and NEES"
        )
    if not told:
        clocks = (
            "do the times of the truth agree with theirs" if known and result.recording.truth else "is any ever confirmed"
        )
        odd = next(warnings_of(result.intake, result.recording, tracker.sensors), f"{clocks}?")
        raise InputError(f"source: gives no track with enough scans of returns to judge by; {odd}")
    return told


def _at(entries: Sequence[Entry], track: Track, at: Mask) -> list[Entry]:
    """Return what a track used at those of its scans (s,)."""
    times = set(track.times[at].tolist())
    return [entry for entry in entries if entry[1] in times] if not at.all() else list(entries)


def _shared(track: Track, path: Trajectory) -> Mask:
    """Return the track's scans that lie within the object's life (s,)."""
    return (track.times >= path.times[0]) & (track.times <= path.times[-1])


def _common(track: Track, path: Trajectory) -> Space:
    return Space(tuple(axis for axis in track.space.axes if axis in path.space.axes))


def _errors(track: Track, path: Trajectory) -> tuple[Array, Array]:
    """Return errors (s, n) and covariances (s, n, n) over the common axes, at the shared scans."""
    common, keep = _common(track, path), _shared(track, path)
    ours, theirs = track.space.locate(common), path.space.locate(common)
    states = [state[theirs] for time in track.times[keep] if (state := path.at(float(time))) is not None]
    error = common.difference(np.array(states), track.mean[keep][:, ours])
    return error, track.cov[keep][:, ours][:, :, ours]


def _distance(track: Track, path: Trajectory) -> Array:
    """Return the distance over the common axes in m (s,)."""
    error, _ = _errors(track, path)
    metres = [i for i, axis in enumerate(_common(track, path).axes) if axis.unit == "m"]
    return np.linalg.norm(error[:, metres], axis=-1)


def of_track(
    p_gate: float,
    track: Track,
    seen: Innovations,
    path: Trajectory | None = None,
    at: Mask | None = None,
    target: Followed | None = None,
) -> Recorded | None:
    """Return the figures of a track, at its scans `at` (s,), by default all; None if they are too few."""
    nis = float(pooled_nis(seen.nis, seen.hit, seen.axes, p_gate)) if np.any(seen.hit > 0) else None
    white = float(seen.correlation[0]) if len(seen.correlation) and seen.pairs[0] else None
    hits = float(np.sum(seen.hit) / np.sum(seen.declared)) if np.sum(seen.declared) > 0 else None
    told = Recorded(None, track.id, len(track.times), None, nis, white, hits, None, track.times, None, 0, seen)
    if path is None:
        return told if np.count_nonzero(seen.hit > 0) >= 3 else None
    shared = _shared(track, path)
    keep = np.ones(np.count_nonzero(shared), dtype=bool) if at is None else at[shared]
    error, cov = (values[keep] for values in _errors(track, path))
    if len(error) <= error.shape[-1]:
        return None
    values = nees(error, cov) / free_axes(cov)
    return evolve(
        told,
        truth=path.name,
        scans=len(error),
        anees=float(np.mean(values)),
        credibility=noncredibility(error, cov),
        times=track.times[shared][keep],
        nees=values,
        axes=round(float(np.median(free_axes(cov)))),
        target=target,
    )
