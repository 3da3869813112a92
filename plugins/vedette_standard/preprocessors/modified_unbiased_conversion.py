"""Polar returns as their conditional mean positions."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array
from vedette_standard.preprocessors.polar import PolarConversion


@final
@frozen
class ModifiedUnbiasedConversion(PolarConversion):
    """The naive position times E cos(bearing error) = exp(-s/2): the mean position given the return, with its covariance.

    s = sigma_bearing^2, q = sigma_range^2: along = r^2 (1 - exp(-s))^2 / 2 + q (1 + exp(-2s))/2,
    across = (r^2 + q)(1 - exp(-2s))/2. Unbiased given the return; given that the target is at r, it is short by
    r (1 - exp(-s)), which is no fault, as its error is conditioned on the return.
    Duan, Han, Li, Comments on "Unbiased Converted Measurements for Tracking", IEEE T-AES 40, 2004.

    >>> from vedette import Detections, Scan
    >>> from vedette_standard import RangeBearing
    >>> radar, seen = RangeBearing(sigma_range=20.0, sigma_bearing=0.3, heading=0.7), Detections.of([[200.0, 0.1]])
    >>> made = ModifiedUnbiasedConversion({"radar": radar}).process({"radar": Scan(0.0, "radar", seen)})
    >>> line, s, r, q = np.array([np.cos(0.8), np.sin(0.8)]), 0.09, 200.0, 400.0
    >>> along = r**2 * (1 - np.exp(-s)) ** 2 / 2 + q * (1 + np.exp(-2 * s)) / 2
    >>> across = (r**2 + q) * (1 - np.exp(-2 * s)) / 2
    >>> np.allclose(made.z[0], np.exp(-s / 2) * r * line)
    True
    >>> np.allclose([line @ made.noise[0] @ line, np.trace(made.noise[0])], [along, along + across])
    True
    """

    kind: ClassVar[str] = "modified_unbiased_conversion"

    def moments(self, r: Array, range_variance: Array, bearing_variance: Array) -> tuple[Array, Array, Array]:
        """Return factor and variances, (*b) each."""
        s, q = bearing_variance, range_variance
        gone = np.expm1(-2 * s)
        return np.exp(-0.5 * s), 0.5 * (r * np.expm1(-s)) ** 2 + q * (1 + 0.5 * gone), -0.5 * (r**2 + q) * gone
