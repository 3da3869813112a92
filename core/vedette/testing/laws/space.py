"""Laws of spaces: axes with units and periods."""

from __future__ import annotations

import numpy as np

from vedette.space import Array, Space
from vedette.testing.comparisons import demand, same


def differences_undo_steps(space: Space, x: Array, step: Array) -> None:
    """A step of less than half a period is what the displaced point differs by, across the wrap too.

    An axis without a period is subtracted and added as it is.
    """
    periods = np.array([np.inf if axis.period is None else axis.period for axis in space.axes])
    short = np.clip(step, -0.49 * periods, 0.49 * periods)
    near_wraps = [np.where(np.isfinite(periods), share * periods, x) for share in (0.499, -0.499)]
    for point in (x, *near_wraps):
        for change in (short, -short):
            there = space.displace(point, change)
            same("difference", space.difference(there, point), change, 1e-9, np.abs(point).max(initial=1.0))
    plain = ~np.isfinite(periods)
    same("difference", space.difference(x + step, x)[..., plain], step[..., plain], 1e-9, np.abs(x).max(initial=1.0))


def wraps_are_canonical(space: Space, x: Array, step: Array) -> None:
    """Whole turns change nothing, and every angle lies in [-period/2, period/2)."""
    for i, axis in enumerate(space.axes):
        if axis.period is None:
            continue
        turned = x + 0.0
        turned[..., i] += axis.period * np.round(step[..., i])
        there = space.canonical(turned)
        inside = (there[..., i] >= -axis.period / 2) & (there[..., i] < axis.period / 2)
        demand(np.all(inside), f"{axis.name}: must be in [-period/2, period/2), got {there[..., i].tolist()}")
        apart = np.abs(there[..., i] - x[..., i])
        turns = axis.period * (1.0 + np.abs(np.round(step[..., i])))
        same(f"{axis.name} after whole turns", np.minimum(apart, axis.period - apart), np.zeros(apart.shape), 1e-9, turns)


def speeds_have_their_units(space: Space) -> None:
    """An axis vx beside x is in the unit of x per time."""
    units = {axis.name: axis.unit for axis in space.axes}
    for name, unit in units.items():
        speed = units.get(f"v{name}", unit)
        otherwise = f"v{name}: must be in {unit}/s, as {name} is, is in {speed}"
        demand(f"v{name}" not in units or speed.startswith(f"{unit}/"), otherwise)
