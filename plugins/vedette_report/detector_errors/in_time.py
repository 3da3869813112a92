"""Whether a detector's errors go on from return to return, found without truth: white errors against correlated ones."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from attrs import frozen

from vedette.space import Array, Mask
from vedette.units import say
from vedette_report.detector_errors.shape import long_run

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

CLEARLY = 3.0
"""Log-likelihood by which more parameters, or another kind of error, must gain; held back by two errors, too: by hand."""

LEAST = 0.1
"""Errors that are less alike than this from one return to the next count as white: by hand."""

TINY = 1e-300
"""The sum of squares of paths that are exactly straight."""

FAINT = 1e-9
"""Errors of which a path is so many times as long are rounding."""

DIFFUSE = 1e3
"""The deviation of a velocity before the second return, in errors a step: two returns tell nothing of the errors."""

PASSES, POINTS = 6, 7
"""So often a grid of so many points a side is drawn closer around its best."""


@frozen(eq=False)
class Path:
    """One measured axis of one target: values (s,) at times (s,) in s."""

    times: Array
    values: Array


@frozen
class Errors:
    """Errors along an axis: their deviation in its unit, of which `white` is not correlated; `tau` in s, 0 of white ones;
    the targets' white acceleration. With standard errors of the logarithms of deviation and tau, and the log-likelihood.
    """

    deviation: float
    white: float
    tau: float
    accel: float
    deviation_error: float
    tau_error: float
    loglik: float

    @property
    def correlated(self) -> float:
        """The deviation of the correlated part."""
        return float(np.sqrt(max(self.deviation**2 - self.white**2, 0.0)))


@frozen
class Compared:
    """White and correlated errors, each fitted to all returns, and by how much correlated ones are likelier on those of the
    second halves of paths, each predicted, with the parameters of the first halves; `dt`: the usual step, in s.
    """

    white: Errors
    correlated: Errors
    gain: float
    error: float
    returns: int
    dt: float

    @property
    def alike(self) -> float:
        """How alike correlated errors are from one return to the next."""
        share = (self.correlated.correlated / self.correlated.deviation) ** 2
        return share * float(np.exp(-self.dt / self.correlated.tau))

    @property
    def wins(self) -> bool:
        """Whether errors are correlated, beyond chance."""
        return self.gain > max(2.0 * self.error, CLEARLY) and self.alike >= LEAST

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

    The targets move at nearly constant velocity, x'' = w; z = x + v, v white, or v = u + e with e' = -e / tau + w. Each path
    is filtered from its second return on, whose velocity is unknown, for a grid of tau, of the acceleration over the errors,
    and of the part of u; the size of all follows in closed form.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, sections 8.1 and 8.2.
    """
    pieces = [piece for path in paths for piece in _pieces(path)]
    pieces = pieces[:: max(1, -(-len(pieces) // MOST))]
    if not pieces:
        return None
    every = Pieces.of(pieces)
    first = Pieces.of([Path(one.times[: len(one.times) // 2], one.values[: len(one.times) // 2]) for one in pieces])
    fits = [_fitted(first, correlated) for correlated in (False, True)]
    if min(fit.scale for fit in fits) <= FAINT * np.ptp(every.values):
        return None  # no errors at all: positions that somebody has computed
    scores = [every.singles(fit) for fit in fits]
    halves = np.array([[len(one.times) // 2] for one in pieces])
    held: Mask = np.logical_and(every.used, np.arange(every.used.shape[1]) >= halves)
    apart = [np.where(mask, row, 0.0)[mask] for row, mask in zip(scores[1] - scores[0], held, strict=True)]
    error = float(np.sqrt(sum(long_run(row) for row in apart)))
    white, other = (every.errors(_fitted(every, correlated)) for correlated in (False, True))
    return Compared(white, other, float(sum(map(np.sum, apart))), error, int(np.count_nonzero(held)), every.dt)


def _pieces(path: Path) -> list[Path]:
    steps = np.diff(path.times)
    gaps = np.flatnonzero(steps > GAP * np.median(steps)) + 1 if len(steps) else ()
    seen = [part for part in np.split(np.arange(len(path.times)), gaps) if len(part) >= FEWEST]
    parts = [part for each in seen for part in np.array_split(each, -(-len(each) // LONGEST))]
    return [Path(path.times[part], path.values[part]) for part in parts if len(part) >= FEWEST]


@frozen
class Fit:
    """Logarithms of tau over a step and of the acceleration (m/s^1.5) over the error's deviation, a step being 1; the white
    part over the correlated one, inf of white errors; the deviation of the correlated part, or of white errors.
    """

    tau: float
    accel: float
    part: float
    scale: float


@frozen(eq=False)
class Pieces:
    """Pieces of paths side by side (w, s): the steps before each return over the usual one `dt`, values, which are used."""

    steps: Array
    values: Array
    used: Mask
    dt: float

    @classmethod
    def of(cls, paths: Sequence[Path]) -> Pieces:
        """Lay paths side by side."""
        longest = max(len(path.times) for path in paths)
        dt = float(np.median(np.concatenate([np.diff(path.times) for path in paths])))

        def padded(values: Array) -> Array:
            return values[np.minimum(np.arange(longest), len(values) - 1)]

        steps = np.array([np.diff(padded(path.times), prepend=path.times[0]) for path in paths]) / dt
        used = np.array([np.arange(longest) < len(path.times) for path in paths])
        values = np.array([padded(path.values - path.values[0]) for path in paths])
        return cls(steps, values, used, dt)

    @property
    def count(self) -> int:
        """How many returns count: all but two of each piece."""
        return int(np.count_nonzero(self.used[:, 2:]))

    def sums(self, tau: Array, accel: Array, part: Array) -> tuple[Array, Array]:
        """Return sum v^2 / S and sum ln S of the innovations v of all pieces, for parameters (p,)."""
        squares, logs = np.zeros(len(tau)), np.zeros(len(tau))
        for i, (v, S) in self._innovations(tau, accel, part):
            squares += np.sum(np.where(self.used[:, i], v**2 / S, 0.0), axis=-1)
            logs += np.sum(np.where(self.used[:, i], np.log(S), 0.0), axis=-1)
        return squares, logs

    def loglik(self, tau: Array, accel: Array, part: Array) -> Array:
        """Return the log-likelihood (p,) at the size that makes it largest."""
        squares, logs = self.sums(tau, accel, part)
        loglik: Array = -0.5 * (self.count * (np.log(2 * np.pi * np.maximum(squares, TINY) / self.count) + 1.0) + logs)
        return loglik

    def singles(self, fit: Fit) -> Array:
        """Return the log-likelihood of each return (w, s) by those before it; 0 of the first two."""
        residuals = np.zeros(self.values.shape)
        one = (np.array([value]) for value in (fit.tau, fit.accel, fit.part))
        for i, (v, S) in self._innovations(*one):
            residuals[:, i] = -0.5 * (v[0] ** 2 / S[0] / fit.scale**2 + np.log(2 * np.pi * S[0] * fit.scale**2))
        return residuals

    def errors(self, fit: Fit) -> Errors:
        """Return a fit in the axis' units, with standard errors by the curvature of the log-likelihood."""
        white = np.isinf(fit.part)
        deviation = fit.scale if white else fit.scale * float(np.hypot(1.0, fit.part))
        cov = self._covariance(fit)
        return Errors(
            deviation=deviation, white=deviation if white else fit.part * fit.scale,
            tau=0.0 if white else self.dt * float(np.exp(fit.tau)),
            accel=fit.scale * float(np.exp(fit.accel)) / self.dt**1.5,
            deviation_error=float(np.sqrt(cov[2, 2])), tau_error=0.0 if white else float(np.sqrt(cov[0, 0])),
            loglik=float(self.loglik(*(np.array([value]) for value in (fit.tau, fit.accel, fit.part)))[0]),
        )  # fmt: skip

    def _covariance(self, fit: Fit) -> Array:
        """Return the covariance (3, 3) of ln tau, ln accel and ln scale."""
        h = np.array([0.1, 0.4])
        grid = np.array([(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)])
        A, B = self.sums(fit.tau + h[0] * grid[:, 0], fit.accel + h[1] * grid[:, 1], np.full(9, fit.part))
        A = (A / fit.scale**2).reshape(3, 3)
        height = -0.5 * (A + B.reshape(3, 3))
        H = np.zeros((3, 3))
        H[0, 0] = -(height[2, 1] - 2 * height[1, 1] + height[0, 1]) / h[0] ** 2
        H[1, 1] = -(height[1, 2] - 2 * height[1, 1] + height[1, 0]) / h[1] ** 2
        H[0, 1] = H[1, 0] = -(height[2, 2] - height[2, 0] - height[0, 2] + height[0, 0]) / (4 * h[0] * h[1])
        H[0, 2] = H[2, 0] = -(A[2, 1] - A[0, 1]) / (2 * h[0])
        H[1, 2] = H[2, 1] = -(A[1, 2] - A[1, 0]) / (2 * h[1])
        H[2, 2] = 2.0 * self.count
        known = [i for i in range(3) if H[i, i] > 1e-3 and not (i == 0 and np.isinf(fit.part))]
        cov = np.zeros((3, 3))
        curvature, along = np.linalg.eigh(H[np.ix_(known, known)])
        told = curvature > 1e-3  # at the edge of what is searched the likelihood may rise still: that way it tells nothing
        cov[np.ix_(known, known)] = along[:, told] / curvature[told] @ along[:, told].T
        return cov

    def _innovations(self, tau: Array, accel: Array, part: Array) -> Iterator[tuple[int, tuple[Array, Array]]]:
        """Yield the innovations (p, w) of the third return of each piece and those after it, and their variances."""
        white = np.isinf(part)[:, None]
        c, r = np.where(white, 0.0, 1.0), np.where(white, 1.0, part[:, None] ** 2)
        q, rate = np.exp(2 * accel)[:, None], np.exp(-tau)[:, None]
        x, v, e = (np.zeros((len(tau), len(self.steps))) for _ in range(3))
        xx, xe, ee, xv, ve = c + r + x, -c + x, c + x, 0.0 * x, 0.0 * x
        vv = DIFFUSE**2 * (c + r) + x
        for i in range(1, self.steps.shape[1]):
            dt = self.steps[:, i]
            a = np.exp(-dt * rate)
            xx, xv, xe = xx + dt * (2 * xv + dt * vv) + q * dt**3 / 3, xv + dt * vv + q * dt**2 / 2, a * (xe + dt * ve)
            vv, ve, ee = vv + q * dt, a * ve, a * a * ee + c * (1 - a * a)
            x, e = x + dt * v, a * e
            S = xx + 2 * xe + ee + r
            apart = self.values[:, i] - x - e
            if i > 1:
                yield i, (apart, S)
            hx, hv, he = xx + xe, xv + ve, xe + ee
            kx, kv, ke = hx / S, hv / S, he / S
            x, v, e = x + kx * apart, v + kv * apart, e + ke * apart
            xx, xv, xe = xx - kx * hx, xv - kx * hv, xe - kx * he
            vv, ve, ee = vv - kv * hv, ve - kv * he, ee - ke * he


def _fitted(pieces: Pieces, correlated: bool) -> Fit:
    """Return the likeliest errors of one kind."""
    fits, heights = _climbed(pieces, np.array(PARTS if correlated else (np.inf,)))
    best = 0
    for i in range(1, len(fits)):
        if heights[i] > heights[best] + CLEARLY:
            best = i
    return fits[best]


def _climbed(pieces: Pieces, parts: Array) -> tuple[list[Fit], Array]:
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
        heights = pieces.loglik(points[..., 0].ravel(), points[..., 1].ravel(), of_part).reshape(len(parts), -1)
        top = np.argmax(heights, axis=1)
        centre, reach = points[np.arange(len(parts)), top], reach * 2.2 / (POINTS - 1)
    squares, _ = pieces.sums(centre[:, 0], centre[:, 1], parts)
    scales = np.sqrt(np.maximum(squares, TINY) / pieces.count)
    found = zip(centre.tolist(), parts.tolist(), scales.tolist(), strict=True)
    return [Fit(tau, accel, part, scale) for (tau, accel), part, scale in found], np.max(heights, axis=1)
