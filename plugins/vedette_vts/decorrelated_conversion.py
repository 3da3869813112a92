"""Polar returns as unbiased positions, without a covariance of their own."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, final

from attrs import evolve, frozen

from vedette import Detections, Preprocessor, Scan, Sensor, Space, fields


@final
@frozen
class DecorrelatedConversion(Preprocessor):
    """Converts by another conversion, which is to be unbiased given the target, and leaves R to the tracker's sensor.

    That is `decorrelated_position`, which evaluates R where the target is believed to be, for z = exp(s/2) r (cos b, sin b),
    s = sigma_bearing^2, as `unbiased_conversion` makes it.
    Bordonaro, Willett, Bar-Shalom, Decorrelated Unbiased Converted Measurement Kalman Filter, IEEE T-AES 50, 2014.

    >>> import numpy as np
    >>> from vedette_standard import RangeBearing, UnbiasedConversion
    >>> of = UnbiasedConversion({"radar": RangeBearing(sigma_range=20.0, sigma_bearing=0.3)})
    >>> made = DecorrelatedConversion(of).process({"radar": Scan(0.0, "radar", Detections.of([[200.0, 0.8]]))})
    >>> np.allclose(made.z[0], np.exp(0.045) * 200.0 * np.array([np.cos(0.8), np.sin(0.8)])), made.noise is None
    (True, True)
    """

    kind: ClassVar[str] = "decorrelated_conversion"

    of: Preprocessor = fields.part("the conversion: `unbiased_conversion`")

    @property
    def sensors(self) -> Mapping[str, Sensor]:
        return self.of.sensors

    @property
    def measurement(self) -> Space:
        return self.of.measurement

    def process(self, scans: Mapping[str, Scan]) -> Detections:
        """Return what the conversion makes of the scans, (*b, k, 2), without its noise."""
        return evolve(self.of.process(scans), noise=None)
