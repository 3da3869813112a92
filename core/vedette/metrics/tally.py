"""The figures of a run, summed up over blocks of its scans: so much of a long run as its score needs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, final

import numpy as np
from attrs import Factory, define, field

from vedette.metrics.consistency import gate_truncation, nees
from vedette.metrics.coverage import NONE, Held, Indices, covering, switches
from vedette.metrics.errors import expected_error
from vedette.metrics.gospa import gospa, ospa
from vedette.metrics.histories import Entries, positions, velocities
from vedette.metrics.matching import Match
from vedette.metrics.score import Judge, Score, TruthScore
from vedette.space import Array
from vedette.types import Trajectory

_SETS = ("gospa_m", "gospa_localisation", "gospa_missed", "gospa_false", "gospa_all_m", "ospa_m", "false_tracks")


@final
@define
class _Fate:
    """What became of one true object in the `scans` while it existed."""

    scans: int = 0
    covered: int = 0
    squares: float = 0.0
    switches: int = 0
    begin: float = np.nan
    first_covered: float | None = None
    label: int = NONE
    held_last: int = NONE
    longest_gap: int = 0

    def score(self, name: str, lost_scans: int) -> TruthScore:
        """Return its figures."""
        gone = self.held_last == NONE or max(self.longest_gap, self.scans - self.held_last) > lost_scans
        return TruthScore(
            name=name,
            scans=self.scans,
            coverage=self.covered / self.scans if self.scans else None,
            position_rmse_m=float(np.sqrt(self.squares / self.covered)) if self.covered else None,
            id_switches=self.switches,
            lost=gone if self.scans else None,
            confirmed_after_s=None if self.first_covered is None else self.first_covered - self.begin,
        )


@final
@define
class _Errors:
    """Sums over the covered objects."""

    count: int = 0
    position: float = 0.0
    expected: float = 0.0
    velocity: float | None = None
    bias: Array = field(factory=lambda: np.zeros(0))
    nees: float | None = 0.0
    nees_state: float | None = 0.0
    axes: tuple[str, ...] = ()
    modes: Array | None = None

    def add(self, found: Match, error: Array, entry: Indices) -> None:
        """Add the errors (q, n) of some entries (q,)."""
        if not len(entry):
            return
        space, cov, modes = found.truth.space, found.entries.cov[entry], found.entries.mode_prob
        spot, speed = positions(space), velocities(space)
        moved = np.sum(error[:, spot], axis=0)
        self.bias = self.bias + moved if self.count else moved
        self.count += len(entry)
        self.position += float(np.sum(np.sum(error[:, spot] ** 2, axis=-1)))
        self.expected += len(entry) * expected_error(cov[:, spot][:, :, spot]) ** 2
        if speed:
            self.velocity = (self.velocity or 0.0) + float(np.sum(np.sum(error[:, speed] ** 2, axis=-1)))
        self.nees = _sum_of_nees(self.nees, error[:, spot], cov[:, spot][:, :, spot])
        self.nees_state = _sum_of_nees(self.nees_state, error, cov)
        self.axes = space.names
        if modes is not None:
            shares = np.sum(modes[entry], axis=0)
            self.modes = shares if self.modes is None else self.modes + shares

    def figures(self) -> dict[str, Any]:
        """Return the means; none if nothing was covered."""
        n = self.count
        if not n:
            return {}
        return {
            "position_rmse_m": float(np.sqrt(self.position / n)),
            "position_deviation_m": float(np.sqrt(self.expected / n)),
            "velocity_rmse_mps": None if self.velocity is None else float(np.sqrt(self.velocity / n)),
            "bias_m": tuple((self.bias / n).tolist()),
            "nees_position": None if self.nees is None else self.nees / n / len(self.bias),
            "nees_state": None if self.nees_state is None else self.nees_state / n / len(self.axes),
            "nees_state_axes": self.axes,
            "mode_prob": None if self.modes is None else tuple((self.modes / n).tolist()),
        }


def _sum_of_nees(before: float | None, error: Array, cov: Array) -> float | None:
    """Add the NEES; None from a singular covariance on."""
    try:
        return None if before is None else before + float(np.sum(nees(error, cov)))
    except ValueError:
        return None


@final
@define
class Tally:
    """Collects the blocks of a run and gives its score; `truth` are all true objects.

    Scans before any true object is recorded, or after the last one, say nothing about the tracks and do not count. The
    figures of whole tracks need their histories, and are left out.
    """

    truth: Sequence[Trajectory]
    options: Judge
    held: Held = field(default=Factory(lambda self: Held(len(self.truth)), takes_self=True))
    chosen: int = 0
    """Scans that the options choose, whether a true object is known or not."""
    scans: int = 0
    _waiting: int = 0
    _sums: list[float] = field(factory=lambda: [0.0] * len(_SETS))
    _later: list[float] = field(factory=lambda: [0.0] * len(_SETS))
    _errors: _Errors = field(factory=_Errors)
    _nis: float = 0.0
    _expected: float = 0.0
    _fates: list[_Fate] = field(default=Factory(lambda self: [_Fate() for _ in self.truth], takes_self=True))
    _held_longer: Held = field(default=Factory(lambda self: Held(len(self.truth)), takes_self=True))

    def add_innovations(self, entries: Entries, chosen: Indices, axes: Indices, gates: Array) -> None:
        """Add the NIS of the entries at the scans `chosen`; `axes` (s,) are those that each scan measures, `gates` (s,) the
        probabilities of the gates.

        The scan that starts a track has no innovation, and the tracker reports 0 there.
        """
        self.chosen += len(chosen)
        used = (entries.nis > 0) & np.isin(entries.scan, chosen)
        m = axes[entries.scan[used]].astype(float)
        self._nis += float(np.sum(entries.nis[used]))
        self._expected += float(np.sum(entries.hit[used] * m * gate_truncation(m, gates[entries.scan[used]])))

    def add(self, found: Match, times: Array, which: Indices | None = None) -> None:
        """Add a block of scans at `times` (s,) in s, of which the match knows the true objects `which`, by default all."""
        alive = found.truth.alive
        some = np.flatnonzero(alive.any(axis=1))
        begin = 0 if self.scans else (int(some[0]) if some.size else len(alive))
        end = int(some[-1]) + 1 if some.size else begin
        per_scan = np.array(list(self._sets(found, begin))).reshape(-1, len(_SETS)).T
        known, later = per_scan[:, : end - begin], per_scan[:, end - begin :]
        if end > begin:
            self.scans += self._waiting + end - begin
            self._sums = [a + b + float(np.sum(c)) for a, b, c in zip(self._sums, self._later, known, strict=True)]
            self._waiting, self._later = 0, [0.0] * len(_SETS)
        self._waiting += later.shape[1]
        self._later = [a + float(np.sum(b)) for a, b in zip(self._later, later, strict=True)]
        pairs = found.pairs()
        self._errors.add(found, pairs.error, pairs.entry)
        squares = np.sum(pairs.error[:, positions(found.truth.space)] ** 2, axis=-1)
        longer = self._covered_longer(found, which)
        for j, own in enumerate(range(len(self.truth)) if which is None else which.tolist()):
            self._follow(self._fates[own], times[alive[:, j]], found.cover[alive[:, j], j], longer[alive[:, j], j])
            self._fates[own].squares += float(np.sum(squares[pairs.truth == j]))

    def forget(self, alive: Indices) -> None:
        """Forget what the matching knows of tracks that are not `alive`, as they do not return."""
        for held in (self.held, self._held_longer):
            held.owner = {track: held.owner[track] for track in alive.tolist() if track in held.owner}

    def score(self, tracks: int) -> Score:
        """Return the figures of a run with so many confirmed tracks."""
        nis = self._nis / self._expected if self._expected > 0 else None
        if not self.scans:
            return Score(scans=0 if self.truth else self.chosen, tracks=tracks, nis=nis)
        fates = [fate.score(each.name, self.options.lost_scans) for each, fate in zip(self.truth, self._fates, strict=True)]
        waits = [fate.confirmed_after_s for fate in fates if fate.confirmed_after_s is not None]
        sets: dict[str, Any] = {name: total / self.scans for name, total in zip(_SETS, self._sums, strict=True)}
        return Score(
            scans=self.scans,
            tracks=tracks,
            nis=nis,
            **self._errors.figures(),
            **sets,
            coverage=float(np.mean([fate.coverage for fate in fates if fate.coverage is not None])),
            id_switches=sum(fate.id_switches for fate in fates),
            lost=float(np.mean([fate.lost for fate in fates if fate.lost is not None])),
            confirmed_after_s=float(np.mean(waits)) if waits else None,
            truths=tuple(fates),
        )

    def _sets(self, found: Match, begin: int) -> Iterator[tuple[float, ...]]:
        """Compare all confirmed tracks with all true objects, scan by scan, as in _SETS."""
        options = self.options
        cutoff, order = options.gospa_cutoff, options.gospa_order
        scans = zip(found.apart, found.truth.alive, found.present, found.cover, strict=True)
        for apart, alive, present, covered in list(scans)[begin:]:
            there = apart.among(alive)
            within = there if options.far is None else there.among(tracks=apart.nearest <= options.far)
            counted, plain = gospa(within, cutoff, order), ospa(within, cutoff, order)
            every = counted.value if options.far is None else gospa(there, cutoff, order).value
            idle = ~np.isin(present, covered)
            false = np.count_nonzero(idle if options.near is None else idle & (apart.nearest <= options.near))
            yield (counted.value, counted.localisation, counted.missed, counted.false, every, plain, float(false))

    def _covered_longer(self, found: Match, which: Indices | None) -> Indices:
        """Return the covering tracks within the error of a lost track."""
        radius = self.options.lost_error
        if radius is None or radius == self.options.cover_radius:
            return found.cover
        return covering(found.apart, found.present, radius, self._held_longer, which)

    @staticmethod
    def _follow(fate: _Fate, times: Array, cover: Indices, longer: Indices) -> None:
        """Add the scans of a block at which one object existed."""
        if not len(times):
            return
        if not fate.scans:
            fate.begin = float(times[0])
        covered = cover != NONE
        labels = cover[covered] if fate.label == NONE else np.append(fate.label, cover[covered])
        fate.switches += switches(labels)
        if covered.any():
            fate.label = int(labels[-1])
            if fate.first_covered is None:
                fate.first_covered = float(times[np.argmax(covered)])
        held = fate.scans + np.flatnonzero(longer != NONE)
        if held.size:
            known = held if fate.held_last == NONE else np.append(fate.held_last, held)
            fate.longest_gap = max(fate.longest_gap, int(np.max(np.diff(known), initial=0)))
            fate.held_last = int(held[-1])
        fate.scans += len(times)
        fate.covered += int(np.count_nonzero(covered))
