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
