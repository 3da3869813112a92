"""What the matrices of a step say of a part of it."""

from __future__ import annotations

import math
from typing import final

import numpy as np
from attrs import frozen

from vedette import Array

TERMS = 18
"""Terms of the series of exp(H r), |H r| <= 1: the next one is below 1e-17."""


@final
@frozen(eq=False)
class WithinAStep:
    """The flow dx = A x dt + dw, E[dw dw'] = C dt, that makes F and Q over a step: F(r) = exp(A r), Q(r) by Van Loan.

    H = [-A c; 0 A'], C = size c, exp(H r) = [. G; 0 F'], Q(r) = size F G. The series of exp(H r / 2^halvings) is kept; F and
    Q of so small a part are then doubled, by F F and F Q F' + Q, as exp(-A r) is too large where an axis decays fast.
    exact: whether such a C is one of noise; else C is near it, as of noise that is held through a step, or comes at its end.
    Van Loan, Computing Integrals Involving the Matrix Exponential, IEEE T-AC 23, 1978.
    """

    series: Array
    size: float
    halvings: int
    exact: bool

    def over(self, part: float) -> tuple[Array, Array]:
        """Return F and Q (n, n) over a part of the step, from 0 to 1."""
        block = np.tensordot(part ** np.arange(len(self.series)), self.series, 1)
        n = len(block) // 2
        F = block[n:, n:].T
        Q = F @ block[:n, n:]
        for _ in range(self.halvings):
            F, Q = F @ F, F @ Q @ F.T + Q
        return F, self.size * Q


def within_a_step(F: Array, Q: Array) -> WithinAStep | None:
    """Return the flow that makes F and Q (n, n) over a step; None if none makes F, which has no real logarithm."""
    from scipy.linalg import logm

    eigenvalues = np.linalg.eigvals(F)
    if np.any((np.abs(eigenvalues.imag) <= 1e-9 * np.abs(eigenvalues)) & (eigenvalues.real <= 1e-15 * np.max(np.abs(F)))):
        return None
    A = np.asarray(logm(F)).real
    C, exact = _density(A, Q)
    n, size = len(A), max(float(np.linalg.norm(C, 1)), 1e-300)
    H = np.block([[-A, C / size], [np.zeros((n, n)), A.T]])
    halvings = max(0, math.ceil(math.log2(max(float(np.linalg.norm(H, 1)), 1e-300))))
    series = [np.eye(2 * n)]
    for k in range(1, TERMS + 1):
        series.append(series[-1] @ H / 2.0**halvings / k)
    return WithinAStep(np.array(series), size, halvings, exact)


def _density(A: Array, Q: Array) -> tuple[Array, bool]:
    """Return C (n, n) of Q, the integral of exp(A s) C exp(A' s) over a step, and whether it is one of noise.

    If not, it is without the axes that gain none, if need be without correlations, and as large as makes Q on an axis.
    """
    from scipy.linalg import expm

    n, noisy = len(A), np.diagonal(Q) > 0
    sizes = np.sqrt(np.where(noisy, np.diagonal(Q), 1.0))  # in these, no unit of an axis hides another
    a, q = A * sizes / sizes[:, None], Q / np.outer(sizes, sizes)
    both = np.kron(a, np.eye(n)) + np.kron(np.eye(n), a)
    integral = expm(np.block([[both, np.eye(n * n)], [np.zeros((n * n, 2 * n * n))]]))[: n * n, n * n :]
    c = np.linalg.solve(integral, q.ravel()).reshape(n, n)
    c = (c + c.T) / 2
    if exact := _is_noise(c):
        return c * np.outer(sizes, sizes), exact
    grows = noisy & (np.diagonal(c) > 0)
    kept = np.where(np.outer(grows, grows), c, 0.0)
    kept = kept if _is_noise(kept) else np.diag(np.diagonal(kept))
    made = np.diagonal((integral @ kept.ravel()).reshape(n, n))
    return kept / np.min(made[grows], initial=np.inf) * np.outer(sizes, sizes), exact


def _is_noise(c: Array) -> bool:
    """Return whether a matrix (n, n) is positive semi-definite, but for rounding."""
    values = np.linalg.eigvalsh(c)
    return bool(values[0] >= -1e-9 * max(values[-1], 1e-300))
