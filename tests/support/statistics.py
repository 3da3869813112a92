"""Tests of draws, each accepting at a false alarm rate of ALPHA."""

import numpy as np
from scipy import stats

from vedette import Array

ALPHA = 1e-7


def moments_match(samples: Array, mean: Array, cov: Array) -> bool:
    """Mean by Hotelling, covariance by the likelihood ratio, of N samples (N, n) against N(mean, cov); each at ALPHA."""
    count, n = samples.shape
    white = np.linalg.solve(np.linalg.cholesky(cov), (samples - mean).T)
    scatter = white @ white.T / count
    ratio = count * (np.trace(scatter) - np.linalg.slogdet(scatter)[1] - n)
    return bool(
        count * np.sum(white.mean(axis=1) ** 2) < stats.chi2.isf(ALPHA, n) and ratio < stats.chi2.isf(ALPHA, n * (n + 1) / 2)
    )


def dispersion_p(counts: Array, mean: float) -> float:
    """The smaller of two p-values that `counts` are Poisson(mean): their sum, and their spread about it."""
    total = stats.poisson(mean * len(counts))
    spread = np.sum((counts - mean) ** 2) / mean
    both = (total.cdf(counts.sum()), total.sf(counts.sum() - 1), stats.chi2.cdf(spread, len(counts)))
    return 2 * min(*both, stats.chi2.sf(spread, len(counts)))
