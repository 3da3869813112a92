"""Which two axes a picture shows, and how returns get there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cached_property

import numpy as np
from attrs import frozen

from vedette import Array, Axis, Pose, Recording, Scan, Sensor, Space
from vedette.filters import present_noise
from vedette_files import NORTH_EAST


@frozen
class Plane:
    """The axis that a picture shows from left to right, and the one from bottom to top, with their labels."""

    axes: tuple[Axis, Axis]
    labels: tuple[str, str]

    @classmethod
    def of(cls, space: Space, recording: Recording) -> Plane:
        """Choose the axes x and y if both exist, else the first two of `space`; north up if the recording states it."""
        ground = "x" in space and "y" in space
        first, second = (space.axes[space.names.index(name)] for name in (("x", "y") if ground else space.names[:2]))
        if ground and recording.notes.get("frame") == NORTH_EAST:
            return cls((second, first), (f"east, {second.name} [{second.unit}]", f"north, {first.name} [{first.unit}]"))
        return cls((first, second), (f"{first.name} [{first.unit}]", f"{second.name} [{second.unit}]"))

    @cached_property
    def space(self) -> Space:
        """The two axes."""
        return Space(self.axes)

    def within(self, space: Space) -> bool:
        """Return whether values over `space` can be shown."""
        return all(axis in space.axes for axis in self.axes)

    def points(self, space: Space, values: Array) -> Array:
        """Return points (*b, n) over `space` as (*b, 2)."""
        return values[..., space.locate(self.space)]

    def covariances(self, space: Space, cov: Array) -> Array:
        """Return covariances (*b, n, n) over `space` as (*b, 2, 2)."""
        where = space.locate(self.space)
        return cov[..., where, :][..., :, where]

    def platform(self, position: Array) -> Array:
        """Return positions (*b, d) in x, y order as (*b, 2)."""
        return position[..., [("x", "y").index(axis.name) for axis in self.axes]]

    @property
    def is_ground(self) -> bool:
        """Whether platforms can be shown: they stand on the ground."""
        return self.space.names in (("x", "y"), ("y", "x"))


def returns(scans: Sequence[Scan], sensors: Mapping[str, Sensor], plane: Plane) -> dict[str, Array | None]:
    """Return the positions of each sensor's returns (k, 2), by its name, without those of an unknown one.

    None if one return alone gives no position.
    """
    places: dict[str, Array | None] = {}
    for name, sensor in sensors.items():
        of_sensor = [scan for scan in scans if scan.sensor == name]
        try:
            spots = [_spots(scan, sensor, plane) for scan in of_sensor] if plane.within(sensor.observes) else None
        except NotImplementedError:
            spots = None
        every = None if spots is None else np.concatenate([np.zeros((0, 2)), *spots])
        places[name] = None if every is None else every[np.isfinite(every).all(axis=-1)]
    return places


def positions_of(scan: Scan, sensor: Sensor, plane: Plane | None) -> Array:
    """Return where the returns of a scan are on the map (k, 2); NaN if one return gives no position."""
    unknown = np.full((len(scan.detections.z), 2), np.nan)
    if scan.frame is not None or plane is None or not plane.within(sensor.observes):
        return unknown
    try:
        with np.errstate(all="ignore"):
            unknown[scan.detections.valid] = _spots(scan, sensor, plane)
    except NotImplementedError:
        pass
    return unknown


def _spots(scan: Scan, sensor: Sensor, plane: Plane) -> Array:
    """Return where the valid returns of a scan are (k, 2), NaN where that depends on a component that one lacks."""
    placed = sensor.placed(scan.pose)
    seen, valid = scan.detections, scan.detections.valid
    noise = seen.noise_of(valid)
    if seen.missing is None:
        return plane.points(sensor.observes, placed.invert(seen.z[valid], noise).mean)
    lacking = seen.missing[valid]
    if noise is not None:
        noise = present_noise(noise, ~lacking)
    filled = (placed.invert(np.where(lacking, value, seen.z[valid]), noise).mean for value in (0.0, 1.0))
    one, other = (plane.points(sensor.observes, spot) for spot in filled)
    return np.where((one == other).all(axis=-1, keepdims=True), one, np.nan)


def place_of(sensor: Sensor) -> tuple[float, float] | None:
    """Return where a fixed sensor stands by its parameters `x` and `y`; None if none, or if what it reports is absolute."""
    x, y = getattr(sensor, "x", None), getattr(sensor, "y", None)
    if not isinstance(x, float) or not isinstance(y, float):
        return None
    with suppress(NotImplementedError):
        if sensor.at(Pose(np.zeros(2))) is sensor:
            return None
    return x, y


def stands(scans: Sequence[Scan], sensors: Mapping[str, Sensor], plane: Plane) -> list[Array]:
    """Return the positions of the sensors' platforms (s, 2): those with poses, and the places of fixed sensors.

    A fixed sensor states its place, if it has one.
    """
    if not plane.is_ground:
        return []
    moving = [scan.pose.position[:2] for scan in scans if scan.pose is not None]
    looked = {scan.sensor: scan.pose is not None for scan in scans}
    still: dict[tuple[float, float], None] = {}
    for name, sensor in sensors.items():
        if looked.get(name) is False and (spot := place_of(sensor)) is not None:
            still[spot] = None
    paths = [np.array(moving)] if moving else []
    return [plane.platform(path) for path in (*paths, *(np.array([spot]) for spot in still))]
