"""The base of estimators over one motion model, and their prediction outside a tracker."""

from __future__ import annotations

from abc import abstractmethod
from typing import Generic

import numpy as np
from attrs import frozen

from vedette.kernels import backward
from vedette.roles import B, Estimator, MotionModel
from vedette.space import Space
from vedette.types import Gaussian


@frozen
class OverMotion(Estimator[B], Generic[B]):
    """An estimator whose state is that of its one motion model."""

    @property
    @abstractmethod
    def motion(self) -> MotionModel:
        """How the target moves; a parameter of the estimator."""

    @property
    def state(self) -> Space:
        return self.motion.state

    @property
    def zero_variance(self) -> Space:
        return self.motion.zero_variance

    def smooth_step(self, belief: B, later: B, dt: float, rng: np.random.Generator) -> B:
        """Return the belief at one time given all scans: the step of Rauch, Tung and Striebel.

        It uses `moments`, `ahead` and `cross_covariance`, and is exact for linear models. An estimator whose belief is
        more than a mean and a covariance must define its own.
        """
        if dt == 0:
            return later
        if self.motion.reframes:
            raise NotImplementedError(f"the motion of {self.kind!r} turns its frame: two moments have none in common")
        now, cross, after = self.moments(belief), self.cross_covariance(belief, dt), self.moments(later)
        ahead = self.ahead(belief, dt, rng)
        step = self.state.difference(after.mean, ahead.mean)
        shift, cov = backward.smooth_step(now.cov, ahead.cov, cross, step, after.cov)
        return self.start(Gaussian(self.state.displace(now.mean, shift), cov), self.state, rng)

    def ahead(self, belief: B, dt: float, rng: np.random.Generator) -> Gaussian:
        """Return the moments `dt` s later, to which `cross_covariance` goes, dt > 0: those of other draws do not."""
        if self.traits.draws:
            raise NotImplementedError(f"{self.kind!r} draws its noise: define `ahead`, the moments without draws")
        return self.moments(self.predict(belief, dt, rng))


def predicted(estimator: Estimator[B], belief: B, dt: float, rng: np.random.Generator) -> B:
    """Return the belief `dt` s later, in the frame of its own estimate if the estimator reframes.

    For the outermost estimator, as the tracker predicts it: a mixture reframes the beliefs of its modes itself.

    Parameters
    ----------
    estimator
        The estimator of the belief.
    belief
        Of tracks (*b, t).
    dt
        Time step in s, >= 0.
    rng
        The generator of an estimator that draws; `vedette.sampling.NO_DRAWS` for others.

    Returns
    -------
    belief
        Of the same kind and shapes.
    """
    if dt > 0 and estimator.traits.reframes:
        belief = estimator.reframe(belief, estimator.moments(belief))
    return estimator.predict(belief, dt, rng)
