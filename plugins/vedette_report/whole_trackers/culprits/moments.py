"""Moments of innovations and errors, and what they say of the noises of a world: by how much each must be turned."""

from __future__ import annotations

from itertools import combinations_with_replacement

import numpy as np
from attrs import frozen

from vedette.space import Array
from vedette_report.consistency import normalised_error
from vedette_report.whole_trackers.runs import Runs

LAGS = (1, 2, 3)
"""Products of innovations of the same scan, of the next, and of those after tell Q from R."""
FIRST = 3
"""The scans in which the start shows."""
TOLERATED = 0.02
"""What a moment may be off beside chance, as a part of a variance: no filter is exact whose models are not linear."""


@frozen(eq=False)
class Fit:
    """What the moments of a world say: their means (d,), the noise (d, d) of these, how far each may be off by chance."""

    mean: Array
    noise: Array
    doubt: Array

    @classmethod
    def of(cls, played: Runs) -> Fit:
        """Return that of some runs."""
        each = _moments(played)
        noise = np.cov(each.T).reshape(each.shape[1], -1) / len(each)
        return cls(each.mean(axis=0), noise, 3.5 * np.sqrt(np.diagonal(noise)) + TOLERATED)

    def solved(self, D: Array) -> tuple[float, Array, Array]:
        """Return what is left, squared, and the turns and their standard errors (k,), of slopes D (d, k) by least squares.

        Each moment has the weight of its own noise: where a start or an R is far off, all moments of a run rise and fall
        together, and weights by their whole covariance would take what is wrong for chance.
        """
        weight = 1.0 / (np.diagonal(self.noise) + 1e-10)
        back = np.linalg.pinv((D.T * weight) @ D) @ (D.T * weight)
        turns = -back @ self.mean
        rest = self.mean + D @ turns
        return float(np.sum(weight * rest**2)), turns, np.sqrt(np.diagonal(back @ self.noise @ back.T))

    def small(self) -> bool:
        """Whether nothing is off by more than chance."""
        return bool(np.all(np.abs(self.mean) <= self.doubt))


def _moments(played: Runs) -> Array:
    """Return of each run (r, d) how far what innovations and errors show is from what is right.

    By sensor: products of axes of the same scan less the stated correlations, of the first scans and of the others, and
    products with those of later scans. Of the errors the squares along each axis: of an axis that is not measured,
    innovations tell little.
    """
    found = []
    for looks in played.looks.values():
        spread = np.sqrt(np.diagonal(looks.cov, axis1=-2, axis2=-1))
        seen = looks.seen[..., None]
        u = looks.residual / spread
        u = np.where(seen, u - np.sum(u * seen, axis=0) / np.maximum(seen.sum(axis=0), 1), 0.0)
        m, scans = u.shape[-1], u.shape[1]
        for part in (slice(0, FIRST), slice(FIRST, scans)):
            count = np.maximum(looks.seen[:, part].sum(axis=1), 1)
            for i, j in combinations_with_replacement(range(m), 2):
                stated = looks.cov[:, part, i, j] / (spread[:, part, i] * spread[:, part, j])
                products = np.where(looks.seen[:, part], u[:, part, i] * u[:, part, j] - stated, 0.0)
                found.append(products.sum(axis=1) / count)
        for lag in LAGS:
            pairs = np.sum(seen[:, :-lag] & seen[:, lag:], axis=1)
            found += list((np.sum(u[:, :-lag] * u[:, lag:], axis=1) / np.maximum(pairs, 1)).T)
    error = normalised_error(played.error, played.cov)[:, FIRST:]
    free = np.diagonal(played.cov, axis1=-2, axis2=-1).min(axis=(0, 1)) > 0
    return np.stack([*found, *np.mean(error[..., free] ** 2 - 1.0, axis=1).T], axis=-1)
