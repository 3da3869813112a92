"""The cubature Kalman filter."""

from __future__ import annotations

from typing import ClassVar, final

from attrs import frozen

from vedette import MotionModel, Traits, fields
from vedette_standard.points import PointFilter


@final
@frozen
class CubatureKalman(PointFilter):
    """Moves the 2n points mean +- sqrt(n) columns of the Cholesky factor of P, weights 1/(2n), and takes their moments.

    The rule is exact for polynomials up to the third degree. It is the unscented filter without a central point, kappa = 0,
    and is computed so.
    Arasaratnam, Haykin, Cubature Kalman Filters, IEEE Trans. Automatic Control 54, 2009.

    >>> import numpy as np
    >>> from vedette import Detections, Gaussian
    >>> from vedette_standard import RandomWalk, RangeOnly
    >>> estimator, x, P = CubatureKalman(RandomWalk(2.0)), np.array([30.0, 40.0]), np.array([[400.0, 60.0], [60.0, 100.0]])
    >>> root = np.sqrt(2.0) * np.linalg.cholesky(P)  # n = 2: four points of weight 1/4
    >>> points = x + np.vstack([root.T, -root.T])
    >>> ranges = np.hypot(*points.T)
    >>> S = np.var(ranges) + 25.0
    >>> K = (points - x).T @ (ranges - np.mean(ranges)) / 4.0 / S
    >>> belief = estimator.start(Gaussian(x[None], P[None]), estimator.state, None)
    >>> after = estimator.update(
    ...     belief, estimator.evaluate(belief, RangeOnly(5.0), Detections.of([[70.0]]), 1.0), np.array([[0.0, 1.0]])
    ... )
    >>> np.allclose(after.mean[0], x + K * (70.0 - np.mean(ranges))), np.allclose(after.cov[0], P - np.outer(K, K) * S)
    (True, True)
    """

    kind: ClassVar[str] = "ckf"
    declares: ClassVar[Traits] = Traits(exact_when_linear=True, bounded=True)
    kappa: ClassVar[float] = 0.0
    """0: no central point."""

    motion: MotionModel = fields.part("how the target moves")
