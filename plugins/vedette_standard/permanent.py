"""The common part of births and lifecycles that start tracks only before the first scan, and never end any."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from attrs import frozen

from vedette import Array, Birth, Detections, Estimator, Lifecycle, Mask, Newborn, Review, Sensor


@frozen
class GivenTracks(Birth):
    """A birth whose tracks all exist before the first scan; a concrete kind states them by `given`."""

    def starts_from(self, sensor: str) -> bool:
        """Return False: no return starts a track."""
        return False

    def begin(
        self, seen: Any, estimator: Estimator[Any], sensor: Sensor, name: str, detections: Detections, claimed: Array
    ) -> Newborn:
        """Raise ValueError: a tracker never calls this, as no return starts a track."""
        raise ValueError(f"{self.kind!r} starts no track at a return")


@frozen
class PermanentTracks(Lifecycle):
    """A lifecycle whose tracks are all confirmed and continue to the end."""

    certain: ClassVar[bool] = True
    permanent: ClassVar[bool] = True

    def start(self, existence: Array) -> None:
        """Return no memory."""

    def review(self, memory: None, scan: Review) -> tuple[None, Mask, Mask]:
        """Return every track as confirmed and alive."""
        always = np.ones(scan.existence.shape, dtype=bool)
        return None, always, always
