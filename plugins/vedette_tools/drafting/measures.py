"""The units of columns and of times, as titles state them or values show them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from attrs import evolve

from vedette.space import Array
from vedette_files.tables.numbers import is_number
from vedette_tools.drafting.compass import of_asterix
from vedette_tools.drafting.several import GEODETIC
from vedette_tools.drafting.titles import GRAD, OF_360, Meaning, meaning, words_of

MANY = 20
"""So many times of which none ends in 60 to 99 are times of day without their colons; so many that are equal are none."""

DAYS = ((2e4, 8e4), (7.1e5, 7.7e5), (2.43e6, 2.49e6))
"""Days of 1945 to 2106 as spreadsheets count them or modified Julian dates, as MATLAB does, and Julian dates."""

SECONDS = (6e8, 4.2e9)
"""Seconds since 1970, of 1989 to 2103: ms since a recorder was switched on are hardly as many."""

MICROS = 1e5
"""Whole numbers so far apart are us: a clock of ms that ticks every 100 s counts s. By hand."""

CEILING = 20_000.0
"""m: hardly anything that is tracked flies higher, and much does in ft."""

SPACE = 100_000.0
"""What flies higher is in space, whatever it is told in."""

SURFACE = (6.3e6, 6.42e6)
"""m: so far from the middle of the earth is its surface, and what flies in the air."""

CODED = 25.0
"""ft: transponders tell altitudes in such steps."""

FAR_OFF = 50.0
"""So many times as far from 0 as they spread lie longitudes or latitudes; returns of a radar lie around it or before it."""

AROUND = 10_800.0
"""NM: nothing on the earth is farther than halfway around it."""

SEVERAL = 5
"""So many altitudes that are whole steps are so by no chance: of whole numbers one in ten million."""

GON = "0.9 deg"
ANGLES, SPEEDS = ("bearing", "elevation", "heading", "course"), ("range_rate", "vx", "vy", "speed")


def add_unit(
    place: str, axis: str, given: Meaning, columns: Mapping[str, list[str]], units: dict[str, str], guessed: dict[str, str]
) -> None:
    """Add a column's unit unless it is the usual one, and what says that it had to be guessed."""
    if given.unit == GRAD:
        unit, told = _of_grad(numbers(columns[given.title]), columns)
        given, guessed[given.title] = evolve(given, unit=unit), f"is in {'gon' if unit == GON else unit}: {told}"
    if given.unit == "NM" and axis in ("x", "y", "z"):
        largest = float(np.max(np.abs(numbers(columns[given.title])), initial=0.0))
        given = evolve(given, unit="1e-9 m") if largest > AROUND else given
        told = f"nanometres: it goes up to {largest:,.0f}" if largest > AROUND else "nautical miles, not nanometres"
        guessed[given.title] = f"is in {told}"
    if axis in GEODETIC:
        if given.unit not in ("", "deg"):
            units[place] = given.unit
        return
    usual = "rad" if axis in ANGLES else "m/s" if axis in SPEEDS else "m"
    unit = given.unit
    if not unit and axis == "elevation":  # those in deg may all be below 2 pi
        unit = units.get("bearing", "rad")
        guessed[given.title] = f"is in {unit}, as bearings are{_unknown(given)}"
    elif not unit and axis in ANGLES:
        angles = numbers(columns[given.title])
        largest, least = float(np.max(np.abs(angles), initial=0.0)), float(np.min(angles, initial=0.0))
        most = 1.0001 * math.pi if axis == "bearing" and least < 0 else 2.0001 * math.pi  # a heading may be unwrapped
        unit = "deg" if largest > most else "rad"
        told = f" to either side of 0, beyond {math.pi:.3f}" if most < largest < 2 * math.pi else ""
        guessed[given.title] = f"is in {unit}: it goes up to {largest:.4g}{told}{_unknown(given)}"
    elif not unit and axis == "range" and of_asterix(columns):
        unit = "NM"
        guessed[given.title] = "is in NM, as ASTERIX sends it"
    elif not unit and axis == "altitude" and any(_in_whole_parts(title, cells) for title, cells in columns.items()):
        unit = "0.001 m"
        guessed[given.title] = "is in mm, as beside latitudes in whole parts of a degree"
    elif not unit and axis == "altitude" and (told := _in_feet(numbers(columns[given.title]))):
        unit = "ft"
        guessed[given.title] = f"is in ft: {told}{_unknown(given)}"
    elif not unit:
        guessed[given.title] = f"is in {usual}{_unknown(given)}"
    if unit and unit != usual:
        units[place] = unit


def _of_grad(angles: Array, titles: Iterable[str]) -> tuple[str, str]:
    """Return the unit of angles of which a title says that they are in Grad, and why."""
    first = -180.0 if np.any(angles < 0) else 0.0
    least, most = float(np.min(angles, initial=0.0)), float(np.max(angles, initial=0.0))
    if first - 20 <= least < first or first + 360 < most <= first + 400:
        return GON, f"they go from {least:.4g} to {most:.4g}"
    words = {word for title in titles for word in words_of(title)}
    if german := sorted(words & OF_360):
        return "deg", f"Grad is a degree beside {german[0]!r}"
    apart = float(np.max(np.diff([first, *np.sort(angles), first + 360])))
    if apart < 40:  # in gon, none would lie in as much of the circle, and there alone
        return "deg", f"they lie all around from {first:.0f} to {first + 360:.0f}, and nowhere beyond"
    if any(meaning(word).axis for word in words if len(word) > 3):
        return GON, "400 of them are a circle beside titles in English or French"
    return "deg", "no title tells the language, and nothing is beyond 360"


def _in_whole_parts(title: str, cells: Sequence[str]) -> bool:
    """Return whether a column is of latitudes as whole numbers, beyond those of degrees."""
    if meaning(title).axis != "latitude":
        return False
    parts = numbers(cells)
    return bool(len(parts)) and bool(np.all(parts == np.rint(parts))) and float(np.median(np.abs(parts))) > 90


def _in_feet(altitudes: Array) -> str:
    """Return why altitudes are in ft, or ""."""
    if CEILING < (most := float(np.max(altitudes, initial=0.0))) < SPACE:
        return f"it goes up to {most:,.0f}"
    coded = len(np.unique(altitudes)) >= SEVERAL and not np.any(altitudes % CODED)
    return f"its numbers are {CODED:.0f} apart, as a transponder tells altitudes" if coded else ""


def unknown_unit(axis: str, given: Meaning) -> str:
    """Say that a title states a unit of a length or a speed that is not known, and what to type; or return ""."""
    if not given.unknown or given.unit:
        return ""
    unit = "kn" if axis in SPEEDS else "NM"
    return f"{given.title!r} may be in a unit that is not known, {given.unknown!r}; say which: --units {axis}={unit}"


def _unknown(given: Meaning) -> str:
    return f", for {given.unknown!r} is no unit that is known" if given.unknown else ""


def time_unit(time: Meaning, values: Array, assumed: list[str], cells: Iterable[str] = ()) -> str:
    """Return the unit of times unless it is s or they are dates; `cells` are as they were written: 300.00 counts nothing."""
    if not len(values):
        return ""
    if time.unit:
        return "" if time.unit == "s" else time.unit
    size = float(np.median(np.abs(values)))
    for least, unit in ((1e17, "ns"), (1e14, "us"), (1e11, "ms")):
        if size > least:
            assumed.append(f"{time.title} counts {unit} since 1970")
            return unit
    apart = np.diff(np.unique(values))
    if any(least < size < most for least, most in DAYS) and len(apart) and float(np.median(apart)) < 1e-3:
        assumed.append(f"{time.title} counts days")
        return "86400 s"
    in_seconds = SECONDS[0] < size < SECONDS[1] or bool(np.all(apart % 3600 == 0))  # hourly reports
    in_seconds = in_seconds or any(len(cell.partition(".")[2]) > 1 for cell in cells)
    if not in_seconds and np.all(values == np.rint(values)) and len(apart) and (step := float(np.median(apart))) >= 100:
        unit = "ms" if step < MICROS else "us"
        assumed.append(f"{time.title} counts {unit}: whole numbers {step:.0f} apart; if not, say --units time=s")
        return unit
    assumed.append(f"{time.title} is in s{_unknown(time)}")
    return ""


def joined(times: Array) -> str:
    """Say what to do with numbers that are times of day without their colons, or return ""."""
    if not len(times):
        return ""
    seconds, minutes, hours = times % 100, times // 100 % 100, times // 10_000
    looks = np.all((times >= 0) & (seconds < 60) & (minutes < 60) & (hours < 24))
    if looks and len(np.unique(times)) >= MANY and len(np.unique(seconds)) > 5 and np.ptp(minutes + 60 * hours) > 0:
        return "must be times of day as 08:39:04, for no number ends in 60 to 99"
    return ""


def in_degrees(x: Sequence[str], y: Sequence[str], *, sent: bool = False) -> bool:
    """Return whether positions of unstated unit are longitudes and latitudes.

    They are in range, but not all within 1, have the digits for a metre, and lie far from the origin for what they cover,
    unless objects `sent` them with their codes. What is the same in all rows are none.
    """
    there = [[cell for cell in cells if cell] for cells in (x, y)]
    if min(sum(len(cell.partition(".")[2]) >= 5 for cell in cells) / max(len(cells), 1) for cells in there) < 0.5:
        return False
    longitude, latitude = numbers(x), numbers(y)
    largest = [float(np.max(np.abs(each), initial=0.0)) for each in (longitude, latitude)]
    if largest[0] > 180 or largest[1] > 90 or max(largest) <= 1:
        return False
    return sent or any(
        abs(np.median(each)) > FAR_OFF * np.ptp(np.percentile(each, (5, 95))) > 0 for each in (longitude, latitude)
    )


def from_the_middle(x: Sequence[str], y: Sequence[str], z: Sequence[str]) -> bool:
    """Return whether positions in m or km, of numbers alone, lie on the earth or close above it, as seen from its middle."""
    places = np.array([[*map(float, row)] for row in zip(x, y, z, strict=True) if all(map(is_number, row))])
    high = np.linalg.norm(places, axis=-1) if len(places) else np.zeros(1)
    return any(bool(np.all((SURFACE[0] < scale * high) & (scale * high < SURFACE[1]))) for scale in (1.0, 1000.0))


def numbers(cells: Sequence[str]) -> Array:
    return np.array([float(cell) for cell in cells if is_number(cell)])
