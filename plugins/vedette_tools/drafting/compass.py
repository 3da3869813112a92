"""Whence bearings run: from the north by their title or by what stands beside them, else it is said what is assumed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from vedette_files import NORTH_EAST
from vedette_files.readers import FRAMES
from vedette_tools.drafting.naming import by_words
from vedette_tools.drafting.several import GEODETIC, POLAR
from vedette_tools.drafting.titles import ANSWERED, Meaning

COMPASS = ("bearing", "brg", "azimuth", "az", "azi", "peilung", "azimut", "acimut", "gisement", "marcacion", "peiling")
"""Words of titles of angles that run clockwise from north."""

ASTERIX = {"sac", "sic"}
"""Last words of titles of radar plots that are decoded from ASTERIX."""


def of_asterix(titles: Iterable[str]) -> bool:
    """Return whether titles are of radar plots that are decoded from ASTERIX."""
    return {words.rpartition("_")[2] for words in by_words(titles)} >= ASTERIX


def from_north(axes: tuple[str, str], measured: Mapping[str, Meaning], titles: Iterable[str]) -> tuple[bool, list[str]]:
    """Return whether x is north and what bears a compass runs clockwise, and what is assumed of that.

    Those who measure in NM, or ask transponders, count from the north whatever they call the angle.
    """
    if axes != POLAR:
        return axes == GEODETIC, []
    title, titles = measured["bearing"].title, [*titles]
    if any(word in title.lower() for word in COMPASS):
        return True, []
    answered = next((each for words, each in by_words(titles).items() if words.endswith(ANSWERED)), "")
    why = f"{measured['range'].title} in NM" if measured["range"].unit == "NM" else "plots of ASTERIX" * of_asterix(titles)
    why = why or answered
    ways = ("clockwise from north", NORTH_EAST), ("counterclockwise from east", FRAMES[0])
    (way, _), (other, frame) = ways if why else ways[::-1]
    beside = f", as beside {why}" if why else ""
    return bool(why), [f"{title} runs {way}{beside}; if it runs {other}, write frame = '{frame}'"]
