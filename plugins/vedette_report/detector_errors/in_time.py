"""Whether a detector's errors go on from return to return, found without truth: white errors against correlated ones."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from attrs import frozen

from vedette.space import Array, Mask
from vedette.units import say
from vedette_report.detector_errors.pieces import TINY, Errors, Fit, Path, Pieces
from vedette_report.detector_errors.shape import long_run

__all__ = ["Compared", "Errors", "Path", "compared"]

LONGEST, MOST = 400, 64
"""Paths are cut into pieces of at most so many returns, of which so many are enough."""

FEWEST = 20
"""A piece of fewer returns tells too little of how its errors go on."""

GAP = 1000.0
"""Where nothing was seen for so many steps a path is cut: errors are forgotten, and variances would be rounded below 0."""

OWN = 0.1
"""The white part of a correlated error, over the correlated one, if no larger part is clearly likelier."""

PARTS = (OWN, 0.5, 1.0, 2.0)
"""Those that are tried, each likelier by `CLEARLY` than the ones before it: by hand."""

MEMORIES = (0.1, 1.0, 3.0, 10.0)
"""For so many steps targets with white errors may keep their velocity, if not for good; the first is Brownian. By hand."""

CLEARLY = 3.0
"""Log-likelihood by which more parameters, or another kind of error, must gain; held back by two errors, too: by hand."""

LEAST = 0.1
"""Errors that are less alike than this from one return to the next count as white: by hand."""

FAINT = 1e-9
"""Errors of which a path is so many times as long are rounding."""

PASSES, POINTS = 6, 7
"""So often a grid of so many points a side is drawn closer around its best."""


@frozen
class Compared:
    """White and correlated errors, each fitted to all returns, and by how much correlated ones are likelier on those of the
    second halves of paths, each predicted, with the parameters of the first halves; `dt`: the usual step, in s; `denied`:
    whether first halves, with the parameters of the second, speak against it, as of targets that turn from some time on.
    """

    white: Errors
    correlated: Errors
    gain: float
    error: float
    returns: int
    dt: float
    denied: bool

    @property
    def alike(self) -> float:
        """How alike correlated errors are from one return to the next."""
        share = (self.correlated.correlated / self.correlated.deviation) ** 2
        return share * float(np.exp(-self.dt / self.correlated.tau))

    @property
    def wins(self) -> bool:
        """Whether errors are correlated, beyond chance."""
        return self.gain > max(2.0 * self.error, CLEARLY) and self.alike >= LEAST and not self.denied

    def told(self, sensor: str, axis: str, unit: str) -> str:
        """Say what the comparison says."""
        by = f"by {self.gain:+.1f} +- {self.error:.1f} on {self.returns} returns held back"
        if not self.wins:
            return (
                f"errors of {sensor} along {axis} are white as far as these returns tell (correlated ones are likelier {by})"
            )
        fit = self.correlated
        size = f"{say(float(f'{fit.deviation:.3g}'), unit)} +- {100 * fit.deviation_error:.0f} %"
        lasts = f"{say(float(f'{fit.tau:.3g}'), 's')} +- {100 * fit.tau_error:.0f} %"
        return (
            f"errors of {sensor} along {axis} are correlated in time: deviation {size}, correlation time {lasts} ({by}); "
            f"white ones of {say(float(f'{self.white.deviation:.3g}'), unit)} would take the rest for motion"
        )


def compared(paths: Sequence[Path]) -> Compared | None:
    """Return what tells white errors from correlated ones along an axis; None if there are too few returns.

    The targets move at nearly constant velocity, x'' = w; z = x + v, v white, or v = u + e with e' = -e / tau + w. What
    wanders is no error: with white ones a velocity may be forgotten, x'' = -x' / T + w, in the extreme a random walk. Each
    path is filtered from its second return on, whose velocity is unknown, for a grid of tau, of the acceleration over the
    errors, and of the part of u; the size of all follows in closed form.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, sections 8.1 and 8.2.
    """
    pieces = [piece for path in paths for piece in _pieces(path)]
    pieces = pieces[:: max(1, -(-len(pieces) // MOST))]
    if not pieces:
        return None
    every = Pieces.of(pieces)
    ends = [len(one.times) // 2 for one in pieces]
    later = np.arange(every.used.shape[1]) >= np.array(ends)[:, None]
    by_first = _gained(every, [one.part(slice(end)) for one, end in zip(pieces, ends, strict=True)], later)
    by_second = _gained(every, [one.part(slice(end, None)) for one, end in zip(pieces, ends, strict=True)], ~later)
    if by_first is None or by_second is None:
        return None  # no errors at all: positions that somebody has computed
    gain, error = by_first
    denied = by_second[0] + 2.0 * by_second[1] < CLEARLY
    white, other = (every.errors(_fitted(every, correlated)) for correlated in (False, True))
    return Compared(white, other, gain, error, int(np.count_nonzero(every.used & later)), every.dt, denied)


def _gained(every: Pieces, parts: Sequence[Path], held: Mask) -> tuple[float, float] | None:
    """Return by how much likelier correlated errors are on what is `held` back (p, s), with the parameters of the parts, and
    the error of that; None where these have no errors.
    """
    if (extent := np.ptp(every.values)) == 0:
        return None
    fits = [_fitted(Pieces.of(parts), correlated) for correlated in (False, True)]
    if min(fit.scale for fit in fits) <= FAINT * extent:
        return None
    scores = [every.singles(fit) for fit in fits]
    apart = [row[mask] for row, mask in zip(scores[1] - scores[0], every.used & held, strict=True)]
    return float(sum(map(np.sum, apart))), float(np.sqrt(sum(long_run(row) for row in apart)))


def _pieces(path: Path) -> list[Path]:
    steps = np.diff(path.times)
    gaps = np.flatnonzero(steps > GAP * np.median(steps)) + 1 if len(steps) else ()
    seen = [part for part in np.split(np.arange(len(path.times)), gaps) if len(part) >= FEWEST]
    parts = [part for each in seen for part in np.array_split(each, -(-len(each) // LONGEST))]
    return [Path(path.times[part], path.values[part]) for part in parts if len(part) >= FEWEST]


def _fitted(pieces: Pieces, correlated: bool) -> Fit:
    """Return the likeliest errors of one kind; each after the first is clearly likelier than the best before it."""
    fits, heights = _climbed(pieces, np.array(PARTS if correlated else (np.inf,)), np.inf)
    for memory in () if correlated else MEMORIES:
        fit, height = _climbed(pieces, np.array([np.inf]), memory)
        fits, heights = fits + fit, np.append(heights, height)
    best = 0
    for i in range(1, len(fits)):
        if heights[i] > heights[best] + CLEARLY:
            best = i
    return fits[best]


def _climbed(pieces: Pieces, parts: Array, memory: float) -> tuple[list[Fit], Array]:
    """Return the likeliest errors (p,) with each white part, and their log-likelihoods (p,)."""
    low, high = np.array([-1.2, -12.0]), np.array([4.0, 4.0])
    if np.isinf(parts[0]):
        low[0] = high[0] = 0.0
    centre, reach = np.tile(0.5 * (low + high), (len(parts), 1)), 0.5 * (high - low)
    for _ in range(PASSES):
        sides = [np.unique(reach[i] * np.linspace(-1, 1, POINTS)) for i in (0, 1)]
        grid = np.stack([side.ravel() for side in np.meshgrid(*sides)], axis=-1)
        points = np.clip(centre[:, None] + grid, low, high)
        of_part = np.repeat(parts, len(grid))
        heights = pieces.loglik(points[..., 0].ravel(), points[..., 1].ravel(), of_part, memory).reshape(len(parts), -1)
        top = np.argmax(heights, axis=1)
        centre, reach = points[np.arange(len(parts)), top], reach * 2.2 / (POINTS - 1)
    squares, _ = pieces.sums(centre[:, 0], centre[:, 1], parts, memory)
    scales = np.sqrt(np.maximum(squares, TINY) / pieces.count)
    found = zip(centre.tolist(), parts.tolist(), scales.tolist(), strict=True)
    return [Fit(tau, accel, part, scale, memory) for (tau, accel), part, scale in found], np.max(heights, axis=1)
