"""What a service keeps for a restart, as plain data: the state before the window, the scans within it, the clocks."""

from __future__ import annotations

import json
from collections.abc import Mapping
from hashlib import sha256
from typing import Any

import numpy as np

from vedette.config import to_config
from vedette.tracking import State, Tracker
from vedette.types import Detections, Pose, Scan
from vedette_live.grouping import Clock


def digest_of(tracker: Tracker, seed: int) -> str:
    """Return what identifies a tracker: saved states fit only the one that made them."""
    return sha256(json.dumps([to_config(tracker), seed], sort_keys=True).encode()).hexdigest()


_ARRAYS = ("evidence", "noise", "identity")


def scan_data(scan: Scan) -> dict[str, Any]:
    """Return a scan as plain data; floats read back to the last bit."""
    seen, pose = scan.detections, scan.pose
    place = None
    if pose is not None:
        velocity = None if pose.velocity is None else pose.velocity.tolist()
        place = [pose.position.tolist(), velocity, float(pose.heading)]
    return {
        "time": scan.time,
        "sensor": scan.sensor,
        "z": seen.z.tolist(),
        "axes": seen.z.shape[-1],
        **{name: None if getattr(seen, name) is None else getattr(seen, name).tolist() for name in _ARRAYS},
        "pose": place,
    }


def scan_from(given: Mapping[str, Any]) -> Scan:
    """Return the scan of `scan_data`."""
    z = np.array(given["z"], dtype=float).reshape(-1, given["axes"])
    evidence, noise, identity = (None if given[name] is None else np.array(given[name]) for name in _ARRAYS)
    pose = None
    if given["pose"] is not None:
        position, velocity, heading = given["pose"]
        pose = Pose(np.array(position), None if velocity is None else np.array(velocity), heading)
    return Scan(
        given["time"], given["sensor"], Detections(z, np.ones(len(z), dtype=bool), evidence, noise, None, identity), pose
    )


def clocks_data(clocks: Mapping[str, Clock]) -> dict[str, Any]:
    """Return the clocks of an input as plain data."""
    return {name: [None if clock.offset == np.inf else clock.offset, clock.last] for name, clock in clocks.items()}


def clocks_from(given: Mapping[str, Any], by: str) -> dict[str, Clock]:
    """Return the clocks of `clocks_data`."""
    return {name: Clock(by, np.inf if offset is None else offset, last) for name, (offset, last) in given.items()}


def state_data(state: State) -> Any:
    """Return a state as plain data."""
    return state.to_data()


def state_from(tracker: Tracker, given: Any) -> State:
    """Return the state of `state_data`."""
    return tracker.state_from(given)
