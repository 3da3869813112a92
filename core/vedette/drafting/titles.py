"""What the titles of a table's columns mean: the axis, the unit, and whether they are of the sensors' own platform."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from attrs import frozen

UNITS = {
    **dict.fromkeys(("m", "metre", "metres", "meter", "meters"), "m"),
    **dict.fromkeys(("km", "kilometres", "kilometers"), "km"),
    **dict.fromkeys(("nm", "nmi"), "NM"),
    **dict.fromkeys(("ft", "feet"), "ft"),
    **dict.fromkeys(("deg", "degs", "degree", "degrees", "°"), "deg"),
    **dict.fromkeys(("rad", "rads", "radian", "radians"), "rad"),
    "mrad": "mrad",
    **dict.fromkeys(("s", "sec", "secs", "seconds"), "s"),
    **dict.fromkeys(("ms", "msec", "millis", "milliseconds"), "ms"),
    **dict.fromkeys(("us", "usec", "microseconds"), "us"),
    **dict.fromkeys(("ns", "nsec", "nanoseconds"), "ns"),
    **dict.fromkeys(("kn", "kt", "kts", "knot", "knots"), "kn"),
    **dict.fromkeys(("mps", "m/s"), "m/s"),
    **dict.fromkeys(("kmh", "kph", "km/h"), "km/h"),
}
"""Units as titles write them."""

OWN = ("own", "ownship", "own_ship", "platform", "ego", "ship", "vessel", "os", "self", "carrier", "boat")
"""Words that say a column is of the sensors' own platform."""

AXES: dict[str, tuple[str, ...]] = {
    "time": ("time", "timestamp", "t", "utc", "datetime", "date", "ts", "epoch", "stamp", "when", "clock"),
    "scan": ("scan", "sweep", "rotation", "turn", "frame"),
    "sensor": ("sensor", "source", "device", "station"),
    "range_rate": ("range_rate", "doppler", "radial_velocity", "radial_speed", "rr"),
    "range": ("range", "rng", "distance", "dist", "r", "rho"),
    "bearing": ("bearing", "brg", "azimuth", "az", "azi", "theta", "angle"),
    "elevation": ("elevation", "elev", "el"),
    "latitude": ("latitude", "lat"),
    "longitude": ("longitude", "lon", "lng", "long"),
    "altitude": ("altitude", "alt"),
    "heading": ("heading", "hdg", "yaw"),
    "course": ("course", "cog"),
    "vnorth": ("vnorth", "vn", "v_north", "v_n", "velocity_north", "north_velocity", "speed_north", "north_speed"),
    "veast": ("veast", "ve", "v_east", "v_e", "velocity_east", "east_velocity", "speed_east", "east_speed"),
    "vx": ("vx", "v_x", "velocity_x", "speed_x"),
    "vy": ("vy", "v_y", "velocity_y", "speed_y"),
    "speed": ("speed", "sog", "velocity"),
    "east": ("east", "easting", "e"),
    "north": ("north", "northing", "n"),
    "x": ("x",),
    "y": ("y",),
    "z": ("z", "up", "height"),
}
"""The words for each axis, the surest first."""


@frozen
class Meaning:
    """What a title means: an axis ("" if none is known), a unit ("" if it states none), of the own platform or not."""

    title: str
    axis: str
    unit: str
    own: bool
    sure: bool


def meaning(title: str) -> Meaning:
    """Return what a title means.

    >>> meaning("own_lat [deg]")
    Meaning(title='own_lat [deg]', axis='latitude', unit='deg', own=True, sure=True)
    >>> meaning("SlantRangeMetres").axis, meaning("SlantRangeMetres").unit
    ('range', 'm')
    """
    unit = ""
    if bracket := re.search(r"[\[(]\s*([^\])]+?)\s*[\])]", title):
        unit = UNITS.get(bracket[1].lower(), "")
        plain = title.replace(bracket[0], " ")
    else:
        plain = title
    words = [word.lower() for word in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|°", plain)]
    if not unit and len(words) > 1 and words[-1] in UNITS:
        unit = UNITS[words.pop()]
    own = any(word in OWN for word in words)
    words = [word for word in words if word not in OWN] or words
    whole = "_".join(words)
    for axis, names in AXES.items():
        if whole in names:
            return Meaning(title, axis, unit, own, True)
    for axis, names in AXES.items():
        if any(re.search(rf"(^|_){name}(_|$)", whole) for name in names if len(name) > 2):
            return Meaning(title, axis, unit, own, False)
    return Meaning(title, "", unit, own, False)


def chosen(titles: Sequence[str]) -> tuple[dict[str, Meaning], dict[str, Meaning]]:
    """Return the columns by axis: what the sensors measure, and what the own platform does. A sure title goes first.

    A heading is always the platform's. Positions that all say they are of a ship are what is measured, if nothing else is.
    """
    measured: dict[str, Meaning] = {}
    platform: dict[str, Meaning] = {}
    found = [meaning(title) for title in titles]
    positions = {each.axis for each in found if not each.own} & {"range", "latitude", "x", "east"}
    for each in sorted(found, key=lambda each: not each.sure):
        if each.axis:
            own = each.axis == "heading" or (each.own and bool(positions) and each.axis not in ("time", "scan", "sensor"))
            (platform if own else measured).setdefault(each.axis, each)
    return measured, platform


def is_number(cell: str) -> bool:
    """Return whether a cell holds a finite number."""
    try:
        return math.isfinite(float(cell))
    except ValueError:
        return False
