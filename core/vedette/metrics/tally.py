"""The figures of a run, summed up over blocks of its scans: so much of a long run as its score needs."""

from __future__ import annotations

from typing import Any, final

import numpy as np
from attrs import define, field

from vedette.metrics.consistency import gate_truncation, within_gate
from vedette.metrics.coverage import NONE
from vedette.metrics.gospa import gospa, ospa
from vedette.metrics.histories import Entries, positions, velocities
from vedette.metrics.matching import Match, MatchedPairs, nees_or_nan
from vedette.metrics.score import Judge, TruthScore
from vedette.space import Array, Indices

KEPT = 2**18
"""Numbers of a sum that are kept until its end: so it is the same, to the last bit, however the run came in blocks."""

SETS = ("gospa_m", "gospa_localisation", "gospa_missed", "gospa_false", "gospa_all_m", "ospa_m", "false_tracks")


@final
@define
class Total:
    """Sums (c,) of numbers (c, q) that come in parts; to the last bit those of all at once, up to KEPT of them."""

    count: int = 0
    _sum: Any = 0.0
    _parts: list[Array] = field(factory=list)
    _waiting: int = 0

    def add(self, values: Array) -> None:
        """Add numbers (c, q)."""
        self._parts.append(values)
        self.count += values.shape[-1]
        self._waiting += values.shape[-1]
        if self._waiting > KEPT:
            self._sum, self._parts, self._waiting = self.value, [], 0

    def join(self, later: Total) -> None:
        """Add what another has taken, after one's own."""
        self._sum = self._sum + later._sum
        self.count += later.count - later._waiting
        for part in later._parts:
            self.add(part)

    @property
    def value(self) -> Any:
        """The sums (c,), 0 of nothing."""
        if not self._parts:
            return self._sum
        # numpy sums by halves along memory: only a contiguous whole gives the bits of one sum over all
        return self._sum + np.sum(np.ascontiguousarray(np.concatenate(self._parts, axis=-1)), axis=-1)

    @property
    def mean(self) -> Any:
        """The means (c,)."""
        return self.value / self.count


@final
@define
class Fate:
    """What became of one true object in the `scans` while it existed."""

    scans: int = 0
    covered: int = 0
    squares: Total = field(factory=Total)
    switches: int = 0
    begin: float = np.nan
    first_covered: float | None = None
    label: int = NONE
    held_last: int = NONE
    longest_gap: int = 0

    def follow(self, time: float, cover: int, longer: int) -> None:
        """Add a scan at which the object existed; `longer` is `cover` within the error of a lost track."""
        if not self.scans:
            self.begin = time
        if cover != NONE:
            self.switches += self.label not in (NONE, cover)
            self.label = cover
            self.covered += 1
            if self.first_covered is None:
                self.first_covered = time
        if longer != NONE:
            if self.held_last != NONE:
                self.longest_gap = max(self.longest_gap, self.scans - self.held_last)
            self.held_last = self.scans
        self.scans += 1

    def score(self, name: str, lost_scans: int) -> TruthScore:
        """Return its figures."""
        gone = self.held_last == NONE or max(self.longest_gap, self.scans - self.held_last) > lost_scans
        return TruthScore(
            name=name,
            scans=self.scans,
            coverage=self.covered / self.scans if self.scans else None,
            position_rmse_m=float(np.sqrt(self.squares.mean[0])) if self.covered else None,
            id_switches=self.switches,
            lost=gone if self.scans else None,
            confirmed_after_s=None if self.first_covered is None else self.first_covered - self.begin,
        )


def of_all(fates: list[TruthScore]) -> dict[str, Any]:
    """Return the figures of all objects from those of each."""

    def mean(name: str) -> float | None:
        values = [value for fate in fates if (value := getattr(fate, name)) is not None]
        return float(np.mean(values)) if values else None

    means = {name: mean(name) for name in ("coverage", "lost", "confirmed_after_s")}
    return {**means, "id_switches": sum(fate.id_switches for fate in fates), "truths": tuple(fates)}


@final
@define
class Errors:
    """Sums over the covered objects: of squares of position and velocity, traces, NEES, and each position axis."""

    squares: Total = field(factory=Total)
    bias: Total = field(factory=Total)
    modes: Array | None = None
    moving: bool = False
    axes: tuple[str, ...] = ()

    def add(self, match: Match, pairs: MatchedPairs) -> None:
        """Add the errors of covered objects."""
        entry, error, space = pairs.entry, pairs.error, match.truth.space
        if not len(entry):
            return
        cov, modes = match.entries.cov[entry], match.entries.mode_prob
        spot, speed = positions(space), velocities(space)
        traces = np.trace(cov[:, spot][:, :, spot], axis1=-2, axis2=-1)
        fast = np.sum(error[:, speed] ** 2, axis=-1)
        self.squares.add(np.stack([pairs.square, traces, fast, pairs.nees, nees_or_nan(error, cov)]))
        self.bias.add(np.stack([error[:, axis] for axis in spot]))
        self.moving, self.axes = bool(speed), space.names
        if modes is not None:
            before = np.zeros((1, modes.shape[-1])) if self.modes is None else self.modes[None]
            self.modes = np.sum(np.concatenate([before, modes[entry]]), axis=0)

    def figures(self) -> dict[str, Any]:
        """Return the means; none if nothing was covered."""
        if not self.squares.count:
            return {}
        square, trace, fast, near, state = self.squares.mean.tolist()
        bias, count = self.bias.mean.tolist(), self.squares.count
        return {
            "position_rmse_m": float(np.sqrt(square)),
            "position_deviation_m": float(np.sqrt(trace)),
            "velocity_rmse_mps": float(np.sqrt(fast)) if self.moving else None,
            "bias_m": tuple(bias),
            "nees_position": None if np.isnan(near) else near / len(bias),
            "nees_state": None if np.isnan(state) else state / len(self.axes),
            "nees_state_axes": self.axes,
            "mode_prob": None if self.modes is None else tuple((self.modes / count).tolist()),
        }


@final
@define
class Nis:
    """Sums of the NIS and of its expectation, over the entries of scans that are chosen."""

    sums: Total = field(factory=Total)

    def add(self, entries: Entries, chosen: Indices, axes: Array, gates: Array) -> None:
        """Add a block's entries; `axes` (s,) are those that a scan's returns have, `gates` (s,) the gates' probabilities.

        The scan that starts a track has no innovation, and the tracker reports 0 there.
        """
        m, gate = axes[entries.scan], gates[entries.scan]
        used = (entries.nis > 0) & np.isin(entries.scan, chosen) & within_gate(entries.nis, entries.hit, m, gate)
        expected = (entries.hit * m * gate_truncation(m, gate))[used]
        self.sums.add(np.stack([entries.nis[used], expected]))

    def ratio(self) -> float | None:
        """Return the NIS over its expectation; None if nothing was expected."""
        if not self.sums.count:
            return None
        total, expected = self.sums.value.tolist()
        return total / expected if expected > 0 else None


def sets(match: Match, options: Judge, begin: int) -> Array:
    """Compare all confirmed tracks with all true objects, from a block's scan `begin` on: (7, s), as in SETS."""
    cutoff, order, rows = options.gospa_cutoff, options.gospa_order, list[tuple[float, ...]]()
    scans = zip(match.apart[begin:], match.truth.alive[begin:], match.present[begin:], match.cover[begin:], strict=True)
    for apart, alive, present, covered in scans:
        there = apart.among(alive)
        within = there if options.far is None else there.among(tracks=apart.nearest <= options.far)
        counted, plain = gospa(within, cutoff, order), ospa(within, cutoff, order)
        every = counted.value if options.far is None else gospa(there, cutoff, order).value
        idle = ~np.isin(present, covered)
        false = np.count_nonzero(idle if options.near is None else idle & (apart.nearest <= options.near))
        rows.append((counted.value, counted.localisation, counted.missed, counted.false, every, plain, float(false)))
    return np.ascontiguousarray(np.array(rows).reshape(-1, len(SETS)).T)
