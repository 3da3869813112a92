"""How the pixels of a radar picture lie in the world, and the sidecar file that states it.

A folder of radar pictures holds

- the pictures, 8 bit PNG, in colour or grey;
- `geometry.json`, one object with the fields of `PictureGeometry`, by their names and in their units::

    {"metres_per_pixel": 6.0, "centre": [511.5, 511.5], "width": 1024, "height": 1024, "range": 2778.0,
     "stabilisation": "north-up", "latitude": 35.1, "longitude": 129.1, "overlays": [[0, 0, 200, 90]],
     "colours": [[0, 0, 0], [0, 255, 0], [255, 255, 0]], "land": "land.png"}

- `frames.csv`, one row per picture in order of time: `file`, `time_s`; optional columns: `heading_rad` (of the own ship,
  clockwise from north; default 0), `east_m`, `north_m` (own ship's antenna in the local frame, default 0), `east_mps`,
  `north_mps` (its velocity over ground). A frame that was lost has no row: times are true times;
- `ais.csv`, if there is AIS: `Time` (s, the pictures' time), `MMSI`, `Latitude_degrees`, `Longitude_degrees`, `COG_degrees`,
  `SOG_knots`; optional columns: `Heading_degrees`, `ROT` (as sent: 4.733 sqrt(deg/min)); an empty cell is "not available";
- `truth.csv`, if the truth is known: `object`, `time_s`, `east_m`, `north_m`, optional `east_mps`, `north_mps`,
  `heading_rad` (clockwise from north), `length_m`, `width_m`: hull centres.

The local frame is east, north in m around `latitude`, `longitude`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, final

import numpy as np
from attrs import fields as attributes
from attrs import frozen

from vedette import Array, InputError, Pose, fields
from vedette_files.images.header import check_pixels
from vedette_files.input_files import whole_text
from vedette_files.json_values import parse, short

STABILISATIONS = ("north-up", "head-up")

FILE = "geometry.json"

LARGEST = 2**20
"""Bytes of the sidecar file."""


def _colours(values: Array) -> str | None:
    fine = values.size == 0 or (values.shape[1] == 3 and len(values) > 1 and bool(np.all((values >= 0) & (values <= 255))))
    return None if fine else f"must hold at least two [red, green, blue] from 0 to 255, got {values.tolist()}"


def _boxes(values: Array) -> str | None:
    fine = values.size == 0 or (values.shape[1] == 4 and bool(np.all(values[:, 2:] > 0)))
    return None if fine else f"must hold [x, y, width, height] with sizes > 0, got {values.tolist()}"


@final
@frozen
class PictureGeometry:
    """Where the pixels of a radar picture lie.

    Pixel (i, j), column and row, from the antenna's pixel (cx, cy): right = (i - cx) s, ahead = (cy - j) s in m, with s the
    metres per pixel. North-up: east = right, north = ahead. Head-up with heading h, clockwise from north:
    east = right cos h + ahead sin h, north = ahead cos h - right sin h.
    """

    metres_per_pixel: float = fields.quantity("m", "side of a pixel", above=0)
    centre: Array = fields.pair("px", "[x, y] of the own ship's antenna; middles of pixels are whole")
    width: int = fields.integer("pixels in a row", at_least=1, at_most=65536)
    height: int = fields.integer("rows", at_least=1, at_most=65536)
    range: float | None = fields.quantity("m", "radius of the radar's disc; default: all pixels", default=None, above=0)
    stabilisation: str = fields.choice("what is up", STABILISATIONS, default="north-up")
    latitude: float | None = fields.quantity("deg", "of the local frame's origin", default=None, at_least=-90, at_most=90)
    longitude: float | None = fields.quantity("deg", "of the origin", default=None, at_least=-180, at_most=180)
    overlays: Array = fields.array(
        "px", "boxes [x, y, width, height] that the interface covers", ndim=2, default=np.zeros((0, 4)), check=_boxes
    )
    colours: Array = fields.array(
        "1",
        "[red, green, blue] of echoes at grey 0 up to 255, evenly spaced, linear in between; default: grey pictures",
        ndim=2,
        default=np.zeros((0, 3)),
        check=_colours,
    )
    land: str = fields.text(
        "picture beside this file, north-up, its `centre` at the local frame's origin: above 0 is land; default: none",
        default="",
    )

    def __attrs_post_init__(self) -> None:
        try:
            check_pixels(self.width, self.height)
        except ValueError as error:
            raise ValueError(f"width, height: {error}") from None

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.height, self.width

    def from_antenna(self, pixels: Array, heading: float = 0.0) -> Array:
        """Map columns and rows (*b, 2) to east, north (*b, 2) of the antenna; `heading` in rad clockwise from north."""
        step = (pixels - self.centre) * self.metres_per_pixel * [1.0, -1.0]
        return step @ self._turn(heading).T

    def to_pixels(self, east_north: Array, heading: float = 0.0) -> Array:
        """Map east, north of the antenna (*b, 2) to columns and rows (*b, 2); the inverse of `from_antenna`."""
        return (east_north @ self._turn(heading)) * [1.0, -1.0] / self.metres_per_pixel + self.centre

    def _turn(self, heading: float) -> Array:
        """Return the rotation from right, ahead to east, north (2, 2)."""
        h = heading if self.stabilisation == "head-up" else 0.0
        return np.array([[math.cos(h), math.sin(h)], [-math.sin(h), math.cos(h)]])

    def as_json(self) -> dict[str, Any]:
        """Return the fields as JSON holds them."""
        named = {part.name: getattr(self, part.name) for part in attributes(PictureGeometry)}
        return {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in named.items()}

    @classmethod
    def of(cls, data: object) -> PictureGeometry:
        """Build it from what `as_json` returns; ValueError that names the field if `data` is anything else."""
        if not isinstance(data, Mapping):
            raise ValueError(f"must be an object with the fields of a geometry, got {short(data)}")
        known = [part.name for part in attributes(cls)]
        for name in ("metres_per_pixel", "centre", "width", "height"):
            if name not in data:
                raise ValueError(f"{name}: is missing")
        for name in data:
            if name not in known:
                raise ValueError(f"{name[:60]}: there is no such field; the fields are {', '.join(known)}")
        given = dict(data)
        for name in ("overlays", "colours"):
            if given.get(name) in ([], None):
                given.pop(name, None)
        return cls(**given)


def read_geometry(folder: Path) -> PictureGeometry:
    """Read the geometry of a folder of pictures; InputError if its file is missing or wrong."""
    path = folder / FILE
    if not path.is_file():
        raise InputError(f"{path}: is missing: it states where the pixels lie; see docs/marine.md")
    try:
        return PictureGeometry.of(parse(whole_text(path, LARGEST)))
    except InputError:
        raise
    except (TypeError, ValueError) as error:
        raise InputError(f"{path}: {error}") from None


def write_geometry(folder: Path, geometry: PictureGeometry) -> None:
    """Write the sidecar file of a folder of pictures."""
    (folder / FILE).write_text(json.dumps(geometry.as_json(), indent=1) + "\n", encoding="utf-8")


def nautical(pose: Pose | None) -> float:
    """Convert a pose's heading, counter-clockwise from east as in the core, to clockwise from north; 0 without a pose."""
    return 0.0 if pose is None else math.pi / 2 - float(pose.heading)
