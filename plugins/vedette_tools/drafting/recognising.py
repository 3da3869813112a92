"""What a table of detections holds, by its header and its first rows: how a `csv` source reads it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from itertools import compress
from pathlib import Path

from attrs import evolve, frozen

from vedette.errors import InputError
from vedette.space import Array
from vedette_files import NORTH_EAST
from vedette_files.input_files import WESTERN, encoding
from vedette_files.readers import FRAMES
from vedette_files.tables.columnar import FrameTable, TablePath, is_columnar
from vedette_files.tables.composed import made_of
from vedette_files.tables.rows import BY_ROW, Dialect, listed
from vedette_tools.drafting.apart import told_apart
from vedette_tools.drafting.compass import from_north
from vedette_tools.drafting.corners import box_of
from vedette_tools.drafting.dates import pattern_of
from vedette_tools.drafting.doubtful import doubtful, is_no_time, one_moment, rising
from vedette_tools.drafting.first_rows import LOOKED_AT, familiar, first_rows, of_header, units_of
from vedette_tools.drafting.height_and_rate import fullest, own_velocity, third_column
from vedette_tools.drafting.measures import (
    ANGLES,
    MANY,
    add_unit,
    from_the_middle,
    in_degrees,
    joined,
    numbers,
    time_unit,
    unknown_unit,
)
from vedette_tools.drafting.naming import by_words, named_by, of_one
from vedette_tools.drafting.own_errors import own_errors, roundings
from vedette_tools.drafting.platforms import file_beside, platform_of
from vedette_tools.drafting.sensors import is_sent, reports_of, who_of
from vedette_tools.drafting.several import EAST, FLAT, GEODETIC, PAIRS, POLAR, check_together, measured_by
from vedette_tools.drafting.shapes import pairs_of, position_of, time_of, with_hemisphere, with_made, with_rest
from vedette_tools.drafting.table import AID, IGNORE, TRUTH, Table
from vedette_tools.drafting.titles import SPOTS, Meaning, chosen, meaning, words_of
from vedette_tools.drafting.untimed import untimed
from vedette_tools.drafting.wishes import Wishes

NO_WISHES: Wishes = Wishes()

BEARERS = {"own", "ownship", "platform", "ego", "self"}
"""Words of titles that say where a sensor is carried; vessel_lat may be what is seen."""


@frozen
class Columns:
    """The columns of a table by title, those made of others too, and which of them hold a time, a position and other things.

    lines: the numbers of those that hold the titles; measured: by axis; own: of the platform; below: the row that states
    units, or [], of_units and of_box what is said of it and of corners; pattern: of dates.
    """

    path: TablePath
    titles: list[str]
    cells: dict[str, list[str]]
    rows: Sequence[Sequence[str]]
    dialect: Dialect
    lines: range
    below: Sequence[str]
    measured: dict[str, Meaning]
    own: Mapping[str, Meaning]
    time: Meaning
    pattern: str
    of_units: str
    of_box: str

    @classmethod
    def of(cls, path: TablePath, wishes: Wishes) -> Columns:
        """Read the header and the first rows; InputError if no column looks like a time."""
        titles, rows, dialect, numbers = given = first_rows(path)
        if not wishes.columns and (known := familiar(titles)):
            raise InputError(f"{path}: holds {known}")
        below, of_units = units_of(path, given)
        cells = {title: [row[i] for row in rows] for i, title in enumerate(titles)}
        below_header, own = chosen(titles, below, doubtful(cells))
        if "time" in below_header and is_no_time(below_header, cells):
            del below_header["time"]
        measured = wishes.measured(path, titles, below_header, below)
        time, pattern = time_of(cells, measured.get("time")) if not wishes.time else (measured["time"], "")
        if time is not None and wishes.time and wishes.time in cells and not wishes.rate:
            time = with_rest(time, cells)
        if not any(set(pair) <= set(measured) for pair in PAIRS):
            alike = pairs_of(cells, below)
            measured |= position_of(cells, _in_degrees(titles)) or (alike[0] if len(alike) == 1 else {})
        box, of_box = box_of(cells, measured) if not wishes.columns else ({}, "")
        measured |= box
        measured |= {axis: with_hemisphere(measured[axis], cells) for axis in GEODETIC if axis in measured}
        measured |= {"time": time} if time is not None else {}
        if "altitude" in measured and "altitude" not in wishes.columns:
            measured["altitude"] = fullest(measured["altitude"], cells, below)
        cells = with_made(cells, measured)
        if time is None:
            scan, others = measured["scan"].title if "scan" in measured else "", {each.title for each in measured.values()}
            told = untimed(path, cells, scan, others, dialect.delimiter if numbers == range(1, 2) else None)
            raise InputError(f"{path}: {told}{of_header(path, titles, below or next(iter(rows), []))}")
        return cls(path, titles, cells, rows, dialect, numbers, below, measured, own, time, pattern, of_units, of_box)

    def geodetic(self) -> tuple[Columns, tuple[str, ...]]:
        """Return them with x and y as longitude and latitude, and what says so, if nothing else fits their values."""
        flat = [self.measured[axis] for axis in FLAT if axis in self.measured]
        if len(flat) < len(FLAT) or set(GEODETIC) <= set(self.measured) or any(each.unit for each in flat):
            return self, ()
        if not _in_degrees(self.titles)(*(self.cells[each.title] for each in flat)):
            return self, ()
        x, y = flat
        measured = {axis: each for axis, each in self.measured.items() if axis not in FLAT}
        measured |= {"longitude": evolve(x, axis="longitude"), "latitude": evolve(y, axis="latitude")}
        told = f"{x.title} and {y.title} are longitude and latitude in degrees; if not, say --units x=m,y=m"
        return evolve(self, measured=measured), (told,)

    def times(self, wishes: Wishes) -> Array:
        """Return the times that are numbers; InputError if the column cannot be the time, or must be read otherwise."""
        cells, place = self.cells[self.time.title], f"{self.path}: {self.time.title}"
        # What is looked at of a longer file may be the reports of many objects at its first moment.
        if 1 < len(self.rows) < 0.9 * LOOKED_AT and len(set(cells)) == 1:
            raise one_moment(place, cells[0], rising(self.cells, self.measured))
        times = numbers(cells)
        if not (wishes.rate or wishes.dates) and (advice := joined(times)):
            raise InputError(f"{place}: {advice}, got {times[0]:.15g}")
        return times

    def scan(self) -> str:
        """Return the column that counts scans, or ""; one that is the same in all rows names a frame of reference."""
        title = self.measured["scan"].title if "scan" in self.measured else ""
        return "" if title and len(self.rows) >= MANY and len(set(self.cells[title])) == 1 else title


def _in_degrees(titles: Iterable[str]) -> Callable[[Sequence[str], Sequence[str]], bool]:
    return partial(in_degrees, sent=any(map(is_sent, by_words(titles))))


def read_table(path: TablePath, use: str = AID, wishes: Wishes = NO_WISHES) -> Table:
    """Return what a CSV or Parquet file holds; InputError if no time or no position can be found among its titles.

    use: what names of objects are, "aid", "truth" or "ignore". wishes: what need not be guessed.
    """
    table, told = Columns.of(path, wishes).geodetic()
    columns, measured, titles, time = table.cells, table.measured, table.titles, table.time
    assumed: list[str] = []
    who, sensors = who_of(measured, columns, assumed)
    assumed += told
    found_by = measured_by(measured, columns, who, sensors)
    _check_places(table, found_by, wishes)
    lost = [one for one in sensors if len(sensors) > 1 and one not in found_by]
    assumed += [f"the rows of {one} are left out: most hold no position" for one in lost]
    sensors = tuple(sorted(found_by)) if found_by.keys() - {""} else ()
    axes = POLAR if POLAR in found_by.values() else next(iter(found_by.values()))
    compass, senses = from_north(axes, measured, titles)
    assumed += senses
    names = _axes(axes)
    others = {one: pair for one, pair in found_by.items() if pair != axes}
    own_rows = [cell in found_by and cell not in others for cell in columns[who]] if others and who else []
    main = {title: list(compress(cells, own_rows)) for title, cells in columns.items()} if own_rows else columns
    if not others or who:
        names |= third_column(axes[0], measured, main)
    _check_flat(table, names)
    assumed += _not_read(axes, measured, titles)
    beside = {one: _axes(pair, compass=compass) for one, pair in others.items()}
    every = names | {axis: name for pair in beside.values() for axis, name in pair.items()}
    units: dict[str, str] = {}
    guessed: dict[str, str] = {}
    assumed += _of_file(table, wishes)
    dates, text = (wishes.dates or table.pattern, "") if wishes.dates or table.pattern else pattern_of(columns[time.title])
    assumed += [text] if text else []
    for axis, name in every.items():
        add_unit(axis, axis, measured[name], columns, units, guessed)
    if axes == POLAR and "elevation" in measured and "elevation" not in names:
        flat = f"{measured['elevation'].title}, always the same or not in each row, is not read: targets lie in the plane"
        assumed.append(f"{flat}, and the kind range_bearing_elevation tracks them in space")
    lost_units = [unknown_unit(axis, measured[name]) for axis, name in every.items() if axis not in {*GEODETIC, *ANGLES}]
    aside = file_beside(path, wishes.platform)
    platform = platform_of(aside[1]) if aside else platform_of(table.own) if axes == POLAR else {}
    if "range_rate" in names and platform:
        platform |= own_velocity(table.own, platform, columns, compass)
    for axis, given in platform.items():
        add_unit(f"own {axis}", axis, given, aside[2] if aside else columns, units, guessed)
    times = table.times(wishes)
    unit = "" if dates else time_unit(time, times, assumed, columns[time.title])
    read = {time.title, *(measured[name].title for name in every.values()), *(each.title for each in platform.values())}
    scan = table.scan()
    if scan and _timed(columns[scan], columns[time.title]):
        assumed.append(f"each return has a time of its own within its {scan}, and is taken at it")
    places = [columns[measured[name].title] for name in axes]
    name = named_by(columns, columns[time.title], read | {who, scan}, places) if use != IGNORE else ""
    if name and of_one(columns[name], columns[time.title], places):
        assumed.append(f"{name} names objects, though all lie on one path: if it is of one, keep a row of each time alone")
    apart = told_apart(columns, read | {who, scan}, places) if use != IGNORE and not name and axes != POLAR else ""
    if apart:
        near = f"rows of one {apart} lie near each other, rows that follow one another do not"
        assumed.append(f"{near}: if it names objects, title it {apart}_id")
    if use == TRUTH and not name:
        raise InputError(f"{path}: no column names objects among {listed(titles)}: leave out --identity truth")
    noise = own_errors(names, columns) if not others else {}
    read |= {who, scan, name, *noise.values()}
    return Table(
        path="" if isinstance(path, FrameTable) else str(path),
        frame_table=path if isinstance(path, FrameTable) else None,
        dialect=table.dialect,
        time=time,
        time_unit=unit,
        scan=BY_ROW if wishes.scan == BY_ROW else scan,
        identity=name,
        apart=apart,
        reports=("sensor",) if str(path).lower().endswith(".gpx") else reports_of(found_by, columns, who),
        use=use,
        sensor_column=who,
        sensors=sensors or ("sensor",),
        others={one: {axis: measured[each].title for axis, each in pair.items()} for one, pair in beside.items()},
        measured={axis: measured[name].title for axis, name in names.items()},
        platform={axis: each.title for axis, each in platform.items()},
        carried_by=who if all(all(columns[each.title]) for each in platform.values() if not aside) else "",
        units=units,
        frame=NORTH_EAST if compass else FRAMES[0],
        assumed=(*wishes.assumed, *assumed),
        guessed=guessed,
        unknown=next(filter(None, lost_units), ""),
        dates=dates,
        noise=noise,
        roundings=roundings({axis: columns[measured[name].title] for axis, name in every.items()}, units),
        beside=(wishes.platform.name, aside[0]) if aside and wishes.platform else ("", time),
        left_out=tuple(title for title in titles if not any(title in made_of(each, titles) for each in read)),
    )


def _check_places(table: Columns, found_by: Mapping[str, tuple[str, str]], wishes: Wishes) -> None:
    """Raise InputError where no position is found, or only where a bearing is seen from, or what does not go together."""
    path, measured, titles = table.path, table.measured, table.titles
    places = [axis for axis in SPOTS if axis in measured]
    carried = any(BEARERS & {*words_of(measured[axis].title)} for axis in places)
    if carried and "bearing" in measured and "range" not in measured:
        seen = (
            f"{measured['bearing'].title} has no range beside it, and {measured[places[0]].title} is where it is seen from"
        )
        raise InputError(f"{path}: {seen}: a config of your own tracks that, with a sensor of kind 'bearing_only'")
    if not found_by:
        wanted = "range and bearing, latitude and longitude, or x and y"
        text = f"no columns look like {wanted} among {listed(titles)}; say --columns x=COLUMN,y=COLUMN"
        if several := [" and ".join(each.title for each in pair.values()) for pair in pairs_of(table.cells)[:2]]:
            text += f"; if {', and '.join(several)}, are positions, write a row for each, with its object's name"
        alone = "; one axis alone is tracked by a config of your own, with a sensor of kind 'linear'"
        text += alone if len(places) == 1 else ""
        raise InputError(f"{path}: {text}{of_header(path, titles, table.below or next(iter(table.rows), []))}")
    found = {axis: each.title for axis, each in measured.items() if axis not in wishes.columns}
    check_together(path, found_by, found, titles)


def _check_flat(table: Columns, names: Mapping[str, str]) -> None:
    """Raise InputError for positions that are counted from the middle of the earth."""
    found = [table.measured[name].title for name in names.values()]
    if names.keys() == {"x", "y", "z"} and from_the_middle(*(table.cells[title] for title in found)):
        three = ", ".join(found)
        raise InputError(
            f"{table.path}: {three} are counted from the middle of the earth: make latitudes and longitudes of them first"
        )


def _not_read(axes: tuple[str, str], measured: Mapping[str, Meaning], titles: Sequence[str]) -> list[str]:
    """Return which other columns of the same meaning are left out, and what takes them instead."""
    first, second = (measured[name].title for name in axes)
    again = [(title, title.removesuffix(first) + second) for title in titles if title.endswith(f".{first}")]
    alike = zip(*([each for each in titles if meaning(each).axis == axis] for axis in axes), strict=False)
    parts = {*made_of(first, titles), *made_of(second, titles)}
    again = [pair for pair in again if pair[1] in titles] or [pair for pair in alike if not parts & {*pair}][:1]
    takes = "are not read: --columns {}={},{}={} takes them instead"
    return [f"{title} and {other} {takes.format(axes[0], title, axes[1], other)}" for title, other in again]


def _of_file(table: Columns, wishes: Wishes) -> list[str]:
    """Return what is assumed of titles, units, letters and the time."""
    told = [each for each in (table.of_units, table.of_box) if each]
    top, end = table.lines[0], table.lines[-1]
    told += [f"the titles stand in lines {top} to {end} and are joined, as {table.titles[-1]!r}"] if end > top else []
    told += [f"what stands above line {top}, that of the titles, is passed over"] if top > 1 else []
    if isinstance(table.path, Path) and not is_columnar(table.path) and encoding(table.path) == WESTERN:
        told += ["the titles are in Windows-1252, not in UTF-8"]
    if table.time.title in table.titles and not wishes.time and not meaning(table.time.title).axis:
        told += [f"{table.time.title} is the time, by its cells; if not, say --time COLUMN"]
    return told


def _axes(pair: tuple[str, str], *, compass: bool = False) -> dict[str, str]:
    """Return the axes that a source reads, by the axes of titles; with a `compass`, x is north."""
    if pair != EAST:
        return {axis: axis for axis in pair}
    return dict(zip(FLAT, pair[::-1] if compass else pair, strict=True))


def _timed(scans: Sequence[str], times: Sequence[str]) -> bool:
    """Return whether the returns of a scan have times of their own."""
    pairs = set(zip(scans, times, strict=True))
    return len(pairs) > 0.5 * (len(set(scans)) + len(scans)) and len(scans) > 2 * len(set(scans))
