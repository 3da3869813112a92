"""The unscented Kalman filter."""

from __future__ import annotations

from typing import ClassVar, final

from attrs import frozen

from vedette import MotionModel, Traits, fields
from vedette_standard.points import PointFilter


@final
@frozen
class UnscentedKalman(PointFilter):
    """Moves 2n+1 points of the belief through motion and sensor and takes their moments; the noises are additive.

    Points: the mean, and the mean +- the columns of the Cholesky factor of (n + kappa) P, weights kappa / (n + kappa) and
    1 / (2 (n + kappa)). kappa >= 0, so that every weight is positive and every covariance PSD by construction.
    Julier, Uhlmann, Unscented Filtering and Nonlinear Estimation, Proc. IEEE 92, 2004.

    >>> import numpy as np
    >>> from vedette import Detections, Gaussian
    >>> from vedette_standard import CoordinatedTurn, RangeOnly
    >>> motion, w = CoordinatedTurn(0.5, 0.02), np.array([2.0] + [0.5] * 10) / 7.0  # n + kappa = 5 + 2
    >>> def points(x, P):
    ...     return x + np.vstack([np.zeros(5), np.linalg.cholesky(7.0 * P).T, -np.linalg.cholesky(7.0 * P).T])
    >>> x, P = np.array([60.0, 80.0, 9.0, -4.0, 0.3]), np.diag([900.0, 400.0, 4.0, 9.0, 0.01])
    >>> estimator, moved = UnscentedKalman(motion, kappa=2.0), motion.move(points(x, P), 3.0)
    >>> ahead = estimator.predict(estimator.start(Gaussian(x[None], P[None]), motion.state, None), 3.0, None)
    >>> off = moved - w @ moved
    >>> np.allclose(ahead.mean[0], w @ moved), np.allclose(ahead.cov[0], (w * off.T) @ off + motion.noise(x, 3.0))
    (True, True)
    >>> at = points(ahead.mean[0], ahead.cov[0])
    >>> ranges, dx = np.hypot(at[:, 0], at[:, 1]), at - ahead.mean[0]
    >>> nu, dz = 140.0 - w @ ranges, ranges - w @ ranges
    >>> S, K = w @ dz**2 + 25.0, (w * dx.T) @ dz / (w @ dz**2 + 25.0)
    >>> seen = estimator.evaluate(ahead, RangeOnly(5.0), Detections.of([[140.0]]), 1.0)
    >>> after = estimator.update(ahead, seen, np.array([[0.0, 1.0]]))
    >>> np.allclose(after.mean[0], ahead.mean[0] + K * nu), np.allclose(after.cov[0], ahead.cov[0] - np.outer(K, K) * S)
    (True, True)
    """

    kind: ClassVar[str] = "ukf"
    declares: ClassVar[Traits] = Traits(exact_when_linear=True, bounded=True)

    motion: MotionModel = fields.part("how the target moves")
    kappa: float = fields.quantity("1", "weight of the central point, times n + kappa", default=1.0, at_least=0)
