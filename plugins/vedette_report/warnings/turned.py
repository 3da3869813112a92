"""Whether a radar's bearings are turned: its returns against targets whose places truth or named reports tell."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence

import numpy as np
from attrs import frozen

from vedette import Array, Scan, Sensor, Tracker, Trajectory
from vedette_report.detector_errors.in_tracks import placed_in_plane
from vedette_report.known import known
from vedette_report.warnings.rivals import Looks, rivals_of
from vedette_standard import stands

WIDEST = np.radians(15.0)
"""Larger angles are not looked for."""
ALONG, SIGMAS = 30.0, 5.0
"""A return is compared with a target at its range: within so many m, and so many of the sensor's standard deviations."""
LONGEST = 60.0
"""Between reports further apart than this, in s, nothing is known of where a target is."""
SAMPLED, ENOUGH, PART, MORE = 1000, 20, 0.3, 1.5
"""So many scans are looked at, at most. An angle is told if so many returns agree on it, of so large a part of the targets'
looks, so many times as on none, and if it is larger than a return's error, five times its own, and the step at which angles
are tried. Set by hand, before any scene was drawn.
"""


@frozen
class Turned:
    """The angle by which a sensor's returns are turned and its deviation, in rad, of how many targets, known by what.

    polar: whether it measures range and bearing; reports: whether targets are known by reports with names; rivals: what else
    explains it as well.
    """

    sensor: str
    angle: float
    deviation: float
    targets: int
    by: str
    polar: bool
    reports: bool
    rivals: tuple[str, ...] = ()

    def data(self) -> dict[str, object]:
        """Return the figures as plain data."""
        return {"sensor": self.sensor, "bearing": [self.angle, self.deviation], "by": self.by, "or": list(self.rivals)}

    def __str__(self) -> str:
        """Say what it looks like, and what to do."""
        told = f"{np.degrees(self.angle):+.1f} +- {max(np.degrees(self.deviation), 0.05):.1f} degrees in bearing"
        read = "" if self.polar else "read its returns as range and bearing, as examples/joyride.toml does, and "
        stated = f'kind = "displaced", add = {{ bearing = {self.angle:.4f} }}, of = {{ ... }}'
        found = "; or the tracks find it: `biased` and [registration], docs/concepts/registration.md" if self.reports else ""
        places = f"{self.targets} target{'s' if self.targets > 1 else ''} of {self.by}"
        told = ", or ".join([f"{told} from {places}", *self.rivals])
        apart = ", which these targets do not tell apart" if self.rivals else ""
        return f"{self.sensor}: its returns lie {told}{apart}: where is north? To state it, {read}set {stated}{found}"


def turned(tracker: Tracker, scans: Sequence[Scan], truth: Sequence[Trajectory]) -> Iterator[Turned]:
    """Yield each sensor of range and bearing whose returns lie beside all targets by the same angle.

    None whose returns an offset of all, or a lag, explains better.
    """
    every = _known(tracker, scans, truth)
    some = [scans[i] for i in np.unique(np.linspace(0, len(scans) - 1, SAMPLED).astype(int))] if len(scans) else []
    for name, sensor in tracker.sensors.items():
        if _looks_round(sensor) and set(sensor.observes.names) <= {"x", "y", "vx", "vy"}:
            for by, targets in every.items():
                if by == name:
                    continue
                own = [scan for scan in some if scan.sensor == name]
                found = _of_sensor(name, sensor, own, by, targets, by in tracker.sensors)
                if found is not None:
                    yield found
                    break


def _looks_round(sensor: Sensor) -> bool:
    """Return whether it measures range and bearing, or x and y from these."""
    names = set(sensor.measurement.names)
    return {"range", "bearing"} <= names or ({"x", "y"} <= names and stands(sensor) is not None)


def _known(tracker: Tracker, scans: Sequence[Scan], truth: Sequence[Trajectory]) -> dict[str, list[tuple[Array, Array]]]:
    """Return times (s,) and places (s, 2) of targets, by what tells of them."""
    every: dict[str, list[tuple[Array, Array]]] = {}
    if own := [one for one in truth if {"x", "y"} <= set(one.space.names) and len(one.times)]:
        every["the truth"] = [
            (one.times, one.states[:, [one.space.names.index("x"), one.space.names.index("y")]]) for one in own
        ]
    reports: dict[str, dict[int, list[tuple[float, Array]]]] = defaultdict(lambda: defaultdict(list))
    for scan in scans:
        names = tracker.sensors[scan.sensor].measurement.names
        if scan.detections.identity is None or not {"x", "y"} <= set(names):
            continue
        place = known(scan.detections)[:, [names.index("x"), names.index("y")]]
        for code, at in zip(scan.detections.identity.tolist(), place, strict=True):
            if code >= 0 and np.isfinite(at).all():
                reports[scan.sensor][code].append((scan.time, at))
    for name, of in reports.items():
        told = [(np.array([time for time, _ in one]), np.array([at for _, at in one])) for one in of.values()]
        every[name] = [one for one in told if len(one[0]) > 1]
    return every


def _of_sensor(
    name: str, sensor: Sensor, scans: Sequence[Scan], by: str, targets: Sequence[tuple[Array, Array]], reports: bool
) -> Turned | None:
    """Return by how much a sensor is turned; None if it does not look so."""
    looks, offsets, owners, sigmas = 0, list[Array](), list[int](), list[float]()
    seen = list[tuple[Array, Array, Array, Array]]()
    polar = "bearing" in sensor.measurement.names
    for scan in scans:
        placed, pose, in_plane = sensor.placed(scan.pose), stands(sensor.placed(scan.pose)), placed_in_plane(sensor, scan)
        z = known(scan.detections)
        for owner, (times, places) in enumerate(targets):
            if (found := _place(times, places, scan.time)) is None:
                continue
            at, velocity = found
            x = np.zeros(len(sensor.observes))
            x[[sensor.observes.names.index("x"), sensor.observes.names.index("y")]] = at
            if float(np.max(placed.detects(x))) < PART:
                continue
            looks += 1
            d, sigma = _beside(placed, x, z) if polar else _beside_in_plane(placed, x, z)
            near = (np.abs(d[:, 0]) < ALONG + SIGMAS * sigma[0]) & (np.abs(d[:, 1]) < WIDEST)
            if near.any():
                offsets.append(d[near, 1])
                owners.append(owner)
                sigmas.append(float(sigma[1]))
                if pose is not None and in_plane is not None:
                    seen.append((at - pose.position[:2], velocity, in_plane.mean[near] - at, in_plane.cov[near]))
    if len(offsets) < ENOUGH:
        return None
    error = float(np.median(sigmas))
    reach = max(1.5 * error, np.radians(0.3))
    step = reach / 3.0
    grid = np.arange(-WIDEST, WIDEST, step)
    votes = np.zeros(len(grid), dtype=np.int64)
    for one in offsets:
        votes += np.any(np.abs(grid[:, None] - one) < reach, axis=1)
    angle = float(np.mean(grid[votes == np.max(votes)]))
    for _ in range(3):
        nearest = np.array([one[np.argmin(np.abs(one - angle))] for one in offsets])
        agrees = np.abs(nearest - angle) < 2.0 * reach
        angle = float(np.median(nearest[agrees])) if agrees.any() else angle
    count = int(np.count_nonzero(agrees))
    around = sum(bool(np.any(np.abs(one) < 2.0 * reach)) for one in offsets)
    agreed = set(np.array(owners)[agrees].tolist())
    deviation = 1.2533 * float(np.std(nearest[agrees])) / np.sqrt(max(count, 1))
    sure = count >= max(ENOUGH, PART * looks) and abs(angle) > max(error, 5.0 * deviation, step)
    if not sure or (abs(angle) > 4.0 * reach and count < MORE * around):
        return None
    rivals = rivals_of(Looks.of(seen), angle) if seen else ()
    return None if rivals is None else Turned(name, angle, deviation, len(agreed), by, polar, reports, rivals)


def _beside(placed: Sensor, x: Array, z: Array) -> tuple[Array, Array]:
    """Return how far returns (k, m) lie from a target in range and bearing (k, 2), and the standard deviations (2,)."""
    names = placed.measurement.names
    some = [names.index("range"), names.index("bearing")]
    sigma = np.sqrt(np.diagonal(np.broadcast_to(placed.noise(x), (len(names), len(names)))))
    d = placed.measurement.difference(z, placed.measure(x)) if len(z) else np.zeros((0, len(names)))
    return d[:, some], sigma[some]


def _beside_in_plane(placed: Sensor, x: Array, z: Array) -> tuple[Array, Array]:
    """Return the same of returns in x and y, as seen from where the sensor stands."""
    pose = stands(placed)
    assert pose is not None
    station = pose.position[..., :2]
    names = placed.measurement.names
    some = [names.index("x"), names.index("y")]
    seen, at = z[:, some] - station, placed.measure(x)[some] - station
    far = float(np.hypot(*at)) + 1e-9
    along = at / far
    R = np.broadcast_to(placed.noise(x), (len(names), len(names)))[np.ix_(some, some)]
    across = np.array([-along[1], along[0]])
    turn = np.arctan2(seen @ across, seen @ along)
    sigma = np.sqrt([along @ R @ along, across @ R @ across / far**2])
    return np.stack([np.hypot(*seen.T) - far, turn], axis=-1), sigma


def _place(times: Array, places: Array, time: float) -> tuple[Array, Array] | None:
    """Return where a target is and how fast, between two times that are near to each other; None where that is not known."""
    i = int(np.searchsorted(times, time))
    if i == 0 or i == len(times) or times[i] - times[i - 1] > LONGEST:
        return None
    velocity = (places[i] - places[i - 1]) / max(times[i] - times[i - 1], 1e-12)
    return places[i - 1] + (time - times[i - 1]) * velocity, velocity
