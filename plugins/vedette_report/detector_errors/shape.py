"""Whether a detector's errors grow with the range or the size, and have heavy tails, found without truth."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from attrs import frozen
from scipy.special import gammaln

from vedette.space import Array, Mask

AROUND = 4
"""A return is compared with what so many around it say: their cubic, which leaves out what moves smoothly."""

FEWEST = 200
"""Fewer returns tell too little."""

LONG = 3.0
"""Returns farther apart than so many usual steps are not compared."""

STEADY = 2.0
"""If residuals from every second return are so much larger in the square, it is motion that they show."""

CLEARLY = 3.0
"""Log-likelihood by which growth or tails must gain on returns held back, two errors too: by hand."""

LEAST_GROWTH, MOST_GROWTH = 0.2, 3.0
"""Powers of the range below which errors count as constant, and beyond which none are looked for."""

DEGREES = (2.5, 3.0, 4.0, 5.0, 7.0, 10.0, 15.0, 25.0)
"""Degrees of freedom of Student's t that are tried."""

FAR, MEDIAN = 3.0, 0.6745
"""A return is far off beyond so many deviations, one of 370 of a Gaussian; half of one lies within `MEDIAN` deviations."""


@frozen(eq=False)
class Measured:
    """One measured axis of one target: values (s,) at times (s,) in s, and how far or how large it was (s,), NaN unknown."""

    times: Array
    values: Array
    extent: Array


@frozen
class Shape:
    """Errors as extent^growth, with its error and the gain in log-likelihood on returns held back; that of heavy tails, the
    degrees of freedom of Student's t, and the part of errors beyond three deviations; how many returns were compared.
    """

    growth: float
    growth_error: float
    growth_gain: float
    growth_gain_error: float
    tails_gain: float
    tails_gain_error: float
    degrees: float
    far: float
    returns: int

    @property
    def grows(self) -> bool:
        """Whether errors change with the extent, beyond chance."""
        told = self.growth_gain > max(2.0 * self.growth_gain_error, CLEARLY)
        return told and abs(self.growth) > max(LEAST_GROWTH, 2.0 * self.growth_error)

    @property
    def tailed(self) -> bool:
        """Whether errors are more often far off than Gaussian ones, beyond chance."""
        return self.tails_gain > max(2.0 * self.tails_gain_error, CLEARLY)

    def told(self, sensor: str, axis: str, extent: str) -> tuple[str, ...]:
        """Say what stands out: how errors grow, how heavy their tails are."""
        said = []
        if self.grows:
            said.append(
                f"errors of {sensor} along {axis} change as {extent}^({self.growth:.2g} +- {self.growth_error:.1g}) "
                f"(by {self.growth_gain:+.1f} +- {self.growth_gain_error:.1f} on {self.returns} returns held back): one "
                "deviation for all is too large for some and too small for others"
            )
        if self.tailed:
            by = f"by {self.tails_gain:+.1f} +- {self.tails_gain_error:.1f}"
            said.append(
                f"errors of {sensor} along {axis} have heavy tails: one of {1 / self.far:.0f} is beyond 3 deviations, of "
                f"Gaussian ones of 370 ({by}): a wide gate with `pda` or `jpda` loses fewer returns, a larger deviation too"
            )
        return tuple(said)

    def data(self) -> dict[str, object]:
        """Return the figures as plain data."""
        return {
            "grows": self.grows, "growth": self.growth, "growth_error": self.growth_error, "growth_gain": self.growth_gain,
            "tailed": self.tailed, "tails_gain": self.tails_gain, "degrees": self.degrees, "far": self.far,
        }  # fmt: skip


def shape_of(paths: Sequence[Measured]) -> Shape | None:
    """Return what returns say of the shape of errors along an axis; None if they are too few, or motion hides errors.

    A return less the cubic through the two before and the two after it, over the deviation that this has if errors are white
    and alike, is u. Growth: ln u^2 is linear in ln extent; tails: u is Student's t. Both are fitted to halves of paths and
    judged on the others, against a Gaussian of one size. Each error is in five residuals: what one says of the
    next ones counts in the errors of gains (Bartlett's weights).
    """
    narrow = [each for path in paths if len((each := residuals(path, 1))[0])]
    wide = np.concatenate([residuals(path, 2)[0] for path in paths] or [np.zeros(0)])
    u = np.concatenate([each for each, _ in narrow] or [np.zeros(0)])
    if len(u) < FEWEST or not len(wide) or np.median(np.abs(u)) <= 0:
        return None
    if np.median(np.abs(wide)) ** 2 > STEADY * np.median(np.abs(u)) ** 2:
        return None
    later = np.concatenate([np.arange(len(each)) >= len(each) // 2 for each, _ in narrow])
    lags = [len(each) for each, _ in narrow]
    size = np.concatenate([extent for _, extent in narrow])
    some: Mask = np.asarray(np.isfinite(size) & (size > 0))
    growth, error, gain, off = 0.0, np.inf, 0.0, 0.0
    if np.all(some) and np.ptp(np.log(size)) > 0:
        x = np.log(size / np.median(size))
        growth, error, gain, off = _growth(u, x, later, lags)
        u = u * np.exp(-growth * x) if gain > max(2.0 * off, CLEARLY) else u
    degrees, tails, tails_off = _tails(u, later, lags)
    spread = np.median(np.abs(u)) / MEDIAN
    far = max(float(np.mean(np.abs(u) > FAR * spread)), 1.0 / len(u))
    return Shape(growth, error, gain, off, tails, tails_off, degrees, far, len(u))


def residuals(path: Measured, stride: int) -> tuple[Array, Array]:
    """Return the residuals of returns from those around, every `stride`-th, and the extents of these returns."""
    i = np.arange(2 * stride, len(path.times) - 2 * stride)
    around = i[:, None] + stride * np.array([-2, -1, 1, 2])
    t = path.times[around] - path.times[i][:, None]
    apart = t[:, :, None] - t[:, None, :] + np.eye(AROUND)
    if len(i):
        usual = stride * float(np.median(np.diff(path.times)))
        good = (np.diff(path.times[i[:, None] + stride * np.arange(-2, 3)], axis=-1).max(axis=-1) <= LONG * usual) & np.all(
            np.abs(apart) > 0, axis=(1, 2)
        )
        i, around, t, apart = i[good], around[good], t[good], apart[good]
    ratio = np.where(np.eye(AROUND, dtype=bool), 1.0, -t[:, None, :] / np.where(np.eye(AROUND, dtype=bool), 1.0, apart))
    weights = np.prod(ratio, axis=-1)  # Lagrange's: the value at 0 of the cubic through all four
    off = path.values[i] - np.sum(weights * path.values[around], axis=-1)
    return off / np.sqrt(1.0 + np.sum(weights**2, axis=-1)), path.extent[i]


def _growth(u: Array, x: Array, later: Mask, lengths: Sequence[int]) -> tuple[float, float, float, float]:
    """Return the power of growth and its error, by all; the gain on those held back and its error, by the others."""

    def fitted(rows: Mask) -> tuple[float, float]:
        tried = np.linspace(-MOST_GROWTH, MOST_GROWTH, 241)
        scale = [float(np.mean((u[rows] * np.exp(-g * x[rows])) ** 2)) for g in tried]
        likely = [-0.5 * np.log(s) - g * float(np.mean(x[rows])) for g, s in zip(tried, scale, strict=True)]
        best = int(np.argmax(likely))
        return float(tried[best]), scale[best]

    gains = np.zeros(len(u))
    for half in (later, ~later):
        (g, s), one = fitted(~half), float(np.mean(u[~half] ** 2))
        better = -0.5 * (u**2 * np.exp(-2 * g * x) / s + np.log(s)) - g * x + 0.5 * (u**2 / one + np.log(one))
        gains[half] = better[half]
    power, size = fitted(np.ones(len(u), dtype=bool))
    around = x - np.mean(x)
    slopes = (u**2 * np.exp(-2 * power * x) / size - 1.0) * around
    error = _of_parts(slopes, lengths) / (2.0 * float(np.sum(around**2)))
    return power, error, float(np.sum(gains)), _of_parts(gains, lengths)


def _tails(u: Array, later: Mask, lengths: Sequence[int]) -> tuple[float, float, float]:
    """Return the degrees of freedom of errors, the gain of their tails on those held back, and its error."""

    def fitted(part: Array) -> tuple[float, float]:
        spread = float(np.median(np.abs(part))) / MEDIAN
        tried = [(nu, scale) for nu in DEGREES for scale in (spread * np.geomspace(0.5, 1.5, 41)).tolist()]
        return max(tried, key=lambda pair: float(np.sum(_student(part, *pair))))

    gains = np.zeros(len(u))
    for half in (later, ~later):
        one = float(np.mean(u[~half] ** 2))
        gains[half] = (_student(u, *fitted(u[~half])) + 0.5 * (u**2 / one + np.log(2 * np.pi * one)))[half]
    return fitted(u)[0], float(np.sum(gains)), _of_parts(gains, lengths)


def _student(u: Array, nu: float, scale: float) -> Array:
    """Return the log density of Student's t."""
    top = gammaln((nu + 1) / 2) - gammaln(nu / 2) - 0.5 * np.log(np.pi * nu * scale**2)
    return np.asarray(top - (nu + 1) / 2 * np.log1p((u / scale) ** 2 / nu))


def long_run(row: Array) -> float:
    """Return the variance of the sum of a series, with what each tells of the next ones, by Bartlett's weights."""
    off, lags = row - np.mean(row), round(len(row) ** (1.0 / 3.0))
    total = float(off @ off)
    for lag in range(1, lags + 1):
        total += 2.0 * (1.0 - lag / (1.0 + lags)) * float(off[lag:] @ off[: len(off) - lag])
    return max(total, 0.0)


def _of_parts(series: Array, lengths: Sequence[int]) -> float:
    """Return the deviation of the sum of series one after another."""
    return float(np.sqrt(sum(map(long_run, np.split(series, np.cumsum(lengths)[:-1])))))
