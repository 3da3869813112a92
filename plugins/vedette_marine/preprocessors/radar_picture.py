"""From radar pictures to positions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, ConfigError, Detections, Frame, InputError, Mask, Pose, Preprocessor, Scan, Space, fields
from vedette_marine.geometry import PictureGeometry, nautical
from vedette_marine.opencv import opencv
from vedette_marine.picture.chain import Chain, Stages
from vedette_marine.picture.colours import Bytes, palette
from vedette_marine.picture.evidence import Evidence
from vedette_marine.screen import POSITION, RadarScreen

if TYPE_CHECKING:
    pass


@final
@frozen
class RadarPicture(Preprocessor):
    """Processes each radar picture by itself: echoes, blobs, groups; each group is a return, its centre in east and north.

    R = sigma^2 I + (r sigma_bearing)^2 across the line of sight + extent^2 times the spread of the group's own blobs. The
    geometry comes with the pictures, or from `geometry`; own ship's place and heading with the scan.

    >>> from vedette_marine.picture.evidence import Excess
    >>> rows, columns = np.mgrid[:320, :400].astype(float)
    >>> spots = (300, 200), (290, 200), (60, 140)
    >>> lit = sum(255 * np.exp(-((columns - x) ** 2 + (rows - y) ** 2) / (2 * 2.1**2)) for x, y in spots)
    >>> geometry = PictureGeometry(5.0, [200.0, 160.0], 400, 320, stabilisation="head-up")
    >>> looks = Evidence(brightness=Excess(20.0, 100.0))
    >>> reads = RadarPicture({"radar": RadarScreen()}, Chain(link=60.0), geometry, 6.0, 0.02, 0.5, looks)
    >>> ship = Pose(np.array([1000.0, 500.0]), heading=np.pi / 2 - 0.3)  # .3 to the right of north
    >>> scan = Scan(0.0, "radar", Detections.of([], 2), ship, Frame(np.minimum(lit, 255).astype(np.uint8)))
    >>> made = reads.process({"radar": scan})
    >>> turn = np.array([[np.cos(0.3), np.sin(0.3)], [-np.sin(0.3), np.cos(0.3)]])
    >>> there = np.array([[-700.0, 100.0], [475.0, -200.0]]) @ turn.T  # of one spot, and amid two that are linked
    >>> np.allclose(made.z, [1000.0, 500.0] + there, atol=0.1), np.allclose(made.evidence, np.log(0.2) + 165 * (0.05 - 0.01))
    (True, True)
    >>> across, spread = there @ [[0.0, 1.0], [-1.0, 0.0]], np.zeros((2, 2, 2))
    >>> spread[1] = 25.0**2 * np.outer(turn[:, 0], turn[:, 0])  # they are 50 m apart
    >>> R = (36 + 0.25 * (2.1 * 5) ** 2) * np.eye(2) + 4e-4 * across[:, :, None] * across[:, None, :] + 0.25 * spread
    >>> np.allclose(made.noise, R, atol=2.0)
    True
    """

    kind: ClassVar[str] = "radar_picture"
    measurement: ClassVar[Space] = POSITION

    sensors: dict[str, RadarScreen] = fields.part("the one screen, under the name that its scans bear")
    chain: Chain = fields.part("how returns are found", default=Chain())
    geometry: PictureGeometry | None = fields.part("where pixels lie; default: as each picture says", default=None)
    sigma: float = fields.quantity("m", "standard deviation of a return per axis", default=6.0, above=0)
    sigma_bearing: float = fields.quantity("rad", "standard deviation of a bearing, on top", default=0.0, at_least=0)
    extent: float = fields.quantity("1", "part of a group's spread by which its middle may err", default=0.0, at_least=0)
    evidence: Evidence | None = fields.part("what a return's looks say of it; default: nothing", default=None)

    def __attrs_post_init__(self) -> None:
        if len(self.sensors) != 1:
            raise ValueError(f"sensors: must hold one screen, got {len(self.sensors)}")

    def process(self, scans: Mapping[str, Scan]) -> Detections:
        """Map a picture (h, w) or (3, h, w) to (k, 2) of east and north, noise and evidence; none without a picture."""
        (scan,) = scans.values()
        if scan.frame is None:
            return Detections.of([], 2)
        geometry = self.geometry_of(scan.frame)
        groups = self.stages(scan.frame, scan.pose).groups
        heading, here = nautical(scan.pose), place(scan.pose)
        relative = geometry.from_antenna(groups.at, heading)
        across = np.stack([-relative[:, 1], relative[:, 0]], axis=-1)
        turn = geometry.from_antenna(geometry.centre + np.eye(2), heading)  # steps of one pixel right and one down: (2, 2)
        spread = turn.T @ groups.spread @ turn
        noise = (
            self.sigma**2 * np.eye(2)
            + self.sigma_bearing**2 * across[:, :, None] * across[:, None, :]
            + self.extent**2 * spread
        )
        looks = (self.chain.threshold, float(self.chain.scales[0]), geometry.metres_per_pixel)
        evidence = None if self.evidence is None else self.evidence.of(groups, *looks)
        return Detections(relative + here, np.ones(len(relative), dtype=bool), evidence, noise)

    def geometry_of(self, frame: Frame) -> PictureGeometry:
        """Return the config's geometry, or the picture's own; InputError if there is none or it does not fit the picture."""
        if self.geometry is not None:
            geometry = self.geometry
        elif frame.geometry is None:
            raise ConfigError.at(
                "preprocessors", "the pictures come without a geometry: state `geometry`; see docs/marine.md"
            )
        else:
            try:
                geometry = PictureGeometry.of({key: value for key, value in frame.geometry.items() if key != "land"})
            except ValueError as error:
                raise InputError(f"geometry of a picture: {error}") from None
        if frame.pixels.shape[-2:] != geometry.shape:
            rows, columns = frame.pixels.shape[-2:]
            raise InputError(f"geometry: is of {geometry.width} x {geometry.height} px, the picture has {columns} x {rows}")
        return geometry

    def stages(self, frame: Frame, pose: Pose | None) -> Stages:
        """Return every stage of one picture."""
        geometry = self.geometry_of(frame)
        pixels: Any = frame.pixels
        picture: Bytes = np.ascontiguousarray(np.moveaxis(pixels, 0, -1) if pixels.ndim == 3 else pixels)
        if picture.dtype != np.uint8 or (picture.ndim == 3 and picture.shape[-1] != 3):
            raise InputError(f"picture: must be 8 bit, (3, h, w) or (h, w), got {pixels.dtype}, {pixels.shape}")
        coloured = picture.ndim == 3 and len(geometry.colours) > 0
        colours = palette(tuple(map(tuple, geometry.colours.tolist())), self.chain.tolerance) if coloured else None
        return self.chain.stages(picture, geometry, colours, land_of(frame, geometry, pose))


def place(pose: Pose | None) -> Array:
    """Return east and north (2,) of own ship's antenna."""
    return np.zeros(2) if pose is None else np.asarray(pose.position)[..., :2]


def land_of(frame: Frame, geometry: PictureGeometry, pose: Pose | None) -> Mask | None:
    """Return the pixels that are land, from the chart placed by own ship's position and heading; None without a chart."""
    land = None if frame.geometry is None else frame.geometry.get("land")
    if not isinstance(land, np.ndarray):
        return None
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    there = geometry.from_antenna(corners, nautical(pose)) + place(pose)
    chart = there * [1.0, -1.0] / geometry.metres_per_pixel + geometry.centre
    onto = np.column_stack([chart[1] - chart[0], chart[2] - chart[0], chart[0]])
    if np.allclose(onto, [[1, 0, 0], [0, 1, 0]]):
        return land > 0
    cv2 = opencv()
    laid = cv2.warpAffine(
        land, onto, geometry.shape[::-1], flags=cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP, borderMode=cv2.BORDER_CONSTANT
    )
    return laid > 0
