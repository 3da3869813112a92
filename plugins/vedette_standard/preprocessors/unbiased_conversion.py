"""Polar returns as positions without bias."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array
from vedette_standard.preprocessors.polar import PolarConversion


@final
@frozen
class UnbiasedConversion(PolarConversion):
    """The naive position divided by E cos(bearing error) = exp(-s/2): unbiased given the target's position.

    Covariance given the return, s = sigma_bearing^2, q = sigma_range^2:
    along = (exp(s) - 2) r^2 + (r^2 + q)(1 + exp(-2s))/2, across = (r^2 + q)(1 - exp(-2s))/2.
    Mo, Song, Zhou, Sun, Bar-Shalom, Unbiased Converted Measurements for Tracking, IEEE T-AES 34, 1998.

    >>> from vedette import Detections, Scan
    >>> from vedette_standard import RangeBearing
    >>> radar = RangeBearing(sigma_range=20.0, sigma_bearing=0.3, x=50.0, y=-30.0)
    >>> made = UnbiasedConversion({"radar": radar}).process({"radar": Scan(0.0, "radar", Detections.of([[200.0, 0.8]]))})
    >>> line, s, r, q = np.array([np.cos(0.8), np.sin(0.8)]), 0.09, 200.0, 400.0
    >>> along = (np.exp(s) - 2) * r**2 + (r**2 + q) * (1 + np.exp(-2 * s)) / 2
    >>> across = (r**2 + q) * (1 - np.exp(-2 * s)) / 2
    >>> np.allclose(made.z[0], [50.0, -30.0] + np.exp(s / 2) * r * line)
    True
    >>> np.allclose([line @ made.noise[0] @ line, np.trace(made.noise[0])], [along, along + across])
    True
    """

    kind: ClassVar[str] = "unbiased_conversion"

    def moments(self, r: Array, range_variance: Array, bearing_variance: Array) -> tuple[Array, Array, Array]:
        """Return factor and variances, (*b) each."""
        s, q = bearing_variance, range_variance
        gone = np.expm1(-2 * s)
        along = r**2 * (np.expm1(s) + 0.5 * gone) + q * (1 + 0.5 * gone)
        return np.exp(0.5 * s), along, -0.5 * (r**2 + q) * gone
