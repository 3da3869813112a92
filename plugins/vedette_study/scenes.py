"""Scenes that are drawn for many runs at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol, runtime_checkable

import numpy as np
from attrs import frozen

from vedette.roles import Sensor
from vedette.space import Array, Space
from vedette.types import Scan


@frozen(eq=False)
class Scenes:
    """One target in each of r runs: scans (s of them) whose detections lead with (r,), states (r, s, n) over `space`."""

    scans: tuple[Scan, ...]
    space: Space
    states: Array


@runtime_checkable
class DrawsTogether(Protocol):
    """A source that can draw the scenes of many runs in lock-step."""

    def open_together(self, sensors: Mapping[str, Sensor], rngs: Sequence[np.random.Generator]) -> Scenes | None:
        """Return the scene of each generator, which alone determines it; None if this scene cannot be drawn so."""
        ...
