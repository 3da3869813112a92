"""Scenes that are drawn for many runs at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol, runtime_checkable

import numpy as np
from attrs import frozen

from vedette import Array, Scan, Sensor, Space, Trajectory
from vedette.sampling import Bounds, draw_detections


@frozen(eq=False)
class Scenes:
    """One target in each of r runs: scans (s of them) whose detections lead with (r,), states (r, s, n) over `space`."""

    scans: tuple[Scan, ...]
    space: Space
    states: Array


def around_path(
    path: Trajectory, sensors: Mapping[str, Sensor], runs: int, reach: float, rng: np.random.Generator
) -> list[list[Scan]]:
    """Draw what sensors of x and y report of an object in each run: at each of its times a scan of each sensor.

    Clutter is drawn on each axis up to `reach`, in m, from the object; at its first two times there is none.
    """
    moments = []
    for i, (time, state) in enumerate(zip(path.times.tolist(), path.states, strict=True)):
        around = {name: Bounds(spot - reach, spot + reach) for name, spot in zip("xy", state[:2], strict=True)}
        x, region = np.broadcast_to(state[:2], (runs, 1, 2)), around if i > 1 else None
        moments.append([Scan(time, name, draw_detections(each, x, rng, region)) for name, each in sensors.items()])
    return moments


@runtime_checkable
class DrawsTogether(Protocol):
    """A source that can draw the scenes of many runs in lock-step."""

    def open_together(self, sensors: Mapping[str, Sensor], rngs: Sequence[np.random.Generator]) -> Scenes | None:
        """Return the scene of each generator, which alone determines it; None if this scene cannot be drawn so."""
        ...
