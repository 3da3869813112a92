"""The common part of sensors that report states as they are, within what they see."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from attrs import Factory, frozen

from vedette import Array, Mask, Pose, Sensor, fields
from vedette.sampling import Bounds
from vedette_standard.regions import Polygon
from vedette_standard.sensors.clutter import check_stated_once
from vedette_standard.sensors.direct import DirectSensor
from vedette_standard.sensors.placed import PlacedSensor
from vedette_standard.sensors.view import width


@frozen(kw_only=True)
class ViewedSensor(PlacedSensor, DirectSensor):
    """A direct sensor that sees within a box too, if it has a `view`; its clutter is uniform over all that it sees."""

    view: Mapping[str, Bounds] = fields.part(
        "axis to low and high: nothing outside is detected; default: no limits", default=Factory(dict)
    )

    def __attrs_post_init__(self) -> None:
        check_stated_once(self.clutter_density, self.clutter_per_scan)
        for name in self.view:
            if name not in self.observes:
                raise ValueError(f"view.{name}: must be one of {', '.join(self.observes.names)}")
        super().__attrs_post_init__()

    def _unlimited(self) -> bool:
        return not self.view and super()._unlimited()

    def _unbounded(self) -> str:
        bounded = self.max_range is not None or bool(self.polygons)
        lacking = [name for name in self.observes.names[2 if bounded else 0 :] if name not in self.view]
        return f"view.{lacking[0]}" if lacking else ""

    def _around(self) -> bool:
        """Return whether what it sees depends on where it stands."""
        return self.min_range > 0 or self.max_range is not None or bool(self.sectors) or self.detection is not None

    def _limits(self) -> tuple[Array, Array]:
        """Return the corners of the box (n,), infinite where it has no limit."""
        none = (-np.inf, np.inf)
        low, high = np.array(
            [(interval.low, interval.high) if (interval := self.view.get(name)) else none for name in self.observes.names]
        ).T
        return low, high

    def _boxes(self) -> tuple[Polygon, ...]:
        if "x" not in self.view and "y" not in self.view:
            return ()
        reach = self.max_range or max((float(np.max(np.abs(polygon.corners))) for polygon in self.polygons), default=np.inf)
        far = 2 * (reach + float(np.max(np.abs(self._pose.position))))
        (left, low), (right, high) = (np.clip(side[:2], -far, far) for side in self._limits())
        return (Polygon(np.array([[left, low], [right, low], [right, high], [left, high]])),)

    def _summed(self) -> int:
        partly = self._around() and bool(self._boxes())
        return 2 if self.polygons or partly else 0

    def detects(self, x: Array) -> Array:
        """Return the detection probability: (*b, n) -> (*b), or () where nothing limits the view."""
        if self._everywhere is not None:
            return self._everywhere
        around = super().detects(x)
        return around if not self.view else np.where(self._within(x), around, 0.0)

    def _within(self, x: Array) -> Mask:
        low, high = self._limits()
        return np.all((x >= low) & (x <= high), axis=-1)

    def covers(self, z: Array) -> Mask:
        around = super().covers(z)
        return around if not self.view else around & self._within(z)

    def clutter(self, z: Array) -> Array:
        """Return the clutter density ()."""
        if self.clutter_per_scan == 0:
            return np.asarray(self.clutter_density)
        low, high = self._limits()
        if self._size:
            seen = self._size
        elif self.max_range is not None:
            seen = 0.5 * width(self.sectors) * (self.max_range**2 - self.min_range**2)
        else:
            seen = float(np.prod(high[:2] - low[:2]))
        return np.asarray(self.clutter_per_scan / (seen * np.prod(high[2:] - low[2:])))

    def at(self, pose: Pose) -> Sensor:
        """Return the same sensor seeing from `pose`; what it reports is absolute."""
        return super().at(pose) if self._around() else self
