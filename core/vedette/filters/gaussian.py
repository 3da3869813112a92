"""Filters whose belief is a mean and a covariance: they differ in how they predict and evaluate."""

from __future__ import annotations

from typing import Any

import numpy as np
from attrs import field, frozen

from vedette import kernels
from vedette.filters.memo import Memo
from vedette.filters.motion import OverMotion
from vedette.roles import Estimator
from vedette.space import Array, Space
from vedette.types import Gaussian, Innovation, new_gaussian
from vedette.values import maker


@frozen(eq=False)
class Hypotheses:
    """The detail of a Gaussian filter's innovation: shift (*b, t, k, n) of the mean and posterior covariance
    post (*b, t, 1|k, n, n) under each detection.
    """

    shift: Array
    post: Array


new_hypotheses = maker(Hypotheses)


@frozen
class GaussianFilter(OverMotion[Gaussian]):
    """A filter over one motion model whose belief is a mean and a covariance; `predict` and `evaluate` are left to define.

    `evaluate` must give `Hypotheses` as the innovation's detail, unless the filter has its own `update`. A mixture reads
    the belief itself, unless the filter has its own `start` or `moments`: it then calls these.
    """

    _memo: Memo = field(init=False, repr=False, eq=False, factory=Memo)

    def start(self, prior: Gaussian, axes: Space, rng: np.random.Generator) -> Gaussian:
        """Return the prior's marginal over the filter's axes."""
        return marginal(prior, axes, self.state, self.zero_variance)

    def reframe(self, belief: Gaussian, combined: Gaussian) -> Gaussian:
        """Return the belief in the motion's frame of the `combined` estimate."""
        return self.motion.reframe(belief, combined)

    def update(self, belief: Gaussian, innovation: Innovation, weights: Array) -> Gaussian:
        """Return the moments of the weighted hypotheses, the spread of their means included."""
        detail: Hypotheses = innovation.detail
        memo = self._memo
        periods, zero_variance = memo.frame or memo.framed(self.motion)
        mean, cov = kernels.weighted_update(belief.mean, belief.cov, detail.shift, detail.post, weights, periods)
        if zero_variance:
            cov = without_variance(cov, zero_variance)
        return new_gaussian(mean, cov)

    def moments(self, belief: Gaussian) -> Gaussian:
        """Return the belief itself, which is its moments."""
        return belief

    def cross_covariance(self, belief: Gaussian, dt: float) -> Array:
        """Return P F', F the derivative of the motion at the mean; for filters that predict by it."""
        return belief.cov @ np.swapaxes(self.motion.jacobian(belief.mean, dt), -1, -2)


def has_gaussian_belief(estimator: Estimator[Any]) -> bool:
    """Return whether a belief is its moments: the estimator starts it and tells of it as a `GaussianFilter` does."""
    cls = type(estimator)
    return cls.start is GaussianFilter.start and cls.moments is GaussianFilter.moments


def marginal(prior: Gaussian, axes: Space, state: Space, zero_variance: Space) -> Gaussian:
    """Return the marginal of a Gaussian over some of its axes.

    Parameters
    ----------
    prior
        Mean (*b, n) and covariance (*b, n, n) over `axes`.
    axes
        The axes of `prior`.
    state
        The axes that remain, in their order; all among `axes`.
    zero_variance
        Those of them that lose their variance.

    Returns
    -------
    Gaussian
        Over `state`; it is `prior` itself if nothing changes.
    """
    if axes is state and not zero_variance:
        return prior
    places = axes.locate(state)
    cov = prior.cov[..., places, :][..., places]
    if len(zero_variance):
        cov = without_variance(cov, state.locate(zero_variance))
    return Gaussian(prior.mean[..., places], cov)


def without_variance(cov: Array, axes: list[int]) -> Array:
    """Return covariances (*b, n, n) with zeros in the rows and columns of `axes`."""
    keep = np.ones(cov.shape[-1])
    keep[axes] = 0.0
    return cov * (keep[:, None] * keep)
