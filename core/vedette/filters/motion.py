"""What an estimator over one motion model need not define, and how it is predicted."""

from __future__ import annotations

from abc import abstractmethod
from typing import Generic, TypeVar

import numpy as np
from attrs import frozen

from vedette.roles import Estimator, MotionModel
from vedette.space import Space

B = TypeVar("B")


@frozen
class OverMotion(Estimator[B], Generic[B]):
    """An estimator whose state is that of its one motion model, and that turns its frame where the motion does."""

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

    @property
    def reframes(self) -> bool:  # type: ignore[override]  # a class variable elsewhere: here it depends on the motion
        """Whether the motion does."""
        return self.motion.reframes


def predicted(estimator: Estimator[B], belief: B, dt: float, rng: np.random.Generator) -> B:
    """Return the belief `dt` s later, in the frame of its own estimate if the estimator `reframes`.

    For the outermost estimator, as the tracker predicts it: a mixture re-expresses the beliefs of its modes itself.
    """
    if estimator.reframes and dt > 0:
        belief = estimator.reframe(belief, estimator.moments(belief))
    return estimator.predict(belief, dt, rng)
