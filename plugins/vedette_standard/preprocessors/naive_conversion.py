"""Polar returns as positions, to first order."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array
from vedette_standard.preprocessors.polar import PolarConversion


@final
@frozen
class NaiveConversion(PolarConversion):
    """z = r (cos b, sin b), R = J diag(sigma_range^2, sigma_bearing^2) J': variances sigma_range^2 and r^2 sigma_bearing^2.

    Given that the target is at r, z is short of it by r (1 - exp(-s/2)) on average, s = sigma_bearing^2: harmless while
    r s is well below .4 sigma_range. Nearer than sigma_range the variance across is that at sigma_range, or it would be 0.
    Bar-Shalom, Li, Multitarget-Multisensor Tracking, 1995, section 1.6.

    >>> from vedette import Detections, Scan
    >>> from vedette_standard import RangeBearing
    >>> radar = RangeBearing(sigma_range=20.0, sigma_bearing=0.2, x=50.0, y=-30.0, heading=0.3)
    >>> own = np.array([[[400.0, 2.0], [2.0, 0.04]], [[400.0, 0.0], [0.0, 0.04]]])
    >>> seen = Detections(np.array([[400.0, 0.5], [5.0, 0.5]]), np.ones(2, dtype=bool), noise=own)  # 5 m is nearer than 20
    >>> made = NaiveConversion({"radar": radar}).process({"radar": Scan(0.0, "radar", seen)})
    >>> T = np.array([[np.cos(0.8), -np.sin(0.8)], [np.sin(0.8), np.cos(0.8)]])
    >>> np.allclose(made.z, [50.0, -30.0] + np.array([[400.0], [5.0]]) * T[:, 0])
    True
    >>> np.allclose(T.T @ made.noise @ T, [[[400.0, 800.0], [800.0, 6400.0]], [[400.0, 0.0], [0.0, 16.0]]])
    True
    """

    kind: ClassVar[str] = "naive_conversion"

    def moments(self, r: Array, range_variance: Array, bearing_variance: Array) -> tuple[Array, Array, Array]:
        """Return factor and variances, (*b) each."""
        across = np.maximum(r**2, range_variance) * bearing_variance
        return np.ones_like(r), np.broadcast_to(range_variance, r.shape), across
