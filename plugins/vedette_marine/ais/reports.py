"""AIS reports: what a ship reports of itself, in SI units and in the local frame's directions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from attrs import frozen

from vedette import Array, Mask, Problem
from vedette_files import Origin
from vedette_files.libraries import needed

KNOT = 1852.0 / 3600.0
"""m/s"""

ROT_STEP = 4.733
"""AIS sends a rate of turn as 4.733 sqrt(deg/min), with the sign of the turn, starboard positive."""

FASTEST = 60.0 * KNOT
"""Speed in m/s: a position that can only be reached and left faster than this is an outlier."""

POSITION_STEP = 50.0
"""Distance in m that two reports may always be apart, whatever their times: time stamps are in whole seconds, GNSS errs."""


@frozen(eq=False)
class Reports:
    """Reports (s,) of one ship, in order of time; NaN means "not available".

    time in s, latitude and longitude in deg, speed over ground in m/s, course over ground and heading in rad clockwise from
    north, turn: the turn rate in rad/s, counter-clockwise like the filters' (w = -ROT).
    """

    mmsi: int
    time: Array
    latitude: Array
    longitude: Array
    speed: Array
    course: Array
    heading: Array
    turn: Array

    def where(self, chosen: Mask) -> Reports:
        """Return the chosen reports."""
        columns = (self.time, self.latitude, self.longitude, self.speed, self.course, self.heading, self.turn)
        return Reports(self.mmsi, *(column[chosen] for column in columns))

    @property
    def velocity(self) -> Array:
        """East and north (s, 2) in m/s: speed times (sin, cos) of the course, which runs clockwise from north.

        A ship at rest has no course, and velocity 0; any other without course or speed has NaN.
        """
        return velocity(self.speed, self.course)


def velocity(speed: Array, course: Array) -> Array:
    """Return east and north (*b, 2) in m/s of speed (*b) in m/s and course (*b) in rad clockwise from north."""
    still = speed < 0.05
    angle = np.where(still & np.isnan(course), 0.0, course)
    return speed[..., None] * np.stack([np.sin(angle), np.cos(angle)], axis=-1)


def turn_rate(rot: Array) -> Array:
    """Convert the rate of turn (*b) as sent to rad/s, counter-clockwise; +-127: "over 5 deg / 30 s", -128: "not available".

    deg/min = (ROT / 4.733)^2 with the sign of ROT; w = -that, as AIS counts to starboard.
    """
    known = np.abs(rot) <= 126
    rate = np.sign(rot) * (rot / ROT_STEP) ** 2
    return np.where(known, -np.deg2rad(rate) / 60.0, np.nan) + 0.0


def rate_of_turn(turn: Array) -> Array:
    """Convert turns (*b) in deg/min to starboard to the rate of turn as sent, which is 126 at most."""
    return np.clip(np.round(ROT_STEP * np.sign(turn) * np.sqrt(np.abs(turn))), -126, 126)


def east_north(latitude: Array, longitude: Array, origin: tuple[float, float]) -> Array:
    """Return east and north (s, 2) in m of the local tangent plane at `origin`, latitude and longitude in deg, on WGS 84."""
    geodetic2enu = needed("pymap3d", "latitudes and longitudes need pymap3d", "marine").geodetic2enu
    east, north, _ = geodetic2enu(latitude, longitude, 0.0, origin[0], origin[1], 0.0)
    return np.stack([np.asarray(east, dtype=float), np.asarray(north, dtype=float)], axis=-1)


def outliers(place: Array, time: Array) -> Mask:
    """Find the positions (s, 2) at `time` (s,) where no ship can have been: those outside the longest chain of positions
    that are within reach of one another, at 60 knots and 50 m apart. A single outlier is found whatever follows it.
    """
    s = len(time)
    best, before = np.ones(s, dtype=int), np.full(s, -1)
    for i in range(1, s):
        low = max(0, i - 64)
        apart = np.linalg.norm(place[i] - place[low:i], axis=-1)
        fine = apart <= FASTEST * (time[i] - time[low:i]) + POSITION_STEP
        if fine.any():
            lengths = np.where(fine, best[low:i], 0)
            j = len(lengths) - 1 - int(np.argmax(lengths[::-1]))
            best[i], before[i] = lengths[j] + 1, low + j
    kept = np.zeros(s, dtype=bool)
    i = s - 1 - int(np.argmax(best[::-1])) if s else -1
    while i >= 0:
        kept[i] = True
        i = int(before[i])
    return ~kept


def without_outliers(reports: Reports, origin: tuple[float, float], place: str) -> tuple[Reports, list[Problem]]:
    """Return the reports of one ship without those too far for a plane and position outliers, and a problem for each."""
    around = Origin(*origin)
    near = around.reaches(reports.latitude, reports.longitude)
    far = [
        Problem(
            f"{place}, MMSI {reports.mmsi}, time {reports.time[i]:.3f} s",
            f"the position {reports.latitude[i]:.6f}, {reports.longitude[i]:.6f} lies too far from the origin {around}",
        )
        for i in np.flatnonzero(~near)
    ]
    reports = reports.where(near)
    bad = outliers(east_north(reports.latitude, reports.longitude, origin), reports.time)
    told = [
        Problem(
            f"{place}, MMSI {reports.mmsi}, time {reports.time[i]:.3f} s",
            f"the position {reports.latitude[i]:.6f}, {reports.longitude[i]:.6f} cannot be reached from its neighbours",
        )
        for i in np.flatnonzero(bad)
    ]
    return reports.where(~bad), [*far, *told]


def by_ship(rows: Sequence[Mapping[str, float]]) -> dict[int, Reports]:
    """Return the reports of each ship in order of time; rows hold mmsi, time and the columns of `Reports`."""
    names = ("time", "latitude", "longitude", "speed", "course", "heading", "turn")
    ships: dict[int, list[Mapping[str, float]]] = {}
    for row in rows:
        ships.setdefault(int(row["mmsi"]), []).append(row)
    reports = {}
    for mmsi, own in ships.items():
        columns = np.array([[row[name] for name in names] for row in own], dtype=float)
        columns = columns[np.argsort(columns[:, 0], kind="stable")]
        reports[mmsi] = Reports(mmsi, *columns.T)
    return reports
