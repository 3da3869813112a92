"""What rows of tracks learnt of numbers that they share: as information, which adds, and as a return, which updates."""

from __future__ import annotations

import numpy as np
from attrs import frozen

from vedette import kernels
from vedette.space import Array, Indices
from vedette.types import Gaussian

UNKNOWN = 1e-7
"""Information, in that of the offsets so far, where other tracks say nothing: a return must have a covariance."""


@frozen(eq=False)
class Information:
    """What was learnt of q numbers whose prior is N(0, I): a likelihood exp(-b' matrix b / 2 + vector' b), (*b, q, q)."""

    matrix: Array
    vector: Array

    @property
    def posterior(self) -> Gaussian:
        """The numbers after it."""
        cov = np.linalg.inv(np.eye(self.matrix.shape[-1]) + self.matrix)
        return Gaussian((cov @ self.vector[..., None])[..., 0], kernels.symmetric(cov))

    @property
    def as_return(self) -> Gaussian:
        """A return z = b + v that says the same, and next to nothing where this says nothing."""
        value, axes = np.linalg.eigh(self.matrix)
        cov = (axes / np.maximum(value, UNKNOWN)[..., None, :]) @ np.swapaxes(axes, -1, -2)
        return Gaussian((cov @ self.vector[..., None])[..., 0], kernels.symmetric(cov))


def within(L: Array, origin: Array, offsets: Gaussian) -> Gaussian:
    """Return offsets of rows (*b, t, q) in the numbers y = L^-1 (b - origin)."""
    inverse = np.linalg.inv(L)[..., None, :, :]
    mean = (inverse @ (offsets.mean - origin[..., None, :])[..., None])[..., 0]
    return Gaussian(mean, inverse @ offsets.cov @ np.swapaxes(inverse, -1, -2))


def gained(after: Gaussian, before: Gaussian) -> Information:
    """Return what made one belief of another, in no direction less than nothing: doubt about returns tells nothing."""
    new, old = np.linalg.inv(after.cov), np.linalg.inv(before.cov)
    value, axes = np.linalg.eigh(new - old)
    vector = (new @ after.mean[..., None] - old @ before.mean[..., None])[..., 0]
    value = np.where(value > UNKNOWN, value, 0.0)
    along = (np.swapaxes(axes, -1, -2) @ vector[..., None])[..., 0] * (value > 0)
    return Information((axes * value[..., None, :]) @ np.swapaxes(axes, -1, -2), (axes @ along[..., None])[..., 0])


def of_tracks(learnt: Information, shares: Array, track: Indices | None) -> Information:
    """Return what tracks learnt, from rows that are theirs with probabilities `shares`, by the moments of the mixture."""
    row = learnt.posterior
    nothing = np.eye(row.cov.shape[-1])
    p = shares[..., None, None]
    mean, cov = p[..., 0] * row.mean, p * (row.cov + row.mean[..., :, None] * row.mean[..., None, :])
    if track is not None:
        which = np.unique(track, return_inverse=True)[1]
        summed = [np.zeros((int(which.max()) + 1, *part.shape[1:])) for part in (mean, cov, p)]
        for to, part in zip(summed, (mean, cov, p), strict=True):
            np.add.at(to, which, part)
        mean, cov, p = summed
    cov = cov + (1.0 - p) * nothing - mean[..., :, None] * mean[..., None, :]
    return gained(Gaussian(mean, cov), Gaussian(np.zeros_like(mean), np.broadcast_to(nothing, cov.shape)))
