"""Moments of innovations, and what they say of the noises of a world: by how much each must be turned."""

from __future__ import annotations

from itertools import combinations_with_replacement

import numpy as np
from attrs import frozen

from vedette.space import Array
from vedette_report.whole_trackers.covariances import BEYOND_3
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
    kinds: list[str]

    @classmethod
    def of(cls, played: Runs) -> Fit:
        """Return that of some runs."""
        each, kinds = _moments(played)
        noise = np.cov(each.T).reshape(each.shape[1], -1) / len(each)
        return cls(each.mean(axis=0), noise, 3.5 * np.sqrt(np.diagonal(noise)) + TOLERATED, kinds)

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


def _moments(played: Runs) -> tuple[Array, list[str]]:
    """Return of each run (r, d) how far what innovations show is from what is right, and what each number is of.

    By sensor: products of axes of the same scan less the stated correlations, of the first scans and of the others, products
    with those of later scans; how squares grow with distance; and the share beyond 3 deviations, whatever these are.
    """
    found, kinds = [], []
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
                kinds.append("same scan")
        for lag in LAGS:
            pairs = np.sum(seen[:, :-lag] & seen[:, lag:], axis=1)
            found += list((np.sum(u[:, :-lag] * u[:, lag:], axis=1) / np.maximum(pairs, 1)).T)
            kinds += ["lag"] * m
        late, mask = u[:, FIRST:], looks.seen[:, FIRST:]
        count = np.maximum(mask.sum(axis=1), 1)
        far = np.log(np.maximum(looks.distance[:, FIRST:], 1e-9))
        far = far - far[mask].mean()
        size = np.maximum(np.sum(far**2 * mask, axis=1), 1e-3 * count)
        size = np.maximum(size, size.mean())
        for i in range(m):
            relative = late[..., i] / np.sqrt(np.mean(late[..., i][mask] ** 2))
            found.append(np.sum(np.where(mask, (relative**2 - 1.0) * far, 0.0), axis=1) / size)
            found.append(10.0 * (np.sum(mask & (np.abs(relative) > 3.0), axis=1) / count - BEYOND_3))
            kinds += ["distance", "tails"]
    return np.stack(found, axis=-1), kinds


def count(m: int) -> int:
    """Return how many moments there are of a sensor of m axes."""
    return m * (m + 1) + (len(LAGS) + 2) * m
