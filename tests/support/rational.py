"""Linear algebra in rational numbers: no rounding."""

from fractions import Fraction

import numpy as np


def rational(a):
    return np.vectorize(lambda value: Fraction(float(value)), otypes=[object])(a)


def solve(A, B):
    """A^-1 B and log |A| by elimination, in rational numbers."""
    A, B, log_det = A.copy(), B.copy(), 0.0
    for i in range(len(A)):
        log_det += np.log(float(A[i, i]))
        B[i], A[i] = B[i] / A[i, i], A[i] / A[i, i]
        for j in range(len(A)):
            if j != i:
                B[j], A[j] = B[j] - A[j, i] * B[i], A[j] - A[j, i] * A[i]
    return B, log_det
