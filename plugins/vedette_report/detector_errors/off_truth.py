"""Whether a sensor's returns lie beside the truth, all alike, or where targets were earlier: a bias, or late times."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

import numpy as np
from attrs import frozen

from vedette.space import Array, Indices, Space
from vedette.units import say

SURE, MATTERS, LESSER = 6.0, 0.3, 0.1
"""A shift is told where it is so many of its deviations, and moves returns by such a part of theirs, and of what the largest
one does: what is not quite constant looks a little like the others. By hand; .3 adds some tenth to an ANEES.
"""
FEWEST, GROUPS = 20, 10
"""Fewer returns tell nothing, nor fewer groups of them that are independent: by hand."""


@frozen(eq=False)
class Beside:
    """By how much a sensor's returns lie beside the truth along each measured axis (m,), and are late in s; with deviations.

    What is not sure, or does not matter, is NaN. `either`: a bias or a lag explains it, and returns do not tell which.
    """

    sensor: str
    space: Space
    bias: Array
    bias_error: Array
    lag: float
    lag_error: float
    either: bool = False

    @property
    def parts(self) -> tuple[str, ...]:
        """What is wrong, in words: where returns lie along axes, and when they are from."""
        told = []
        for axis, off, error in zip(self.space.axes, self.bias.tolist(), self.bias_error.tolist(), strict=True):
            if np.isfinite(off):
                size = f"{'+' if off > 0 else ''}{say(float(f'{off:.3g}'), axis.unit)}"
                told.append(f"{size} +- {say(float(f'{error:.1g}'), axis.unit)} off along {axis.name}")
        along = [" and ".join(told)] if told else []
        if np.isfinite(self.lag):
            when = "earlier" if self.lag > 0 else "later"
            along.append(f"where targets were {abs(self.lag):.2g} +- {self.lag_error:.1g} s {when}")
        return tuple(along)

    def data(self) -> dict[str, object]:
        """Return the figures as plain data, None of what is not sure or does not matter."""
        pairs = [*zip(self.space.names, self.bias, self.bias_error, strict=True), ("", self.lag, self.lag_error)]
        *off, lag = ((name, None if np.isnan(x) else [float(x), float(error)]) for name, x, error in pairs)
        return {"sensor": self.sensor, "off": dict(off), "late_s": lag[1], "either": self.either}

    def __str__(self) -> str:
        """Say what it looks like, and what to do."""
        return f"{self.sensor}: by the truth its returns lie {self.said}: {self.asked}"

    @property
    def said(self) -> str:
        """The same, joined."""
        return f", {'or' if self.either else 'and'} ".join(self.parts)

    @property
    def cures(self) -> tuple[str, ...]:
        """What to state of a sensor of kind 'displaced' for each part."""
        named = zip(self.space.names, self.bias.tolist(), strict=True)
        add = ", ".join(f"{name} = {off:.3g}" for name, off in named if np.isfinite(off))
        return ((f"add = {{ {add} }}",) if add else ()) + ((f"lag = {self.lag:.3g}",) if np.isfinite(self.lag) else ())

    @property
    def asked(self) -> str:
        """What may have made it."""
        placed, clocks = "are sensor and truth placed and turned right?", "do clocks agree, or are times those of arrival?"
        asked = [placed] * bool(np.isfinite(self.bias).any()) + [clocks] * bool(np.isfinite(self.lag))
        if self.either:
            asked.append("Targets on other courses would tell which:")
        joined = ", or " if self.either else ", and "
        return f'{" ".join(asked)} To state it, set kind = "displaced", {joined.join(self.cures)}, of = {{ ... }}'


@frozen(eq=False)
class Returns:
    """Returns less what the sensor measures of the true target (k, m), how fast that changes per s, the noise (k, m, m), and
    the group (k,) of each: those of one group may be wrong alike.
    """

    apart: Array
    rates: Array
    noise: Array
    group: Indices

    @classmethod
    def of(cls, parts: Sequence[Self]) -> Self:
        """Join some, of which each has groups of its own."""
        count = np.cumsum([0, *(int(np.max(one.group, initial=-1)) + 1 for one in parts)])
        groups = [one.group + before for one, before in zip(parts, count.tolist(), strict=False)]
        apart, rates, noise = (np.concatenate([getattr(one, name) for one in parts]) for name in ("apart", "rates", "noise"))
        return cls(apart, rates, noise, np.concatenate(groups))


def beside(sensor: str, space: Space, seen: Returns) -> Beside | None:
    """Return by how much all returns of a sensor lie beside the truth or are late; None if neither is sure and matters.

    e = b - l h' + v, with the rate h' of what is measured: least squares in units of the noise, whose deviations come from
    leaving out one group at a time, as errors may go on from return to return. If both together show which it is, that is
    told alone; if they do not, as on one course, each is tried alone, and told.
    Efron, The Jackknife, the Bootstrap and Other Resampling Plans, 1982, chapter 3.
    """
    of = np.unique(seen.group, return_inverse=True)[1]
    m, groups = len(space), int(np.max(of, initial=-1)) + 1
    if len(seen.apart) < FEWEST or groups < GROUPS:
        return None
    root = np.linalg.inv(np.linalg.cholesky(seen.noise))
    X = root @ np.concatenate([np.broadcast_to(np.eye(m), root.shape), -seen.rates[..., None]], axis=-1)
    squares, sums = np.zeros((groups, m + 1, m + 1)), np.zeros((groups, m + 1))
    np.add.at(squares, of, np.swapaxes(X, -1, -2) @ X)
    np.add.at(sums, of, np.einsum("kmi,km->ki", X, (root @ seen.apart[..., None])[..., 0]))
    moves = np.sqrt(np.median(np.sum(X**2, axis=-2), axis=0))  # by how many deviations one unit moves a return
    bias, lag, found = (_fitted(squares, sums, moves, some) for some in (range(m), [m], range(m + 1)))
    known = np.isfinite(found[0])
    if not known.all() and known.any():
        found = lag if not known[:m].any() else bias if not known[m] else found
    either = not known.any() and bool(np.isfinite(lag[0, m]) and np.isfinite(bias[0]).any())
    values, deviations = found if known.any() else np.where(np.isfinite(bias), bias, lag)
    if not np.isfinite(values).any():
        return None
    return Beside(sensor, space, values[:m], deviations[:m], float(values[m]), float(deviations[m]), either)


def _fitted(squares: Array, sums: Array, moves: Array, some: Sequence[int]) -> Array:
    """Return values and deviations (2, p) of some parameters that stand out, by the sums of groups; NaN of all others."""
    told: Array = np.full((2, len(moves)), np.nan)
    at, groups = list(some), len(sums)
    A, b = squares[:, at][:, :, at], sums[:, at]
    S, s = A.sum(axis=0), b.sum(axis=0)
    spread = np.sqrt(np.diagonal(S))
    if not np.all(spread > 0) or np.linalg.cond(S / spread[:, None] / spread) > 1e9:
        return told
    values = np.linalg.solve(S, s)
    deviations = np.sqrt((groups - 1) * np.var(np.linalg.solve(S - A, (s - b)[..., None])[..., 0], axis=0))
    moved = np.where(np.abs(values) > SURE * deviations, np.abs(values) * moves[at], 0.0)
    sure = moved > max(MATTERS, LESSER * np.max(moved))
    told[:, at] = np.where(sure, [values, deviations], np.nan)
    return told
