"""What a table of detections holds, by its header and its first rows: how a `csv` source reads it."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from itertools import compress, islice
from pathlib import Path
from typing import Any

import numpy as np
from attrs import evolve, field, frozen

from vedette.errors import InputError
from vedette.space import Array
from vedette_files import NORTH_EAST
from vedette_files.columnar import FrameTable, TablePath, header_and_rows, is_columnar
from vedette_files.composed import made_of
from vedette_files.csv_table import COMMAS, Dialect, cells_of, fitted, header_line, is_number, listed
from vedette_files.input_files import lines, shown
from vedette_files.readers import FRAMES
from vedette_tools.drafting.dates import is_day, pattern_of
from vedette_tools.drafting.height_and_rate import VELOCITY, own_velocity, third_column
from vedette_tools.drafting.several import EAST, FLAT, GEODETIC, HELD, PAIRS, POLAR, check_together, measured_by
from vedette_tools.drafting.shapes import position_of, time_of, with_hemisphere, with_made
from vedette_tools.drafting.titles import NAMES, OF_REPORTS, PROPERTIES, SENT, UNITS, Meaning, chosen, meaning, words_of
from vedette_tools.drafting.wishes import Wishes

LOOKED_AT = 2000
"""So many rows say what the columns hold."""

MOST_SENSORS = 20
"""A column of more names than these is not taken to name sensors."""

MANY = 20
"""So many times of which none ends in 60 to 99 are times of day without their colons; so many that are equal are none."""

CEILING = 20_000.0
"""m: hardly anything that is tracked flies higher, and much does in ft."""

FAR_OFF = 50.0
"""So many times as far from 0 as they spread lie longitudes or latitudes; returns of a radar lie around it or before it."""

AID, TRUTH, IGNORE = "aid", "truth", "ignore"
"""What names of objects are to a draft: known to the tracker, to judge its tracks by, or nothing."""

OFTEN, ONCE = 2.0, 0.9
"""A name of an object stands in so many rows, and in such a part of them alone at its time."""

DELIMITERS = (",", ";", "\t", "|")
NO_MEANING, NO_WISHES = Meaning("", "", "", False, False), Wishes()

_SENTENCE = re.compile(r"(^|\\)[!$][A-Z]{5},")

ANGLES, SPEEDS = ("bearing", "heading", "course"), ("range_rate", "vx", "vy", "speed")
COMPASS = ("bearing", "brg", "azimuth", "az", "azi", "peilung", "azimut", "acimut", "gisement", "marcacion", "peiling")


@frozen
class Table:
    """How a table is read: its columns by the config's tables, what was assumed, and what is left out.

    others: what sensors measure that do not measure the same as the first, axis to column; reports: the sensors whose
    returns are what objects report of themselves; stands: where sensors stand that are not at x = y = 0; unknown: what to
    type as a unit of a length or a speed is not known, or "".
    """

    path: str
    dialect: Dialect
    time: Meaning
    time_unit: str
    scan: str
    sensor_column: str
    sensors: tuple[str, ...]
    measured: Mapping[str, str]
    platform: Mapping[str, str]
    units: Mapping[str, str]
    frame: str
    assumed: tuple[str, ...] = ()
    unknown: str = ""
    left_out: tuple[str, ...] = ()
    sort: bool = False
    periods: Mapping[str, float] = field(factory=dict)
    frame_table: FrameTable | None = None
    identity: str = ""
    use: str = AID
    others: Mapping[str, Mapping[str, str]] = field(factory=dict)
    reports: tuple[str, ...] = ()
    stands: Mapping[str, tuple[float, float]] = field(factory=dict)
    dates: str = ""
    beside: tuple[str, Meaning] = ("", NO_MEANING)

    def of(self, sensor: str) -> Table:
        """Return how the rows of one sensor are read."""
        return evolve(self, sensors=(sensor,), measured=self.others.get(sensor, self.measured), others={})

    @property
    def reported(self) -> bool:
        """Whether all returns are what objects report of themselves."""
        return set(self.sensors) <= set(self.reports)

    @property
    def polar(self) -> bool:
        """Whether returns are ranges and bearings."""
        return "range" in self.measured

    @property
    def third(self) -> str:
        """What is measured beside a position in the plane: range_rate, z or altitude; or ""."""
        return next((axis for axis in ("range_rate", "z", "altitude") if axis in self.measured), "")

    def without_third(self, why: str) -> Table:
        """Return how the same table is read without it."""
        kept = self.at_rest()
        measured = {axis: title for axis, title in self.measured.items() if axis != self.third}
        title = self.measured[self.third]
        units = {axis: unit for axis, unit in self.units.items() if axis != self.third}
        text = f"{title} is left out: {why}"
        assumed = (*(one for one in kept.assumed if not one.startswith(f"{title} is in ")), text)
        return evolve(kept, measured=measured, units=units, assumed=assumed, left_out=(*kept.left_out, title))

    def at_rest(self, *why: str) -> Table:
        """Return how the same table is read without the velocity of its platform."""
        titles = tuple(title for axis, title in self.platform.items() if axis in VELOCITY)
        platform = {axis: title for axis, title in self.platform.items() if axis not in VELOCITY}
        assumed = [one for one in self.assumed if not one.startswith(tuple(f"{title} is in " for title in titles))]
        return evolve(self, platform=platform, assumed=(*assumed, *why), left_out=(*self.left_out, *titles))

    def source(self) -> dict[str, Any]:
        """Return the config of the source."""
        columns = dict(self.measured)
        for other in self.others.values():
            columns |= other
        detections: dict[str, Any] = {"time": self.time.title, "columns": columns}
        units = {axis: self.units[axis] for axis in columns if axis in self.units}
        timed = {"time": self.time_unit} if self.time_unit else {}
        detections |= {"units": units | timed} if units or timed else {}
        detections |= {"scan": self.scan} if self.scan else {}
        detections |= {"identity": self.identity} if self.identity and self.use == AID else {}
        detections |= {"periods": dict(self.periods)} if self.periods else {}
        if self.sensor_column:
            detections |= {"sensor_column": self.sensor_column}
        source: dict[str, Any] = {"kind": "csv", "path": self.path, "frame": self.frame, "detections": detections}
        source |= {"delimiter": self.dialect.delimiter} if self.dialect.delimiter != "," else {}
        source |= {"decimal": self.dialect.decimal} if self.dialect.decimal != "." else {}
        source |= {"sort": True} if self.sort else {}
        source |= {"dates": self.dates} if self.dates else {}
        if self.platform:
            own = {axis: self.units[f"own {axis}"] for axis in self.platform if f"own {axis}" in self.units}
            file, time = self.beside
            units = own | (timed if not file else {"time": time.unit} if time.unit not in ("", "s") else {})
            source["platform"] = {"time": time.title if file else self.time.title, "columns": dict(self.platform)}
            source["platform"] |= {"units": units} if units else {}
            if file:
                source["path"] = str(Path(self.path).parent)
                source["platform"]["file"] = file
                detections["file"] = Path(self.path).name
        if self.identity and self.use == TRUTH and self.path and not self.polar:
            true = {"file": Path(self.path).name, "time": self.time.title, "columns": dict(self.measured)}
            true |= {"units": detections["units"]} if "units" in detections else {}
            source["truth"] = true | {"object": self.identity}
        return source


def read_table(path: TablePath, use: str = AID, wishes: Wishes = NO_WISHES) -> Table:
    """Return what a CSV or Parquet file holds; InputError if no time or no position can be found among its titles.

    use: what names of objects are, "aid", "truth" or "ignore". wishes: what need not be guessed.
    """
    titles, rows, dialect = _first_rows(path)
    below = rows.pop(0) if rows and _states_units(rows[0]) else []
    columns = {title: [row[i] for row in rows] for i, title in enumerate(titles)}
    below_header, own = chosen(titles, below)
    measured = wishes.measured(path, titles, below_header)
    time, pattern = time_of(columns, measured.get("time")) if not wishes.time else (measured["time"], "")
    if not any(set(pair) <= set(measured) for pair in PAIRS):
        measured |= position_of(columns, in_degrees)
    measured |= {axis: with_hemisphere(measured[axis], columns) for axis in GEODETIC if axis in measured}
    measured |= {"time": time} if time is not None else {}
    columns = with_made(columns, measured)
    if time is None:
        index = "; an index counts if it has a name" if isinstance(path, FrameTable) else ""
        counted = (
            f", or say how many counts of {measured['scan'].title!r} a second has: --rate 30" if "scan" in measured else ""
        )
        told = f"no column looks like a time among {listed(titles)}; name it `time` or `t`, or say --time COLUMN"
        raise InputError(f"{path}: {told}{counted}{index}{_of_header(titles, below or next(iter(rows), []))}")
    assumed: list[str] = []
    who, sensors = _who(measured, columns, assumed)
    flat = [measured[axis] for axis in FLAT] if set(FLAT) <= set(measured) else []
    geodetic = (
        bool(flat)
        and not set(GEODETIC) <= set(measured)
        and not any(each.unit for each in flat)
        and in_degrees(*(columns[each.title] for each in flat))
    )
    if geodetic:
        x, y = measured.pop("x"), measured.pop("y")
        measured |= {"longitude": evolve(x, axis="longitude"), "latitude": evolve(y, axis="latitude")}
        assumed.append(f"{x.title} and {y.title} are longitude and latitude in degrees; if not, say --units x=m,y=m")
    found_by = measured_by(measured, columns, who, sensors)
    if not found_by:
        wanted = "range and bearing, latitude and longitude, or x and y"
        told = f"no columns look like {wanted} among {listed(titles)}; say --columns x=COLUMN,y=COLUMN"
        raise InputError(f"{path}: {told}{_of_header(titles, below or next(iter(rows), []))}")
    check_together(path, found_by)
    lost = [one for one in sensors if len(sensors) > 1 and one not in found_by]
    assumed += [f"the rows of {one} are left out: most hold no position" for one in lost]
    sensors = tuple(sorted(found_by)) if found_by.keys() - {""} else ()
    axes = POLAR if POLAR in found_by.values() else next(iter(found_by.values()))
    compass = axes == GEODETIC or any(word in measured["bearing"].title.lower() for word in COMPASS if axes == POLAR)
    names = _axes(axes)
    others = {one: pair for one, pair in found_by.items() if pair != axes}
    own_rows = [cell in found_by and cell not in others for cell in columns[who]] if others and who else []
    main = {title: list(compress(cells, own_rows)) for title, cells in columns.items()} if own_rows else columns
    if not others or who:
        names |= third_column(axes[0], measured, main)
    beside = {one: _axes(pair, compass=compass) for one, pair in others.items()}
    every = names | {axis: name for pair in beside.values() for axis, name in pair.items()}
    units: dict[str, str] = {}
    assumed += ["the row below the header states units; as a return it is refused"] if below else []
    stated = wishes.dates or pattern
    dates, told = (stated, "") if stated else pattern_of(columns[time.title])
    assumed += [told] if told else []
    for axis, name in every.items():
        _unit(axis, axis, measured[name], columns, units, assumed)
    lost_units = [_unknown_unit(axis, measured[name]) for axis, name in every.items() if axis not in {*GEODETIC, *ANGLES}]
    aside = _aside(path, wishes.platform)
    platform = _platform(aside[1]) if aside else _platform(own) if axes == POLAR else {}
    if aside and not platform:
        raise InputError(f"{wishes.platform}: no columns look like a position of the platform")
    if "range_rate" in names and platform:
        platform |= own_velocity(own, platform, columns, compass)
    for axis, given in platform.items():
        _unit(f"own {axis}", axis, given, aside[2] if aside else columns, units, assumed)
    # What is looked at of a longer file may be the reports of many objects at its first moment.
    if MANY <= len(rows) < 0.9 * LOOKED_AT and len(set(columns[time.title])) == 1:
        told = f"is the time, and {columns[time.title][0]!r} in all rows; name another column: --time COLUMN"
        raise InputError(f"{path}: {time.title}: {told}")
    times = _numbers(columns[time.title])
    if not wishes.rate and (advice := joined(times)):
        raise InputError(f"{path}: {time.title}: {advice}, got {times[0]:.15g}")
    unit = _time_unit(time, times, assumed)
    read = {time.title, *(measured[name].title for name in every.values()), *(each.title for each in platform.values())}
    scan = measured["scan"].title if "scan" in measured else ""
    if scan and _timed(columns[scan], columns[time.title]):
        assumed.append(f"each return has a time of its own within its {scan}, and is taken at it")
    name = named_by(columns, columns[time.title], read | {who, scan}) if use != IGNORE else ""
    read |= {who, scan, name}
    return Table(
        path="" if isinstance(path, FrameTable) else str(path),
        frame_table=path if isinstance(path, FrameTable) else None,
        dialect=dialect,
        time=time,
        time_unit=unit,
        scan=scan,
        identity=name,
        reports=_reports(found_by, columns, who),
        use=use,
        sensor_column=who,
        sensors=sensors or ("sensor",),
        others={one: {axis: measured[each].title for axis, each in pair.items()} for one, pair in beside.items()},
        measured={axis: measured[name].title for axis, name in names.items()},
        platform={axis: each.title for axis, each in platform.items()},
        units=units,
        frame=NORTH_EAST if compass else FRAMES[0],
        assumed=(*wishes.assumed, *assumed),
        unknown=next(filter(None, lost_units), ""),
        dates=dates,
        beside=(wishes.platform.name, aside[0]) if aside and wishes.platform else ("", time),
        left_out=tuple(title for title in titles if not any(title in made_of(each, titles) for each in read)),
    )


def _who(
    measured: Mapping[str, Meaning], columns: Mapping[str, list[str]], assumed: list[str]
) -> tuple[str, tuple[str, ...]]:
    """Return the column that names sensors, and their names; none unless it names several, but not too many."""
    named = measured.get("sensor")
    who = named.title if named is not None and (named.sure or "type" not in words_of(named.title)) else ""
    sensors = tuple(sorted({cell for cell in columns[who] if cell})) if who else ()
    if len(sensors) == 1:
        assumed.append(f"all returns are of one sensor: {who} names only {sensors[0]}")
    if len(sensors) > MOST_SENSORS:
        assumed.append(f"{who} has more than {MOST_SENSORS} names, so all returns are of one sensor")
    return (who, sensors) if 1 < len(sensors) <= MOST_SENSORS else ("", ())


def _axes(pair: tuple[str, str], *, compass: bool = False) -> dict[str, str]:
    """Return the axes that a source reads, by the axes of titles; with a `compass`, x is north."""
    if pair != EAST:
        return {axis: axis for axis in pair}
    return dict(zip(FLAT, pair[::-1] if compass else pair, strict=True))


def _reports(pairs: Mapping[str, tuple[str, str]], columns: Mapping[str, list[str]], who: str) -> tuple[str, ...]:
    """Return the sensors whose returns are positions on the earth that objects report of themselves."""
    told = [columns[title] for plain, title in _plain(columns).items() if plain in OF_REPORTS or plain.endswith(SENT)]

    def sent(sensor: str) -> bool:
        rows = np.array(columns[who]) == sensor if who else slice(None)
        return len(pairs) > 1 > len(who) or any(np.mean(np.array(cells)[rows] != "") >= HELD for cells in told)

    return tuple(sensor or "sensor" for sensor, pair in pairs.items() if pair == GEODETIC and told and sent(sensor))


def _aside(path: TablePath, platform: Path | None) -> tuple[Meaning, dict[str, Meaning], dict[str, list[str]]] | None:
    """Return the time, the columns by axis and the cells of a file of the own platform, None without one."""
    if platform is None:
        return None
    if not isinstance(path, Path) or platform.resolve().parent != path.resolve().parent:
        raise InputError(f"{platform}: must lie in the folder of the returns, for a config names one folder: copy it there")
    titles, rows, dialect = _first_rows(platform)
    if dialect != (COMMAS if is_columnar(path) else _first_rows(path)[2]):
        raise InputError(f"{platform}: must have the delimiter and the decimal sign of {path.name}")
    measured, own = chosen(titles)
    if "time" not in measured:
        raise InputError(f"{platform}: no column looks like a time among {listed(titles)}")
    return measured["time"], measured | own, {title: [row[i] for row in rows] for i, title in enumerate(titles)}


def dialect_of(path: TablePath) -> Dialect:
    """Return how a table is written; InputError if its first line is no header."""
    return _first_rows(path)[2]


def _first_rows(path: TablePath) -> tuple[list[str], list[list[str]], Dialect]:
    if not isinstance(path, Path) or is_columnar(path):
        titles, _ = header_and_rows(path, ())
        titles, given = header_and_rows(path, titles)
        return titles, list(islice(given, LOOKED_AT)), COMMAS
    number, first, below = header_line(lines(path))
    if "\0" in first:
        wanted = "a table is CSV, in UTF-8 or UTF-16, or Parquet; the source `video` reads frames"
        raise InputError(f"{path}: is no text; {wanted}")
    numbered = [(each, line) for each, line in islice(below, LOOKED_AT) if line.strip()]
    text = [line for _, line in numbered]
    if _SENTENCE.search(first):
        raise InputError(f"{path}:{number}: holds sentences of NMEA 0183, not a table: decode them to one first")
    if first.lstrip().startswith("<"):
        cure = "XML is read as GPX alone, from a file named .gpx: save others as CSV"
        raise InputError(f"{path}:{number}: must be the titles of the columns, got {shown(first)}; {cure}")
    delimiter = max(DELIMITERS, key=first.count)
    delimiter = delimiter if delimiter in first or len(first.split()) < 2 else " "
    dialect = Dialect(delimiter, _decimal(text, delimiter))
    header = dialect.cells(first)
    if not header or _is_row(header):
        raise InputError(f"{path}:{number}: {_no_titles(path, number, first, delimiter)}")
    at, between_cells = _first_of_most(header, text)
    if at is not None and any(meaning(cell).axis for cell in cells_of(text[at], between_cells) or []):
        cure = f"{shown(text[at])} looks like it: delete what stands above, or begin these lines with #"
        raise InputError(f"{path}:{number}: must be the titles of the columns, got {shown(first)}; {cure}")
    rows = [cells for line in text if (cells := fitted(dialect.cells(line), len(header))) and len(cells) == len(header)]
    if at is not None and len(rows) < HELD * len(text) and _is_row(cells_of(text[at], between_cells) or []):
        number, line = numbered[at]
        raise InputError(f"{path}:{number}: {_no_titles(path, number, line, between_cells)}")
    if len(header) == 1:
        between = "a comma, a semicolon, a tab, | or blanks"
        raise InputError(
            f"{path}:{number}: must be the titles of the columns with {between} between them, got {shown(first)}"
        )
    return header, rows, dialect


def _first_of_most(header: Sequence[str], text: Sequence[str]) -> tuple[int | None, str]:
    """Return the first line that has as many cells as most, and what stands between these, if the first line has others."""
    for delimiter in DELIMITERS:
        cells = [cells_of(line, delimiter) or [] for line in text]
        width, often = Counter(map(len, cells)).most_common(1)[0] if cells else (0, 0)
        if width > 1 and width != len(header) and often >= HELD * len(cells):
            return next(i for i, row in enumerate(cells) if len(row) == width), delimiter
    return None, ","


def _is_row(cells: list[str]) -> bool:
    """Return whether cells are a row of returns, no titles: at least half of them are numbers."""
    numbers = sum(map(is_number, cells))
    return numbers > 0 and 2 * (numbers + cells.count("")) >= len(cells)


def _no_titles(path: object, number: int, line: str, delimiter: str) -> str:
    """Say that a row has no titles above it, and what to type."""
    cells = cells_of(line, delimiter) or []
    named = ("time" if ":" in cell else "date" if is_day(cell) else f"c{i}" for i, cell in enumerate(cells, 1))
    typed = f"(echo '{delimiter.join(named)}'; tail -n +{number} {path}) > titled.csv"
    wanted = "must be a header line with the titles of the columns, as time,x,y; got"
    return f"{wanted} {shown(line)}; write one above it, with the columns' own names: {typed}"


def _of_header(titles: Sequence[str], below: Sequence[str]) -> str:
    """Return what is wrong with a header, by what stands below it, or ""."""
    if any("\ufffd" in title for title in titles):
        return "; the titles are not in UTF-8: save the table in UTF-8"
    if any(below) and not any(sign.isdigit() for cell in below for sign in cell):
        return "; the header stands in two lines: write one, as time,x,y"
    return ""


def _states_units(row: Sequence[str]) -> bool:
    """Return whether a row below the header holds units, and no number or date."""
    words = [cell.strip("[]() ").lower() for cell in row]
    return not any(cell[:1].isdigit() or is_number(cell) for cell in row) and any(
        word in known for word in words for known in UNITS.values()
    )


def _decimal(text: Sequence[str], delimiter: str) -> str:
    """Return what numbers have before their decimals: the comma where more cells become numbers with it."""
    point, comma = (
        sum(is_number(cell) for line in text for cell in Dialect(delimiter, each).cells(line) or ()) for each in ".,"
    )
    return "," if comma > point else "."


def _platform(own: Mapping[str, Meaning]) -> dict[str, Meaning]:
    """Return the platform's columns: its position, and its heading if there is one."""
    if set(GEODETIC) <= set(own):
        pair = {axis: own[axis] for axis in GEODETIC}
    elif {"east", "north"} <= set(own):
        pair = {"x": own["north"], "y": own["east"]}
    elif set(FLAT) <= set(own):
        pair = {axis: own[axis] for axis in FLAT}
    else:
        return {}
    return pair | ({"heading": own["heading"]} if "heading" in own else {})


def _unit(
    place: str, axis: str, given: Meaning, columns: Mapping[str, list[str]], units: dict[str, str], assumed: list[str]
) -> None:
    """Add a column's unit unless it is the usual one, and what had to be assumed."""
    if axis in GEODETIC:
        if given.unit not in ("", "deg"):
            units[place] = given.unit
        return
    usual = "rad" if axis in ANGLES else "m/s" if axis in SPEEDS else "m"
    unit = given.unit
    if not unit and axis in ANGLES:
        largest = float(np.max(np.abs(_numbers(columns[given.title])), initial=0.0))
        unit = "deg" if largest > 2.0001 * math.pi else "rad"
        assumed.append(f"{given.title} is in {unit}: it goes up to {largest:.4g}{_unknown(given)}")
    elif not unit and axis == "altitude" and (most := float(np.max(_numbers(columns[given.title]), initial=0.0))) > CEILING:
        unit = "ft"
        assumed.append(f"{given.title} is in ft: it goes up to {most:,.0f}{_unknown(given)}")
    elif not unit:
        assumed.append(f"{given.title} is in {usual}{_unknown(given)}")
    if unit and unit != usual:
        units[place] = unit


def _unknown_unit(axis: str, given: Meaning) -> str:
    """Say that a title states a unit of a length or a speed that is not known, and what to type; or return ""."""
    if not given.unknown or given.unit:
        return ""
    unit = "kn" if axis in SPEEDS else "NM"
    return f"{given.title!r} may be in a unit that is not known, {given.unknown!r}; say which: --units {axis}={unit}"


def _unknown(given: Meaning) -> str:
    return f", for {given.unknown!r} is no unit that is known" if given.unknown else ""


def _time_unit(time: Meaning, values: Array, assumed: list[str]) -> str:
    """Return the unit of times unless it is s or they are dates."""
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
    if 2e4 < size < 8e4 and len(apart) and float(np.median(apart)) < 1e-3:
        assumed.append(f"{time.title} counts days, as spreadsheets do")
        return "86400 s"
    if np.all(values == np.rint(values)) and len(apart) and float(np.median(apart)) >= 100:
        assumed.append(f"{time.title} counts ms: whole numbers {np.median(apart):.0f} apart")
        return "ms"
    assumed.append(f"{time.title} is in s{_unknown(time)}")
    return ""


def joined(times: Array) -> str:
    """Say what to do with numbers that are dates or times of day without their colons, or return ""."""
    if not len(times):
        return ""
    if np.all((times > 1.9e13) & (times < 2.1e13)):
        return "must be dates and times as 2026-11-22T08:39:04"
    seconds, minutes, hours = times % 100, times // 100 % 100, times // 10_000
    looks = np.all((times >= 0) & (seconds < 60) & (minutes < 60) & (hours < 24))
    if looks and len(np.unique(times)) >= MANY and len(np.unique(seconds)) > 5 and np.ptp(minutes + 60 * hours) > 0:
        return "must be times of day as 08:39:04, for no number ends in 60 to 99"
    return ""


def named_by(columns: Mapping[str, list[str]], times: Sequence[str], taken: Collection[str]) -> str:
    """Return the column by which returns name their objects, or "": it holds some names often, and each once at a time."""
    plain = {name: title for name, title in _plain(columns).items() if title not in taken}
    rows = list(dict.fromkeys(zip(times, *columns.values(), strict=True)))  # a row that stands twice says no more
    place = {title: 1 + i for i, title in enumerate(columns)}
    for name in NAMES:
        title = plain.get(name) or next(
            (title for words, title in plain.items() if name in SENT and words.endswith(name)), ""
        )
        told = [(row[place[title]], row[0]) for row in rows if row[place[title]]] if title else []
        if len(told) >= OFTEN * len({cell for cell, _ in told}) and len(set(told)) >= ONCE * len(told) > 0:
            return title
    return ""


def _plain(columns: Iterable[str]) -> dict[str, str]:
    """Return titles by their words alone."""
    return {re.sub(r"[^a-z0-9]+", "_", title.lower().removeprefix(PROPERTIES)).strip("_"): title for title in columns}


def _timed(scans: Sequence[str], times: Sequence[str]) -> bool:
    """Return whether the returns of a scan have times of their own."""
    pairs = set(zip(scans, times, strict=True))
    return len(pairs) > 0.5 * (len(set(scans)) + len(scans)) and len(scans) > 2 * len(set(scans))


def in_degrees(x: Sequence[str], y: Sequence[str]) -> bool:
    """Return whether positions of unstated unit are longitudes and latitudes.

    They are in range, have the digits for a metre, and lie far from the origin for what they cover.
    """
    if min(sum(len(cell.partition(".")[2]) >= len("12345") for cell in cells) for cells in (x, y)) < 0.5 * max(len(x), 1):
        return False
    longitude, latitude = _numbers(x), _numbers(y)
    if not len(longitude) or np.max(np.abs(longitude)) > 180 or np.max(np.abs(latitude)) > 90:
        return False
    return any(abs(np.median(each)) > FAR_OFF * np.ptp(np.percentile(each, (5, 95))) for each in (longitude, latitude))


def _numbers(cells: Sequence[str]) -> Array:
    return np.array([float(cell) for cell in cells if is_number(cell)])
