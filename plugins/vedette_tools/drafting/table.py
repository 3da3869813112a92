"""How a table of detections is read by a `csv` source, as a draft takes it to be."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from attrs import evolve, field, frozen

from vedette_files import Origin
from vedette_files.tables.columnar import FrameTable
from vedette_files.tables.rows import Dialect
from vedette_tools.drafting.height_and_rate import UPWARD, VELOCITY
from vedette_tools.drafting.several import FLAT, POLAR
from vedette_tools.drafting.titles import Meaning

AID, TRUTH, IGNORE = "aid", "truth", "ignore"
"""What names of objects are to a draft: known to the tracker, to judge its tracks by, or nothing."""

NO_MEANING = Meaning("", "", "", False, False)


@frozen
class Table:
    """How a table is read: its columns by the config's tables, what was assumed, and what is left out.

    guessed: units that had to be, column to what says so; others: what sensors measure that do not measure the same as the
    first, axis to column; reports: the sensors whose returns are what objects report of themselves; stands: where sensors
    stand that are not at x = y = 0; carried_by: the column of sensors, if each row tells where its own stands, or "";
    apart: the column that seems to tell objects apart, where none is titled so; unknown: what to type as a unit of a length
    or a speed is not known, or ""; roundings: what errors digits leave, by axis, in SI units; origin: if the middle of the
    positions is none; links: how near, in m, an object's returns are, by the sensors to which it gives several.
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
    guessed: Mapping[str, str] = field(factory=dict)
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
    noise: Mapping[str, str] = field(factory=dict)
    roundings: Mapping[str, float] = field(factory=dict)
    carried_by: str = ""
    over_ground: bool = False
    apart: str = ""
    origin: Origin | None = None
    links: Mapping[str, float] = field(factory=dict)

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
        """What is measured beside a position in the plane: elevation, range_rate, z or altitude; or ""."""
        return next((axis for axis in (*UPWARD, "range_rate") if axis in self.measured), "")

    @property
    def upward(self) -> bool:
        """Whether positions are in space."""
        return self.third in UPWARD

    @property
    def floors(self) -> tuple[float, ...]:
        """The errors of a sensor, in m, or m and rad, that it has if only for want of digits."""
        if "latitude" in self.measured:
            return (self.roundings.get("latitude", 0.0),)
        each = [self.roundings.get(axis, 0.0) for axis in (POLAR if self.polar else FLAT)]
        return tuple(each) if self.polar else (max(each),)

    @property
    def said(self) -> tuple[str, ...]:
        """What a draft says of what it takes for granted."""
        guessed = (f"{column} {said}" for column, said in self.guessed.items())
        own = (f"each return has errors of its own: {', '.join(self.noise.values())}",) if self.noise else ()
        return (*self.assumed, *guessed, *own)

    def without_third(self, why: str) -> Table:
        """Return how the same table is read without it."""
        kept = self.at_rest()
        measured = {axis: title for axis, title in self.measured.items() if axis != self.third}
        noise = {axes: column for axes, column in self.noise.items() if self.third not in axes.split()}
        title = self.measured[self.third]
        units = {axis: unit for axis, unit in self.units.items() if axis != self.third}
        assumed, left_out = (*kept.assumed, f"{title} is left out: {why}"), (*kept.left_out, title)
        guessed = {column: said for column, said in kept.guessed.items() if column != title}
        return evolve(kept, measured=measured, noise=noise, units=units, assumed=assumed, guessed=guessed, left_out=left_out)

    def without_noise(self) -> Table:
        """Return how the same table is read without the errors of returns: they are likelier without them."""
        told = f"{', '.join(self.noise.values())} are left out: returns are less likely by them than by the sensor's errors"
        return evolve(self, noise={}, assumed=(*self.assumed, told), left_out=(*self.left_out, *self.noise.values()))

    def at_rest(self, *why: str) -> Table:
        """Return how the same table is read without the velocity of its platform."""
        titles = tuple(title for axis, title in self.platform.items() if axis in VELOCITY)
        platform = {axis: title for axis, title in self.platform.items() if axis not in VELOCITY}
        guessed = {column: said for column, said in self.guessed.items() if column not in titles}
        left_out = (*self.left_out, *titles)
        assumed = (*self.assumed, *why)
        return evolve(self, platform=platform, assumed=assumed, guessed=guessed, left_out=left_out, over_ground=True)

    def sensor(self) -> dict[str, Any]:
        """Return the config of its first sensor, whose errors are not known yet."""
        polar: dict[str, Any] = {"sigma_range": 1.0, "sigma_bearing": 1e-3}
        polar |= dict(zip(FLAT, self.stands[self.sensors[0]], strict=True)) if self.sensors[0] in self.stands else {}
        if self.third == "range_rate":
            return {"kind": "range_bearing_rate", **polar, "sigma_rate": 1.0}
        if self.third == "elevation":
            return {"kind": "range_bearing_elevation", **polar, "sigma_elevation": 1e-3}
        if self.polar:
            return {"kind": "range_bearing", **polar}
        if self.third:
            return {"kind": "linear", "axes": ["x", "y", "z"], "R": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]}
        return {"kind": "cartesian_position", "sigma": 1.0}

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
        detections |= {"noise": dict(self.noise)} if self.noise else {}
        if self.sensor_column:
            detections |= {"sensor_column": self.sensor_column}
        source: dict[str, Any] = {"kind": "csv", "path": self.path, "frame": self.frame, "detections": detections}
        source |= {"delimiter": self.dialect.delimiter} if self.dialect.delimiter != "," else {}
        source |= {"decimal": self.dialect.decimal} if self.dialect.decimal != "." else {}
        source |= {"sort": True} if self.sort else {}
        if self.origin is not None:
            source["origin"] = {"latitude": self.origin.latitude, "longitude": self.origin.longitude}
        source |= {"dates": self.dates} if self.dates else {}
        if self.platform:
            own = {axis: self.units[f"own {axis}"] for axis in self.platform if f"own {axis}" in self.units}
            file, time = self.beside
            units = own | (timed if not file else {"time": time.unit} if time.unit not in ("", "s") else {})
            source["platform"] = {"time": time.title if file else self.time.title, "columns": dict(self.platform)}
            source["platform"] |= {"units": units} if units else {}
            source["platform"] |= {"object": self.carried_by} if self.carried_by and not file else {}
            source["platform"] |= {"over_ground": True} if self.over_ground and self.third == "range_rate" else {}
            if file:
                source["path"] = str(Path(self.path).parent)
                source["platform"]["file"] = file
                detections["file"] = Path(self.path).name
        if self.identity and self.use == TRUTH and self.path and not self.polar:
            true = {"file": Path(self.path).name, "time": self.time.title, "columns": dict(self.measured)}
            true |= {"units": detections["units"]} if "units" in detections else {}
            source["truth"] = true | {"object": self.identity}
        return source
