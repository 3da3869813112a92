"""Paths of measured places beside each other, filtered with white errors or correlated ones."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from attrs import frozen

from vedette.space import Array, Mask

TINY = 1e-300
"""The sum of squares of paths that are exactly straight."""

DIFFUSE = 1e3
"""The deviation of a velocity before the second return, in errors a step: two returns tell nothing of the errors."""


@frozen(eq=False)
class Path:
    """One measured axis of one target: values (s,) at times (s,) in s."""

    times: Array
    values: Array

    def part(self, rows: slice) -> Path:
        """Return a part of it."""
        return Path(self.times[rows], self.values[rows])


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
class Fit:
    """Logarithms of tau over a step and of the acceleration (m/s^1.5) over the error's deviation, a step being 1; the white
    part over the correlated one, inf of white errors; the deviation of the correlated part, or of white errors; how many
    steps targets keep their velocity.
    """

    tau: float
    accel: float
    part: float
    scale: float
    memory: float = np.inf

    @property
    def parameters(self) -> tuple[Array, Array, Array, float]:
        """What `Pieces` filters by, of one fit."""
        return np.array([self.tau]), np.array([self.accel]), np.array([self.part]), self.memory


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

    def sums(self, tau: Array, accel: Array, part: Array, memory: float = np.inf) -> tuple[Array, Array]:
        """Return sum v^2 / S and sum ln S of the innovations v of all pieces, for parameters (p,) and one memory."""
        squares, logs = np.zeros(len(tau)), np.zeros(len(tau))
        for i, (v, S) in self._innovations(tau, accel, part, memory):
            squares += np.sum(np.where(self.used[:, i], v**2 / S, 0.0), axis=-1)
            logs += np.sum(np.where(self.used[:, i], np.log(S), 0.0), axis=-1)
        return squares, logs

    def loglik(self, tau: Array, accel: Array, part: Array, memory: float = np.inf) -> Array:
        """Return the log-likelihood (p,) at the size that makes it largest."""
        squares, logs = self.sums(tau, accel, part, memory)
        return -0.5 * (self.count * (np.log(2 * np.pi * np.maximum(squares, TINY) / self.count) + 1.0) + logs)

    def singles(self, fit: Fit) -> Array:
        """Return the log-likelihood of each return (w, s) by those before it; 0 of the first two."""
        residuals = np.zeros(self.values.shape)
        for i, (v, S) in self._innovations(*fit.parameters):
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
            accel=fit.scale * float(np.exp(fit.accel)) * (1 + 1 / fit.memory) / self.dt**1.5,
            deviation_error=float(np.sqrt(cov[2, 2])), tau_error=0.0 if white else float(np.sqrt(cov[0, 0])),
            loglik=float(self.loglik(*fit.parameters)[0]),
        )  # fmt: skip

    def _covariance(self, fit: Fit) -> Array:
        """Return the covariance (3, 3) of ln tau, ln accel and ln scale."""
        h = np.array([0.1, 0.4])
        grid = np.array([(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)])
        A, B = self.sums(fit.tau + h[0] * grid[:, 0], fit.accel + h[1] * grid[:, 1], np.full(9, fit.part), fit.memory)
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

    def _innovations(
        self, tau: Array, accel: Array, part: Array, memory: float
    ) -> Iterator[tuple[int, tuple[Array, Array]]]:
        """Yield the innovations (p, w) of the third return of each piece and those after it, and their variances."""
        white = np.isinf(part)[:, None]
        c, r = np.where(white, 0.0, 1.0), np.where(white, 1.0, part[:, None] ** 2)
        q, rate = np.exp(2 * accel)[:, None] * (1 + 1 / memory) ** 2, np.exp(-tau)[:, None]
        x, v, e = (np.zeros((len(tau), len(self.steps))) for _ in range(3))
        xx, xe, ee, xv, ve = c + r + x, -c + x, c + x, 0.0 * x, 0.0 * x
        vv = DIFFUSE**2 * (c + r) + x
        for i in range(1, self.steps.shape[1]):
            dt, (keep, by, qxx, qxv, qvv) = self.steps[:, i], _kept(self.steps[:, i], memory)
            a = np.exp(-dt * rate)
            xx, xe = xx + by * (2 * xv + by * vv) + q * qxx, a * (xe + by * ve)
            xv, ve = keep * (xv + by * vv) + q * qxv, a * keep * ve
            vv, ee = keep * keep * vv + q * qvv, a * a * ee + c * (1 - a * a)
            x, v, e = x + by * v, keep * v, a * e
            S = xx + 2 * xe + ee + r
            apart = self.values[:, i] - x - e
            if i > 1:
                yield i, (apart, S)
            hx, hv, he = xx + xe, xv + ve, xe + ee
            kx, kv, ke = hx / S, hv / S, he / S
            x, v, e = x + kx * apart, v + kv * apart, e + ke * apart
            xx, xv, xe = xx - kx * hx, xv - kx * hv, xe - kx * he
            vv, ve, ee = vv - kv * hv, ve - kv * he, ee - ke * he


def _kept(dt: Array, memory: float) -> tuple[Array, Array, Array, Array, Array]:
    """Return what is left of a velocity after steps (w,), how far one goes, and the noise of place and velocity by q."""
    if np.isinf(memory):
        return np.ones(len(dt)), dt, dt**3 / 3, dt**2 / 2, dt
    keep = np.exp(-dt / memory)
    by, twice = memory * (1 - keep), memory / 2 * (1 - keep * keep)
    return keep, by, memory**2 * np.maximum(dt - 2 * by + twice, 0.0), by * by / 2, twice
