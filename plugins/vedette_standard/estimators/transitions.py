"""How the modes of an IMM switch: per scan, per stated interval, or by rates."""

from __future__ import annotations

import numpy as np
from attrs import field, frozen

from vedette import Array
from vedette.filters import keep


def transition_problem(matrix: Array) -> str | None:
    """Say why `matrix` is not a transition matrix, or return None."""
    if matrix.shape[0] != matrix.shape[1]:
        return f"must be square, got {matrix.shape[0]} x {matrix.shape[1]}"
    if np.any(matrix < 0):
        return f"probabilities must be >= 0, got {matrix.min():g}"
    for i, total in enumerate(matrix.sum(axis=1)):
        if abs(total - 1) > 1e-6:
            return f"each row must sum to 1, row {i} sums to {total:g}"
    return None


def rates_problem(matrix: Array) -> str | None:
    """Say why `matrix` does not hold switching rates per second, or return None."""
    if matrix.shape[0] != matrix.shape[1]:
        return f"must be square, got {matrix.shape[0]} x {matrix.shape[1]}"
    off = matrix - np.diag(np.diag(matrix))
    if np.any(off < 0):
        return f"rates from one mode to another must be >= 0 per s, got {off.min():g}"
    if np.any(np.abs(matrix.sum(axis=1)) > 1e-9 * (1 + np.abs(matrix).max())):
        return (
            f"each row must sum to 0: the diagonal is minus the sum of the rest, got rows that sum to {matrix.sum(axis=1)}"
        )
    return None


@frozen(eq=False)
class Transition:
    """Log transition probabilities over any time step: exp(rates * dt), or one matrix for every scan."""

    fixed: Array | None
    rates: Array | None
    _kept: dict[float, Array] = field(init=False, factory=dict)

    @classmethod
    def per_scan(cls, matrix: Array) -> Transition:
        """Use the same matrix whatever the time between scans."""
        with np.errstate(divide="ignore"):
            return cls(np.log(matrix / matrix.sum(axis=1, keepdims=True)), None)

    @classmethod
    def per_interval(cls, matrix: Array, interval: float) -> Transition:
        """Scale to dt by the matrix' generator; ValueError if it has none."""
        from scipy.linalg import logm

        singular = np.abs(np.linalg.eigvals(matrix)).min() < 1e-12
        step = np.full_like(matrix, np.nan) if singular else np.asarray(logm(matrix))
        off = np.real(step) - np.diag(np.diag(np.real(step)))
        if np.abs(np.imag(step)).max() > 1e-9 or not np.all(off >= -1e-12):  # also where it is NaN
            raise ValueError(
                "interval: this transition matrix has no generator, so it cannot be scaled to other time steps; "
                "leave `interval` out (it then holds per scan) or give `rates`"
            )
        rates = np.maximum(off, 0) / interval
        return cls(None, rates - np.diag(rates.sum(axis=1)))

    def log(self, dt: float) -> Array:
        """Return the logarithm of P(mode in the column `dt` s later | mode in the row) (r, r)."""
        if self.rates is None:
            assert self.fixed is not None
            return self.fixed
        log_transition = self._kept.get(dt)
        if log_transition is None:
            with np.errstate(divide="ignore"):
                log_transition = np.log(np.maximum(_after(self.rates, dt), 0.0))
            keep(self._kept, dt, log_transition)
        return log_transition


def _after(rates: Array, dt: float) -> Array:
    """Return exp(rates dt); of two modes in closed form, which costs microseconds where threads of a BLAS cost ms."""
    if len(rates) != 2:
        from scipy.linalg import expm

        return expm(rates * dt)
    total = float(rates[0, 1] + rates[1, 0])
    gone = -np.expm1(-total * dt) / total if total > 0 else dt
    return np.asarray(np.eye(2) + rates * gone)
