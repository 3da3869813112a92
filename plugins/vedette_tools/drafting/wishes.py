"""What a user states of a table, so that it need not be guessed: `vedette new config --time frame --rate 30`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path

from attrs import evolve, field, frozen

from vedette.errors import ConfigError, InputError, Problem
from vedette.units import in_unit
from vedette_files.tables.composed import made_of
from vedette_files.tables.rows import BY_ROW, listed
from vedette_files.tables.times import check_pattern
from vedette_tools.drafting.titles import GRAD, MEASURES, UNITS, Meaning, meaning

POSITIONS = (("range", "bearing"), ("latitude", "longitude"), ("x", "y"), ("east", "north"))
"""Pairs of axes of which one tells where returns are."""

OTHERS = ("z", "altitude", "elevation", "range_rate")
"""What may be measured beside a position."""

PIXELS = "px"
"""The unit of positions in images, where y goes down."""


@frozen
class Wishes:
    """What is stated: the column of the time, its counts a second, columns and units by axis, how dates are written, what a
    scan is, and the file of the own platform.
    """

    time: str = ""
    rate: float = 0.0
    columns: Mapping[str, str] = field(factory=dict)
    units: Mapping[str, str] = field(factory=dict)
    dates: str = ""
    scan: str = ""
    platform: Path | None = None

    @classmethod
    def of(
        cls, time: str | None, rate: str | None, columns: str | None, units: str | None, dates: str | None,
        scan: str | None, platform: str | None,
    ) -> Wishes:  # fmt: skip
        """Read the options of the command line; ConfigError for one that cannot be read."""
        problems: list[Problem] = []
        named = _pairs("--units", units, problems)
        stated = {axis: UNITS.get(MEASURES.get(axis, ""), {}).get(unit, unit) for axis, unit in named.items()}
        wishes = cls(
            time or "", _rate(rate, problems), _pairs("--columns", columns, problems), stated,
            dates or "", scan or "", Path(platform) if platform else None,
        )  # fmt: skip
        known = {axis for pair in POSITIONS for axis in pair} | {*OTHERS}
        for option, given, axes in (("--columns", wishes.columns, known), ("--units", wishes.units, known | {"time"})):
            problems += [
                Problem(option, f"{axis!r} is no axis; those are {', '.join(sorted(axes))}")
                for axis in given
                if axis not in axes
            ]
        for axis, unit in wishes.units.items():
            if unit == GRAD:
                problems.append(Problem("--units", f"{axis}: {named[axis]!r} may be a degree or a gon: say deg or gon"))
            elif axis in MEASURES and unit != PIXELS:
                try:
                    factor = in_unit(unit if unit[:1].isdigit() else f"1 {unit}", MEASURES[axis])
                    if not 0 < factor < float("inf"):
                        raise ValueError(f"must be a unit, or a multiple of one above 0, got {unit!r}")
                except ValueError as error:
                    text = str(error).replace(repr(f"1 {unit}"), repr(unit))
                    problems.append(Problem("--units", f"{axis}: {text}"))
        problems += [
            Problem("--columns", f"{axis} and {other} are both {title!r}: each is in a column of its own")
            for (axis, title), (other, same) in pairwise(sorted(wishes.columns.items(), key=lambda pair: pair[1]))
            if title == same
        ]
        if wishes.dates:
            try:
                check_pattern(wishes.dates)
            except ValueError as error:
                problems.append(Problem("--dates", str(error).removeprefix("dates: ")))
        if wishes.rate and "time" in wishes.units:
            problems.append(Problem("--rate", "goes without a unit of the time: it says what a count is"))
        if problems:
            raise ConfigError(problems)
        return wishes

    def measured(
        self, path: object, titles: Sequence[str], meanings: Mapping[str, Meaning], below: Sequence[str] = ()
    ) -> dict[str, Meaning]:
        """Return the columns by axis, as found by their titles or stated; InputError for a stated one that is not there.

        below: the row of units, or nothing.
        """
        stated = {**self.columns, **({"time": self.time} if self.time else {})}
        if self.scan not in ("", "time", BY_ROW):
            stated["scan"] = self.scan
        for axis, title in stated.items():
            if not made_of(title, titles):
                other = "; or say --scan time, where rows of one time are a scan, or --scan row" if axis == "scan" else ""
                there = f"the columns are {listed(titles)}{other}"
                raise InputError(f"{path}: there is no column {title!r}, asked for as {axis}; {there}")
        for pair in POSITIONS:
            lone = [axis for axis in pair if axis in self.columns]
            if len(lone) == 1 and not any(set(other) <= set(self.columns) for other in POSITIONS):
                lacking = next(axis for axis in pair if axis not in lone)
                typed = f"--columns {lone[0]}={self.columns[lone[0]]},{lacking}=COLUMN"
                raise InputError(f"{path}: {lone[0]} alone is no position; say {typed}, of {listed(titles)}")
        kept = dict(meanings)
        if any(axis in pair for pair in POSITIONS for axis in self.columns):
            kept = {axis: each for axis, each in meanings.items() if not any(axis in pair for pair in POSITIONS)}
        if self.scan in ("time", BY_ROW):
            kept.pop("scan", None)
        if self.rate and "time" not in kept and not self.time and "scan" in kept:
            kept["time"] = kept.pop("scan")
        for axis, title in stated.items():
            told = meaning(title)
            unit = told.unit if told.axis == axis and title in titles else ""
            unit = unit or (meaning(axis, below[titles.index(title)]).unit if below and title in titles else "")
            kept[axis] = Meaning(title, axis, unit, False, True)
            kept = {name: each for name, each in kept.items() if name == axis or each.title != title or name in stated}
        if self.rate and "time" in kept:
            kept["time"] = evolve(kept["time"], unit=f"{1 / self.rate!r} s")
        return {axis: evolve(each, unit=self._unit(axis) or each.unit) for axis, each in kept.items()}

    def _unit(self, axis: str) -> str:
        return "m" if self.units.get(axis) == PIXELS else self.units.get(axis, "")

    @property
    def assumed(self) -> tuple[str, ...]:
        """What a draft says of wishes that it meets in part."""
        if PIXELS not in self.units.values():
            return ()
        return ("positions are in px: read m as px and m/s as px/s; y goes down in the image and up in pictures of tracks",)


def _rate(given: str | None, problems: list[Problem]) -> float:
    try:
        rate = float(given.removesuffix("Hz")) if given is not None else 0.0
    except ValueError:
        rate = -1.0
    if given is not None and not 0 < rate < float("inf"):
        problems.append(Problem("--rate", f"must be counts a second, as 30, got {given!r}"))
    return max(rate, 0.0)


def _pairs(option: str, given: str | None, problems: list[Problem]) -> dict[str, str]:
    """Return pairs as `x=cx,y=cy`."""
    parts = [part.partition("=") for part in given.split(",")] if given else []
    if any(not name.strip() or not value.strip() for name, _, value in parts):
        example = "x=cx,y=cy" if option == "--columns" else "x=km,y=km"
        problems.append(Problem(option, f"must be pairs as {example}, got {given!r}"))
        return {}
    names = [name.strip() for name, _, _ in parts]
    if twice := next((name for name in names if names.count(name) > 1), ""):
        problems.append(Problem(option, f"states {twice} more than once: {given!r}"))
    return {name.strip(): value.strip() for name, _, value in parts}
