"""Polar returns as positions, with their expected bias removed."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array
from vedette_standard.preprocessors.polar import PolarConversion


@final
@frozen
class DebiasedConversion(PolarConversion):
    """The naive position less its expected bias, averaged over where the target may be given the return.

    With s = sigma_bearing^2 and q = sigma_range^2: factor 1 - exp(-s) + exp(-s/2), and the variances
    along = exp(-2s) [r^2 (cosh 2s - cosh s) + q (2 cosh 2s - cosh s)], across the same with sinh.
    cosh 2s - cosh s = 2 sinh(3s/2) sinh(s/2), so that nothing cancels where s is small.
    Lerro, Bar-Shalom, Tracking with Debiased Consistent Converted Measurements versus EKF, IEEE T-AES 29, 1993.

    >>> from vedette import Detections, Pose, Scan
    >>> from vedette_standard import RangeBearing
    >>> here = Pose(np.array([50.0, -30.0]), heading=0.5)  # of a ship
    >>> radar, seen = RangeBearing(sigma_range=20.0, sigma_bearing=0.3), Detections.of([[200.0, 0.3]])
    >>> made = DebiasedConversion({"radar": radar}).process({"radar": Scan(0.0, "radar", seen, here)})
    >>> line, s, r, q = np.array([np.cos(0.8), np.sin(0.8)]), 0.09, 200.0, 400.0
    >>> along, across = (np.exp(-2 * s) * (r**2 * (f(2 * s) - f(s)) + q * (2 * f(2 * s) - f(s))) for f in (np.cosh, np.sinh))
    >>> np.allclose(made.z[0], [50.0, -30.0] + (1 - np.exp(-s) + np.exp(-s / 2)) * r * line)
    True
    >>> np.allclose([line @ made.noise[0] @ line, np.trace(made.noise[0])], [along, along + across])
    True
    """

    kind: ClassVar[str] = "debiased_conversion"

    def moments(self, r: Array, range_variance: Array, bearing_variance: Array) -> tuple[Array, Array, Array]:
        """Return factor and variances, (*b) each."""
        s, q = bearing_variance, range_variance
        even, odd = 2 * np.sinh(1.5 * s) * np.sinh(0.5 * s), 2 * np.cosh(1.5 * s) * np.sinh(0.5 * s)
        along = np.exp(-2 * s) * (r**2 * even + q * (even + np.cosh(2 * s)))
        across = np.exp(-2 * s) * (r**2 * odd + q * (odd + np.sinh(2 * s)))
        return np.exp(-0.5 * s) - np.expm1(-s), along, across
