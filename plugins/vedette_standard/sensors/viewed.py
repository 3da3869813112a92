"""The common part of sensors that report states as they are within a box."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from attrs import Factory, frozen

from vedette import Array, fields
from vedette.sampling import Bounds, corners
from vedette_standard.sensors.clutter import check_stated_once
from vedette_standard.sensors.direct import DirectSensor


@frozen(kw_only=True)
class ViewedSensor(DirectSensor):
    """A direct sensor that may have a view: a box outside of which it detects nothing, and over which clutter is uniform."""

    view: Mapping[str, Bounds] = fields.part(
        "axis to low and high: nothing outside is detected; default: no limits", default=Factory(dict)
    )
    clutter_per_scan: float = fields.quantity(
        "1", "expected number of false returns per scan, uniform over the view", default=0.0, at_least=0
    )

    def __attrs_post_init__(self) -> None:
        check_stated_once(self.clutter_density, self.clutter_per_scan)
        for name in self.view:
            if name not in self.observes:
                raise ValueError(f"view.{name}: must be one of {', '.join(self.observes.names)}")
        if self.clutter_per_scan > 0 and (lacking := [name for name in self.observes.names if name not in self.view]):
            raise ValueError(f"clutter_per_scan: needs view.{lacking[0]}, which says over what the false returns spread")

    def detects(self, x: Array) -> Array:
        """Return the detection probability: (*b, n) -> (*b), or () without a view."""
        if not self.view:
            return np.asarray(self.detection_probability)
        low, high = np.array(
            [(each.low, each.high) if (each := self.view.get(name)) else (-np.inf, np.inf) for name in self.observes.names]
        ).T
        return np.where(np.all((x >= low) & (x <= high), axis=-1), self.detection_probability, 0.0)

    def clutter(self, z: Array) -> Array:
        """Return the clutter density ()."""
        if self.clutter_per_scan == 0:
            return np.asarray(self.clutter_density)
        lows, highs = corners(self.measurement, self.view)
        return np.asarray(self.clutter_per_scan / np.prod(highs - lows))
