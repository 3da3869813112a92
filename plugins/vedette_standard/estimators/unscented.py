"""The unscented Kalman filter."""

from __future__ import annotations

from typing import ClassVar, final

from attrs import frozen

from vedette import MotionModel, Traits, fields
from vedette.filters import PointFilter


@final
@frozen
class UnscentedKalman(PointFilter):
    """Moves 2n+1 points of the belief through motion and sensor and takes their moments; the noises are additive.

    Points: the mean, and the mean +- the columns of the Cholesky factor of (n + kappa) P, weights kappa / (n + kappa) and
    1 / (2 (n + kappa)). kappa >= 0, so that every weight is positive and every covariance PSD by construction.
    Julier, Uhlmann, Unscented Filtering and Nonlinear Estimation, Proc. IEEE 92, 2004.
    """

    kind: ClassVar[str] = "ukf"
    declares: ClassVar[Traits] = Traits(exact_when_linear=True)

    motion: MotionModel = fields.part("how the target moves")
    kappa: float = fields.quantity("1", "weight of the central point, times n + kappa", default=1.0, at_least=0)
