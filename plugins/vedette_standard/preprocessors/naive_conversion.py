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
    """

    kind: ClassVar[str] = "naive_conversion"

    def moments(self, r: Array, range_variance: Array, bearing_variance: Array) -> tuple[Array, Array, Array]:
        """Return factor and variances, (*b) each."""
        across = np.maximum(r**2, range_variance) * bearing_variance
        return np.ones_like(r), np.broadcast_to(range_variance, r.shape), across
