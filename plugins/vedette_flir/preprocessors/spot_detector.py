"""Small targets in whole frames, at a constant false-alarm rate against what is around them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Detections, ImagingSensor, Preprocessor, Scan, Space, fields
from vedette_flir.estimators.matches import known_pixels
from vedette_flir.sources.boxes import BOX
from vedette_flir.spots_in_frame import spots


@final
@frozen
class SpotDetector(Preprocessor):
    """Finds what stands out in a frame, is small, and ends: x, y, width, height in px of each spot.

    The frame less its grey opening by squares of `sides` (top-hat; of dark targets its closing less the frame) is compared
    with its mean around. A spot counts if its peak is `clear` times the spread around it, by quartiles, above the median
    there, in the calmest half of a ring, and its region above half that contrast ends nearby, within the image. With `most`
    m the m clearest are returned.
    Gonzalez, Woods, Digital Image Processing, 2008, section 9.6.3 (top-hat); Rohling, Radar CFAR Thresholding in Clutter
    and Multiple Target Situations, IEEE T-AES 19, 1983 (ordered statistics); Trunk, Range Resolution of Targets Using
    Automatic Detectors, IEEE T-AES 14, 1978 (the smallest of halves).

    >>> from vedette import Frame
    >>> from vedette_flir.sensors.gaussian_spot import GaussianSpot
    >>> rows, columns = np.mgrid[:200, :240].astype(float)
    >>> frame = 100.0 + np.random.default_rng(1).standard_normal((200, 240))
    >>> for peak, x, y, spread in ((60.0, 70.0, 90.0, 2.0), (-90.0, 180.0, 120.0, 3.0), (30.0, 150.0, 40.0, 1.5)):
    ...     frame += peak * np.exp(-((columns - x) ** 2 + (rows - y) ** 2) / (2 * spread**2))
    >>> scan = {"eye": Scan(0.0, "eye", Detections.of([], 4), None, Frame(frame, np.array([1000.0, 500.0])))}
    >>> for polarity in ("hot", "dark", "both"):  # the clearest first; a size is about 2.355 spread + 2
    ...     z = SpotDetector({"eye": GaussianSpot()}, polarity=polarity, most=2).process(scan).z
    ...     z[:, :2].round().tolist()
    [[1070.0, 590.0], [1150.0, 540.0]]
    [[1180.0, 620.0]]
    [[1180.0, 620.0], [1070.0, 590.0]]
    >>> bool(np.all(np.abs(z[:, 2:] - 2.355 * np.array([[3.0], [2.0]]) - 2.0) < 1.0))
    True
    """

    kind: ClassVar[str] = "spot_detector"

    sensors: dict[str, ImagingSensor] = fields.part("the one camera, under the name that its frames bear")
    sides: Array = fields.array(
        "px", "sides of the structures that are taken out, each odd", ndim=1, default=(7.0, 15.0, 31.0, 61.0)
    )
    clear: float = fields.quantity("1", "least contrast over the spread of what is around", default=8.0, above=0)
    polarity: str = fields.choice("which targets count", ("hot", "dark", "both"), default="hot")
    most: int = fields.integer("spots of a frame, at most", default=3, at_least=1)

    def __attrs_post_init__(self) -> None:
        if len(self.sensors) != 1:
            raise ValueError(f"sensors: must hold one camera, got {len(self.sensors)}")
        if not len(self.sides) or np.any((self.sides < 3) | (self.sides % 2 != 1)):
            raise ValueError(f"sides: must be odd numbers of 3 px or more, got {self.sides.tolist()}")

    @property
    def measurement(self) -> Space:
        """Return x, y, width and height in px."""
        return BOX

    def process(self, scans: Mapping[str, Scan]) -> Detections:
        """Map a frame (h, w) to (k, 4): centre, width and height; none without a frame."""
        (scan,) = scans.values()
        if scan.frame is None:
            return Detections.of([], 4)
        sign = {"hot": 1.0, "dark": -1.0, "both": 0.0}[self.polarity]
        sides = tuple(int(side) for side in self.sides)
        detected = spots(known_pixels(scan.frame.pixels), sign, sides, self.clear, 2 * self.most, before_edges=True)
        corner = np.zeros(2) if scan.frame.corner is None else scan.frame.corner
        return Detections.of(np.concatenate([detected.place + corner, detected.size + GROWN], axis=1)[: self.most], 4)


GROWN = 2.0
"""Pixels by which a target is larger than its region above half its contrast, of a spot blurred by a pixel."""
