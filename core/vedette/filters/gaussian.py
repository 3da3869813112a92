"""Filters whose belief is a mean and a covariance: they differ in how they predict and evaluate."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from attrs import field, frozen

from vedette import kernels
from vedette.fields import ABSURD
from vedette.filters.memo import Memo, as_slice
from vedette.filters.mixing import merged
from vedette.filters.motion import OverMotion
from vedette.roles import Estimator
from vedette.space import Array, Space
from vedette.types import Gaussian, Hypotheses, Innovation, Mixtures, new_gaussian


@frozen
class GaussianFilter(OverMotion[Gaussian]):
    """A filter over one motion model whose belief is a mean and a covariance; `predict` and `evaluate` are left to define.

    `evaluate` must give `Hypotheses` as the innovation's detail, unless the filter has its own `update`. A mixture reads
    the belief itself, unless the filter has its own `start` or `moments`: it then calls these. A filter that predicts by
    F P F' + Q along a linear motion says so by `linearises`: there it is smoothed by one kernel.
    """

    linearises: ClassVar[bool] = False
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
        after = kernels.weighted_update(belief.mean, belief.cov, detail.shift, detail.post, weights, periods)
        return new_gaussian(after.mean, without_variance(after.cov, zero_variance)) if zero_variance else after

    def moments(self, belief: Gaussian) -> Gaussian:
        """Return the belief itself, which is its moments."""
        return belief

    def smooth_step(self, belief: Gaussian, later: Gaussian, dt: float, rng: np.random.Generator) -> Gaussian:
        """Return the belief at one time given all scans, as any filter over a motion does."""
        motion = self.motion
        if dt == 0 or not self.linearises or not motion.linear or motion.reframes:
            return super().smooth_step(belief, later, dt, rng)
        F, Q, periods = self._memo.step(motion, belief.mean, dt)
        return kernels.smooth_linear(belief.mean, belief.cov, F, Q, later.mean, later.cov, periods)

    def merge(self, belief: Gaussian, mixtures: Mixtures) -> Gaussian:
        """Return the moments of mixtures, if the belief is its moments."""
        if not has_gaussian_belief(self):
            return super().merge(belief, mixtures)
        return marginal(merged(belief, mixtures, self.state), self.state, self.state, self.zero_variance)

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
    if (axes is state or axes.axes == state.axes) and not len(zero_variance):
        return prior
    places = as_slice(axes.locate(state))
    cov = prior.cov[..., places, :][..., places]
    if len(zero_variance):
        cov = without_variance(cov, state.locate(zero_variance))
    return Gaussian(prior.mean[..., places], cov)


def fading(variances: Array, exponent: float) -> Array:
    """Return by how much to multiply covariances so that old returns weigh exp(-exponent) of new ones.

    Parameters
    ----------
    variances
        Of tracks (*b, n).
    exponent
        Logarithm of the factor, >= 0: over a long gap it may be far beyond what a number can hold.

    Returns
    -------
    Array
        The factor (*b), exp(exponent), or less: none takes a variance beyond 1e30, where nothing is remembered.
    """
    most = np.log(ABSURD**2) - kernels.safe_log(np.max(variances, axis=-1))
    # exp(700) is finite: where there is no variance, it is multiplied by 0
    return np.exp(np.minimum(exponent, np.clip(most, 0.0, 700.0)))


def without_variance(cov: Array, axes: list[int]) -> Array:
    """Return covariances (*b, n, n) with zeros in the rows and columns of `axes`."""
    keep = np.ones(cov.shape[-1])
    keep[axes] = 0.0
    return cov * (keep[:, None] * keep)
