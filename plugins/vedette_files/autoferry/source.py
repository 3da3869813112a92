"""The recordings of the Autoferry sensor fusion benchmark."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, final

import numpy as np
from attrs import evolve, frozen

from vedette import ConfigError, InputError, Pose, Problem, Recording, Rows, Scan, Sensor, Source, Space, fields
from vedette_files.autoferry.files import PUBLISHER, bearings, entries, returns, truth
from vedette_files.json_values import number, short, vector
from vedette_files.oddities import replaced
from vedette_files.readers import NORTH_EAST, check_files, detections, find, polar

SENSORS = {1: "lidar", 2: "radar", 3: "infrared", 4: "electro_optical"}
"""The benchmark's sensorID to the tracker's sensor name. The last two are cameras: they measure bearings."""

POSITION = Space.of(x="m", y="m", range="m", bearing="rad mod 2pi")
BEARING = Space.of(bearing="rad mod 2pi")
OFFERED = {"lidar": POSITION, "radar": POSITION, "infrared": BEARING, "electro_optical": BEARING}
"""What a tracker's sensor may measure: any of these axes."""


@final
@frozen
class AutoferrySource(Source):
    """One scenario of the Autoferry benchmark: lidar, radar and two cameras on a moving ferry, and two true boats.

    x is north and y is east, in m in the benchmark's local frame; bearings are clockwise from north. A tracker's sensor
    named lidar or radar may measure x and y, or range and bearing from the ferry; one named infrared or electro_optical
    the bearing. Velocities of the truth are differences of its positions over one second.

    `lag` is how long before its time stamp a sensor saw the scene: it is subtracted from the stamps. The ferry's position
    is the one of the stamp all the same: the recorder formed absolute positions and wrote them relative to it, so only it
    restores them. Measured with a radar lag of 1.7 s: the ferry's earlier position would take the returns 0.2 to 0.6 m
    farther from the boats where the ferry moves (scenarios 2 and 5), and spread fixed structures by 5 % more (13 and 16).
    """

    kind: ClassVar[str] = "autoferry"
    draws: ClassVar[bool] = False

    scenario: int = fields.integer("number N of the scenario", at_least=1)
    path: str = fields.text("folder that holds scenarioN_detections.json and scenarioN_groundTruth.json", default="")
    sensors: tuple[str, ...] | None = fields.words(
        f"sensors to use, of {', '.join(SENSORS.values())}; default: all that the tracker has", default=None
    )
    lag: dict[str, float] = fields.table("sensor to the time by which its stamps lag behind the scene", unit="s")

    def __attrs_post_init__(self) -> None:
        for name in self.sensors or ():
            _check_name(name, f"sensors: must be of {', '.join(OFFERED)}")
        for name in self.lag:
            _check_name(name, f"lag.{name}: must be of {', '.join(OFFERED)}")

    def open(self, sensors: Mapping[str, Sensor], rng: np.random.Generator) -> Recording:
        """Return the scans in the order of their corrected times, those of equal times in the file's order.

        ConfigError if the tracker's sensors do not fit; InputError if a file is missing, empty or not a list in JSON.
        """
        measured = self._measured(sensors)
        names = [f"scenario{self.scenario}_{part}.json" for part in ("detections", "groundTruth")]
        folder = find(self.path, PUBLISHER)
        check_files(folder, [("scenario", name) for name in names], PUBLISHER)
        path = folder / names[0]
        refused: list[Problem] = []
        scans, total, left_out = [], 0, 0
        for place, entry in entries(path):
            total, told = total + 1, len(refused)
            try:
                scan = self._scan(entry, measured, place, refused)
            except ValueError as error:
                refused.append(Problem(place, str(error)))
            else:
                left_out += scan is None and len(refused) == told
                scans += [] if scan is None else [scan]
        if not scans:
            first = f"; the first problem: {refused[0]}" if refused else ""
            raise InputError(f"{path}: holds no usable scan of {', '.join(measured)}{first}")
        scans.sort(key=lambda scan: scan.time)
        rows = {"detections": Rows(total, len(scans), sum(problem.rows for problem in refused), left_out)}
        boats, rows["truth"] = truth(folder / names[1], refused)
        odd = tuple(replaced(sensors, scans))
        return Recording(tuple(scans), boats, tuple(refused), {"frame": NORTH_EAST}, odd, rows=rows)

    def _measured(self, sensors: Mapping[str, Sensor]) -> dict[str, Space]:
        """Return the axes that each used sensor measures; ConfigError if the tracker lacks one or it measures others."""
        named = self.sensors if self.sensors is not None else [name for name in OFFERED if name in sensors]
        absent = [name for name in named if name not in sensors]
        problems = [Problem("sensors", f"the tracker has no sensor {name!r}, only {_quoted(sensors)}") for name in absent]
        if not named:
            problems.append(Problem("sensors", f"the recording has {_quoted(OFFERED)}, the tracker {_quoted(sensors)}"))
        spaces = {name: sensors[name].measurement for name in named if name in sensors}
        for name, space in spaces.items():
            if any(axis not in OFFERED[name].axes for axis in space.axes):
                problems.append(Problem(f"sensors.{name}", f"must measure axes of {OFFERED[name]}, measures {space}"))
        if problems:
            raise ConfigError(problems)
        return spaces

    def _scan(self, entry: Any, measured: Mapping[str, Space], place: str, refused: list[Problem]) -> Scan | None:
        """Return one entry as a scan, None if there is nothing to use; ValueError if it is not as documented.

        A return that is not a number is refused by itself, and with the last one its scan: it was not empty.
        """
        if not isinstance(entry, dict):
            raise ValueError(f"must be an object, got {short(entry)}")
        known = entry.get("sensorID")
        sensor = SENSORS.get(known) if type(known) is int else None
        if sensor is None:
            raise ValueError(f"sensorID must be one of {', '.join(map(str, SENSORS))}, got {short(known)}")
        if sensor not in measured:
            return None
        time = number(entry.get("time"), "time") - self.lag.get(sensor, 0.0)
        ferry = np.array(vector(entry.get("ownshipPosition"), "ownshipPosition", 2))
        camera = OFFERED[sensor] == BEARING
        told = (bearings if camera else returns)(entry.get("measurement"))
        good = []
        for i, values in enumerate(told):
            try:
                good.append([number(value, "each of its numbers") for value in values])
            except ValueError as error:
                refused.append(Problem(f"{place}, return {i}", str(error), 0))
        if told and not good:
            refused[-1] = evolve(refused[-1], rows=1)
            return None
        if camera:
            columns = {"bearing": np.array(good).reshape(-1)}
        else:
            north, east = np.array(good).reshape(-1, 2).T
            columns = {"x": north + ferry[0], "y": east + ferry[1]} | polar(north, east)
        return Scan(time, sensor, detections(columns, measured[sensor]), Pose(ferry))


def _check_name(name: str, text: str) -> None:
    if name not in OFFERED:
        raise ValueError(f"{text}, got {name!r}")


def _quoted(names: Mapping[str, Any]) -> str:
    return ", ".join(map(repr, names))
