"""What a service keeps for a restart, as plain data: the state before the window, the scans within it, the clocks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from vedette.config import to_config
from vedette.errors import InputError
from vedette.experiment import Experiment
from vedette.tracking import State, Tracker
from vedette.types import Detections, Pose, Scan
from vedette_files import code, long_names
from vedette_live.grouping import Clock, Formed
from vedette_report.provenance import differences, identity, packages_of


def made_by(experiment: Experiment) -> dict[str, Any]:
    """Return what makes the states of a service, as plain data: its config, the axes of its tracks, and the code."""
    config = {name: value for name, value in to_config(experiment).items() if name not in _NO_PART}
    code = identity(packages_of([config], "vedette_live"))
    return {"config": config, "axes": [[axis.name, axis.unit] for axis in experiment.tracker.state.axes], "code": code}


_NO_PART = ("title", "judge", "source")
"""Of a config, what has no part in the states."""


def changed(saved: Mapping[str, Any], here: Mapping[str, Any]) -> tuple[list[str], list[str]]:
    """Return the places where the config of a saved state is another one than here, and what of the code is."""
    there, now = (dict(_leaves(made["config"], "")) for made in (saved, here))
    places = [place for place in sorted({*there, *now}) if there.get(place) != now.get(place)]
    refused, told = differences(saved["code"], here["code"], "code")
    return places, [*map(str, refused), *told]


def _leaves(given: Any, place: str) -> Iterator[tuple[str, Any]]:
    """Yield the places of a config that hold no further ones, and what they hold."""
    if isinstance(given, Mapping) and given:
        for name, value in given.items():
            yield from _leaves(value, f"{place}.{name}" if place else str(name))
    else:
        yield place, given


_ARRAYS = {"evidence": "evidence", "noise": "noise", "missing": "missing", "identity": "identity", "times": "time"}
"""What is written of returns, and what `Detections` calls it."""


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
        **{key: getattr(seen, name).tolist() for key, name in _ARRAYS.items() if getattr(seen, name) is not None},
        "names": [] if seen.identity is None else long_names(seen.identity.tolist()),
        "pose": place,
    }


def scan_from(given: Mapping[str, Any]) -> Scan:
    """Return the scan of `scan_data`."""
    z = np.array(given["z"], dtype=float).reshape(-1, given["axes"])
    for name in given.get("names", []):  # the data of an older Vedette lack it
        code(name)
    arrays = {name: np.array(given[key]) for key, name in _ARRAYS.items() if given.get(key) is not None}
    pose = None
    if given["pose"] is not None:
        position, velocity, heading = given["pose"]
        pose = Pose(np.array(position), None if velocity is None else np.array(velocity), heading)
    return Scan(given["time"], given["sensor"], Detections(z, np.ones(len(z), dtype=bool), **arrays), pose)


def formed_data(formed: Formed) -> dict[str, Any]:
    """Return a scan that came, and when, as plain data."""
    return {**scan_data(formed.scan), "arrived": formed.arrived}


def formed_from(given: Mapping[str, Any]) -> Formed:
    """Return the scan of `formed_data`; its messages have been counted."""
    return Formed(scan_from(given), given["arrived"], 0)


def clocks_data(clocks: Mapping[str, Clock]) -> dict[str, Any]:
    """Return the clocks of an input as plain data."""
    return {name: [None if clock.offset == np.inf else clock.offset, clock.latest] for name, clock in clocks.items()}


def clocks_from(given: Mapping[str, Any], by: str, leap: float) -> dict[str, Clock]:
    """Return the clocks of `clocks_data`."""
    known = ((name, np.inf if offset is None else offset, latest) for name, (offset, latest) in given.items())
    return {name: Clock(by, leap, offset, last=latest, latest=latest) for name, offset, latest in known}


def state_from(tracker: Tracker, given: Any, axes: Any) -> State:
    """Return the state of `State.to_data` over these axes; InputError if it is none of this tracker."""
    own = [[axis.name, axis.unit] for axis in tracker.state.axes]
    if axes != own:
        raise InputError(f"state: is over {axes}, and this tracker's is over {own}")
    return tracker.state_from(given)
