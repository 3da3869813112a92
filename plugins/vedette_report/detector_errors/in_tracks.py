"""What the returns that tracks took say of a sensor's errors: how they go on, how they grow, how heavy their tails are."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import groupby

import numpy as np
from attrs import frozen

from vedette import Array, Gaussian, ImagingSensor, Scan, Sensor, Track, Tracker, WrappedSensor
from vedette.tracking import State
from vedette_report.detector_errors.in_time import Compared, Path, compared
from vedette_report.detector_errors.shape import Measured, Shape, shape_of
from vedette_report.known import known

MOST = 5000
"""Of a run so many scans are looked at, at most."""
SURELY = 0.5
"""A return is a track's if it was more probably than not."""


@frozen
class Told:
    """What the returns that tracks took say of the errors of a sensor along a measured axis, in its unit."""

    sensor: str
    axis: str
    unit: str
    compared: Compared
    extent: str = ""
    shape: Shape | None = None

    @property
    def text(self) -> str:
        """In words, a line each: how they go on, and where it stands out how they grow and how heavy their tails are."""
        shape = self.shape.told(self.sensor, self.axis, self.extent) if self.shape else ()
        return "\n".join((self.compared.told(self.sensor, self.axis, self.unit), *shape))

    def data(self) -> dict[str, object]:
        """Return the figures as plain data."""
        white, correlated = self.compared.white, self.compared.correlated
        return {
            "sensor": self.sensor, "axis": self.axis, "unit": self.unit, "correlated": self.compared.wins,
            "gain": self.compared.gain, "gain_error": self.compared.error, "white_deviation": white.deviation,
            "deviation": correlated.deviation, "deviation_error": correlated.deviation_error * correlated.deviation,
            "correlation_time": correlated.tau, "correlation_time_error": correlated.tau_error * correlated.tau,
            "extent": self.extent, "shape": self.shape.data() if self.shape else None,
        }  # fmt: skip


NIS_IS_NOT_ENOUGH = (
    "a NIS near 1 does not show that R is right: a filter takes errors that go on from scan to scan for motion"
)


def first_of(scans: Sequence[Scan]) -> Sequence[Scan]:
    """Return the first `MOST` scans or fewer, none of a time of which others are left out."""
    end = min(MOST, len(scans))
    while 0 < end < len(scans) and scans[end - 1].time == scans[end].time:
        end -= 1
    return scans[:end]


def scans_at(scans: Iterable[Scan]) -> Mapping[float, Sequence[int]]:
    """Return which scans there are of each time, in their order."""
    found: dict[float, list[int]] = {}
    for i, scan in enumerate(scans):
        found.setdefault(scan.time, []).append(i)
    return found


def rows_of(track: Track, at: Mapping[float, Sequence[int]]) -> Iterator[tuple[int, int]]:
    """Yield each row of a track that lived longer than one time, and its scan; at: as `scans_at`.

    It may begin with the second of two scans of one time, and end with the first.
    """
    for time, group in groupby(range(len(track.times)), lambda row: float(track.times[row])):
        rows, scans = list(group), at.get(time, ())
        if len(rows) < len(track.times):
            yield from zip(rows, scans[-len(rows) :] if rows[0] == 0 else scans, strict=False)


def taken(track: Track, at: Mapping[float, Sequence[int]]) -> Iterator[tuple[int, int, int]]:
    """Yield what a track took, in the order of time: its row, the scan, and the number of the return; at: as `scans_at`."""
    for row, scan in rows_of(track, at):
        if track.hit[row] > SURELY:
            listed = None if track.returns is None else track.returns[row]
            column = int(np.argmax(track.weights[row][1:]))
            yield row, scan, column if listed is None else int(listed[column])


def returned(scan: Scan, column: int) -> tuple[float, Array]:
    """Return the time of one of a scan's returns, its own if it bears one, and its z (m,), NaN of what it lacks."""
    own = scan.detections.time
    return scan.time if own is None else float(own[column]), known(scan.detections)[column]


def placed_in_plane(sensor: Sensor, scan: Scan) -> Gaussian | None:
    """Return where a scan's returns lie in the plane; None if they do not tell."""
    seen = scan.detections
    if scan.frame is not None or seen.missing is not None or not {"x", "y"} <= set(sensor.observes.names):
        return None
    try:
        found = sensor.placed(scan.pose).invert(seen.z, seen.noise)
    except (NotImplementedError, ValueError):
        return None
    where = [sensor.observes.names.index(axis) for axis in "xy"]
    return Gaussian(found.mean[:, where], found.cov[:, where][:, :, where])


def in_tracks(tracker: Tracker, scans: Iterable[Scan], states: Iterable[State]) -> tuple[Told, ...]:
    """Return what the returns that confirmed tracks took say, of each sensor and each place or direction that it measures.

    states: after each of the scans. A sensor whose errors are part of the state, and one whose returns bear times of their
    own, is not asked. A place along any axis is followed as if it kept its velocity, also a range or a bearing.
    """
    taken: dict[tuple[str, int], tuple[list[float], list[Array]]] = {}
    asked = {name: measured_axes(sensor) for name, sensor in tracker.sensors.items()}
    for scan, state in zip(scans, states, strict=True):
        if not asked[scan.sensor] or scan.frame is not None or scan.detections.time is not None:
            continue
        rows, columns = np.nonzero(np.where(state.confirmed[:, None], state.weights[:, 1:], 0.0) > SURELY)
        returns = columns if state.returns is None else state.returns[rows, columns]
        for track, z in zip(state.ids[rows].tolist(), known(scan.detections)[returns], strict=True):
            times, values = taken.setdefault((scan.sensor, track), ([], []))
            times.append(scan.time)
            values.append(z)
    comparisons: list[Told | None] = []
    for name, axes in asked.items():
        given = [(np.array(times), np.array(values)) for (of, _), (times, values) in taken.items() if of == name]
        sensor = tracker.sensors[name]
        if one := _stated_once(sensor, axes):
            axes, alike = (
                [i for i in axes if i not in one],
                compared([path for i in one for path in _along(sensor, i, given)]),
            )
            comparisons += [_told_along(name, sensor, i, given, alike) for i in one]
        comparisons += [_told_along(name, sensor, i, given, compared(_along(sensor, i, given))) for i in axes]
    return tuple(told for told in comparisons if told is not None)


def _stated_once(sensor: Sensor, axes: Sequence[int]) -> list[int]:
    """Return the axes of a plane whose errors a sensor states by one number: they are told together, for either may be by
    chance as motion makes it.
    """
    pair = [i for i in axes if sensor.measurement.names[i] in ("x", "y")]
    R = np.diagonal(sensor.noise(np.zeros(len(sensor.observes))))[pair] if len(pair) > 1 and hasattr(sensor, "sigma") else ()
    return pair if len(R) and np.ptp(R) == 0 else []


def _along(sensor: Sensor, i: int, taken: Sequence[tuple[Array, Array]]) -> list[Path]:
    """Return paths along one axis of returns of tracks: times (s,) and returns (s, m) of each."""
    period, paths = sensor.measurement.axes[i].period, []
    for times, z in taken:
        good = np.isfinite(z[:, i])
        paths.append(Path(times[good], z[good, i] if period is None else np.unwrap(z[good, i], period=period)))
    return paths


def _told_along(
    name: str, sensor: Sensor, i: int, taken: Sequence[tuple[Array, Array]], told: Compared | None
) -> Told | None:
    """Return what a comparison, and the shape of errors, say along one axis; None without a comparison."""
    if told is None:
        return None
    axis, paths = sensor.measurement.axes[i], _along(sensor, i, taken)
    extents = [_extent(sensor, z[np.isfinite(z[:, i])]) for _, z in taken]
    measured = [Measured(path.times, path.values, extent) for path, (_, extent) in zip(paths, extents, strict=True)]
    return Told(name, axis.name, axis.unit, told, extents[0][0], shape_of(measured))


def _extent(sensor: Sensor, z: Array) -> tuple[str, Array]:
    """Return how far or how large what was returned is (s,), and how that is called."""
    names = sensor.measurement.names
    if "range" in names:
        return "range", z[:, names.index("range")]
    for title, pair, joined in (
        ("size", ("width", "height"), lambda a, b: np.sqrt(np.maximum(a * b, 0.0))),
        ("distance from the origin", ("x", "y"), np.hypot),
    ):
        if set(pair) <= set(names) and (title == "size" or sensor.measurement.axes[names.index("x")].unit == "m"):
            return title, joined(*(z[:, names.index(axis)] for axis in pair))
    return "", np.full(len(z), np.nan)


def measured_axes(sensor: Sensor) -> list[int]:
    """Return which measured axes are places or directions, without an error that the state has, too."""
    if isinstance(sensor, ImagingSensor) or _has_own_states(sensor):
        return []
    return [i for i, axis in enumerate(sensor.measurement.axes) if axis.unit in ("m", "px", "rad")]


def _has_own_states(sensor: Sensor) -> bool:
    """Return whether a wrapper adds axes to the state, as that of biases does."""
    if not isinstance(sensor, WrappedSensor):
        return False
    return not set(sensor.observes.names) <= set(sensor.of.observes.names) or _has_own_states(sensor.of)
