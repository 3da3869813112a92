"""A folder of radar pictures as a source of frames."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, final

import numpy as np
from attrs import frozen

from vedette import (
    ConfigError,
    Frame,
    ImagingSensor,
    InputError,
    LazyScans,
    Pose,
    Problem,
    Recording,
    Rows,
    Scan,
    Sensor,
    Source,
    Trajectory,
    fields,
)
from vedette_files import Apart, ApartOpenCV
from vedette_files.images.png import check_png
from vedette_files.input_files import inside, shown
from vedette_files.readers import Sample, find, in_time_order
from vedette_marine.ais.csv import read_csv
from vedette_marine.ais.reports import without_outliers
from vedette_marine.ais.tracks import trajectories
from vedette_marine.geometry import PictureGeometry, read_geometry
from vedette_marine.opencv import opencv
from vedette_marine.sources.tables import Table, read_table, truth

PUBLISHER = "a folder with geometry.json, frames.csv and the pictures that it names; docs/marine.md says more"


@final
@frozen
class RadarPictures(Source):
    """Radar pictures of a folder, each read on demand, with their geometry and AIS.

    The reference is `truth.csv` (true hull centres) or the AIS of `ais.csv`. Each of these is left out and reported: an
    invalid row of frames.csv, a file that is missing, corrupted, or of another size than the geometry states, a
    time out of order; AIS positions that no ship can reach. A lost frame needs no row: times are true times.
    """

    kind: ClassVar[str] = "radar_pictures"
    draws: ClassVar[bool] = False

    path: str = fields.text("folder that holds geometry.json, frames.csv and the pictures", default="")
    reference: str = fields.choice("what tracks are held against", ("truth", "ais", "none"), default="truth")
    longest_gap: float = fields.quantity("s", "AIS reports farther apart say nothing in between", default=60.0, above=0)
    apart: Apart | None = fields.part(
        "limits of a process of its own that decodes the pictures; default: none, this process decodes", default=None
    )

    def open(self, sensors: Mapping[str, Sensor], rng: np.random.Generator) -> Recording:
        """Return all frames, lazily; InputError without a geometry, frames or, where AIS is the reference, AIS."""
        screens = [name for name, sensor in sensors.items() if isinstance(sensor, ImagingSensor)]
        if len(screens) != 1 or len(sensors) != 1:
            text = f"radar pictures need one screen behind a preprocessor, got {', '.join(sensors) or 'none'}"
            raise ConfigError.at("sensors", text)
        folder = find(self.path, PUBLISHER)
        _check_links(folder, ("geometry.json", "frames.csv", "truth.csv", "ais.csv"))
        geometry = read_geometry(folder)
        refused: list[Problem] = []
        rows: dict[str, Rows] = {}
        cv2 = opencv() if self.apart is None else ApartOpenCV(self.apart)
        known: dict[str, Any] = geometry.as_json() | {"land": _land(folder, geometry, cv2)}
        frames = _frames(folder, geometry, refused)
        rows["frames"] = Rows(len(frames) + len(refused), len(frames), len(refused))
        if not frames:
            first = f"; the first problem: {refused[0]}" if refused else ""
            raise InputError(f"{folder}: holds no usable picture{first}")

        def make(i: int) -> Scan:
            file, time, pose = frames[i]
            return Scan(time, screens[0], _NOTHING, pose, Frame(_pixels(folder / file, cv2), geometry=known))

        size = f"{geometry.width} x {geometry.height} px of {geometry.metres_per_pixel:g} m, {geometry.stabilisation}"
        reference = self._reference(folder, geometry, refused, rows)
        return Recording(LazyScans(len(frames), make), reference, tuple(refused), {"pictures": size}, rows=rows)

    def _reference(
        self, folder: Path, geometry: PictureGeometry, refused: list[Problem], rows: dict[str, Rows]
    ) -> tuple[Trajectory, ...]:
        if self.reference == "none" or (self.reference == "truth" and not (folder / "truth.csv").is_file()):
            return ()
        if self.reference == "truth":
            told = len(refused)
            paths = truth(folder / "truth.csv", refused)
            used, lost = sum(len(path.times) for path in paths), len(refused) - told
            rows["truth"] = Rows(used + lost, used, lost)
            return paths
        if geometry.latitude is None or geometry.longitude is None:
            raise InputError(
                f"{folder / 'geometry.json'}: lacks latitude and longitude, so AIS has no positions in the pictures"
            )
        origin = (geometry.latitude, geometry.longitude)
        ships, bad = read_csv(folder / "ais.csv")
        refused += bad
        total, told = sum(len(reports.time) for reports in ships.values()) + len(bad), len(refused) - len(bad)
        objects: list[Trajectory] = []
        for reports in ships.values():
            kept, outliers = without_outliers(reports, origin, "ais.csv")
            refused += outliers
            objects += trajectories(kept, origin, self.longest_gap)
        lost = len(refused) - told
        rows["ais"] = Rows(total, total - lost, lost)
        return tuple(objects)


_NOTHING = Scan.image(0.0, "", Frame(np.zeros((1, 1)))).detections


def _frames(folder: Path, geometry: PictureGeometry, refused: list[Problem]) -> list[tuple[str, float, Pose]]:
    """Return file, time and pose of every usable picture, in order of time."""
    table: Table = read_table(
        folder / "frames.csv", ("file",), ("time_s",), ("heading_rad", "east_m", "north_m", "east_mps", "north_mps"), refused
    )
    samples = []
    for place, words, row in table:
        try:
            name = words["file"]
            if Path(name).name != name:
                raise ValueError(f"file must be a name in the folder, got {shown(name)}")
            *size, depth = check_png(inside(folder, name))
            if depth != 8:
                raise ValueError(f"must have 8 bit, got {depth}")
            if size != [geometry.width, geometry.height]:
                wanted = f"{geometry.width} x {geometry.height}"
                raise ValueError(f"{name}: must be {wanted} px as geometry.json says, got {size[0]} x {size[1]}")
        except ValueError as error:
            text = str(error) if str(error).startswith(("file ", words["file"])) else f"{words['file'][:60]} {error}"
            refused.append(Problem(place, text))
            continue
        heading = np.pi / 2 - row.get("heading_rad", 0.0)
        moving = np.array([row["east_mps"], row["north_mps"]]) if {"east_mps", "north_mps"} <= set(row) else None
        pose = Pose(np.array([row.get("east_m", 0.0), row.get("north_m", 0.0)]), moving, heading)
        samples.append(Sample(place, row["time_s"], (name, row["time_s"], pose)))
    return [sample.value for sample in in_time_order(samples, refused)]


def _pixels(path: Path, cv2: Any) -> Any:
    """Return (3, h, w) blue first, or (h, w); empty if a picture that was whole when the folder was opened no longer is."""
    try:
        picture = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    except ValueError as error:  # the process that decodes it has ended
        raise InputError(f"{path}: {error}") from None
    if picture is None:
        return np.zeros((0, 0), dtype=np.uint8)
    return picture if picture.ndim == 2 else np.moveaxis(picture[..., :3], -1, 0)


def _land(folder: Path, geometry: PictureGeometry, cv2: Any) -> Any:
    """Return the chart's land (h, w), None without one; InputError if it is not a picture of the geometry's size."""
    if not geometry.land:
        return None
    _check_links(folder, [geometry.land])
    path = folder / geometry.land
    wanted = f"must be a picture of {geometry.width} x {geometry.height} px"
    try:
        width, height, _ = check_png(path)
    except ValueError as error:
        raise InputError(f"{path}: {wanted}, and {error}") from None
    mask = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) if (width, height) == (geometry.width, geometry.height) else None
    if mask is None or mask.shape != geometry.shape:
        raise InputError(f"{path}: {wanted}, got {width} x {height}")
    return mask


def _check_links(folder: Path, names: Sequence[str]) -> None:
    """InputError for a name or a link that leads out of the folder."""
    for name in names:
        try:
            inside(folder, name)
        except ValueError as error:
            raise InputError(f"{folder}: {error}") from None
