"""Configs of ships that a radar and a beacon see, for what is run rather than read."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

RADAR = {"kind": "cartesian_position", "sigma": 5.0, "clutter_density": 2e-6}
AROUND = {"interval": 1.0, "clutter": {axis: {"low": -900, "high": 900} for axis in "xy"}}
"""A look once a second, with clutter."""


def radar_and_beacon(
    ships: Mapping[str, Any], duration: float, radar: Mapping[str, Any], looks: Mapping[str, Any], **changes: Any
) -> dict[str, Any]:
    """Return a config of `ships` that are seen for `duration` s; `changes` replace what else it has."""
    return {
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.1}},
        "sensors": {
            "radar": dict(radar),
            "beacon": {"kind": "cartesian_position", "sigma": 3.0},
        },
        "associator": {"kind": "gnn"},
        "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
        "lifecycle": {"kind": "m_of_n"},
        "source": {"kind": "simulation", "duration": duration, "looks": dict(looks), "ships": dict(ships)},
        **changes,
    }
