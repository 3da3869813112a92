"""A marine radar's picture, the plan position indicator: antenna, receiver and screen."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from vedette import Array, fields
from vedette_sim.polar_fields import Float32, opencv

STANDARD_WIDTH = float(np.sqrt(8.0 * np.log(2.0)))
"""Width at half height of a Gaussian of standard deviation 1."""

_REACH = 5.0
"""Standard deviations from a point at which its echo is cut off: 54 dB down."""


@final
@frozen
class PpiRadar:
    """A rotating pulse radar and its picture.

    Powers are relative to the receiver's noise. A point of cross-section s at range R gives the power
    10^(echo/10) s / R^4, R in km, at least .01, in the middle of a Gaussian of the two-way `beam` and the `pulse`'s width at
    half power.
    The azimuth a, clockwise from the bow, is looked at (k + a / 2 pi) `period` from the start, k = 0, 1, ..

    >>> radar = PpiRadar(metres_per_pixel=10.0, range=1500.0, size=320, beam=np.pi / 16, pulse=30.0, azimuths=256, echo=20.0,
    ...                  gain=-5.0, calm=800.0)
    >>> radar.cell, radar.centre, radar.ranges[[0, 299]].tolist()
    (5.0, 159.5, [2.5, 1497.5])
    >>> np.allclose(radar.bearings[[0, 255]], [np.pi / 256, 511 * np.pi / 256])
    True
    >>> np.allclose(radar.strength(np.array([500.0, 2000.0, 0.0])), [100 * 16, 100 / 16, 100 * 1e8])
    True
    >>> power = np.zeros((256, 300), dtype=np.float32)
    >>> radar.add_points(power, radar.bearings[[2]], radar.ranges[[100]], np.array([7.0]))
    >>> power[[2, 6, 254, 2, 2], [100, 100, 100, 103, 97]].round(4).tolist()  # half of it half a width away
    [7.0, 3.5, 3.5, 3.5, 3.5]
    >>> got = radar.levels(np.full((1, 300), 10.0, dtype=np.float32))[0, [40, 299]]
    >>> np.allclose(got, [10 - 5 + 30 * np.log10(202.5 / 800), 5.0], atol=1e-4)
    True
    >>> shown = Raster(radar).picture(np.full((256, 300), 255, dtype=np.uint8))
    >>> np.array_equal(shown > 0, np.hypot(*(np.mgrid[:320, :320] - 159.5)) <= 150)  # black beyond the disc
    True
    """

    metres_per_pixel: float = fields.quantity("m", "side of a pixel", above=0)
    range: float = fields.quantity("m", "radius of the disc that is seen", above=0)
    size: int = fields.integer("rows and columns of the picture", default=1024, at_least=32, at_most=4096)
    beam: float = fields.quantity("rad", "two-way width of the beam at half power", default=0.021, above=0, at_most=0.5)
    pulse: float = fields.quantity("m", "pulse's extent in range at half power, c tau / 2", default=12.0, above=0)
    period: float = fields.quantity("s", "time of one turn of the antenna", default=1.0, at_least=0.1)
    azimuths: int = fields.integer("sweeps a turn", default=1024, at_least=64, at_most=4096)
    echo: float = fields.quantity("1", "decibels over noise of 1 m^2 at 1 km", default=25.0, at_most=120)
    span: float = fields.quantity("1", "decibels from black to full brightness", default=30.0, above=0, at_most=120)
    gain: float = fields.quantity("1", "decibels that are added before", default=-8.0, at_least=-100, at_most=100)
    calm: float = fields.quantity(
        "m", "range within which the gain falls by (R / calm)^3 against the sea", default=0.0, at_least=0
    )
    up: str = fields.choice("what is up on the screen", ("north-up", "head-up"), default="north-up")

    bins_per_pixel: ClassVar[int] = 2

    def __attrs_post_init__(self) -> None:
        if self.range > 0.5 * self.size * self.metres_per_pixel:
            reach = 0.5 * self.size * self.metres_per_pixel
            raise ValueError(f"range: must be <= half the picture, {reach:.6g} m, got {self.range:.6g} m")
        if self.range < 16 * self.metres_per_pixel:
            raise ValueError(f"range: must be >= 16 pixels, {16 * self.metres_per_pixel:.6g} m, got {self.range:.6g} m")
        if self.azimuths % 8:
            raise ValueError(f"azimuths: must be a multiple of 8, got {self.azimuths}")
        sweep = 2.0 * np.pi / self.azimuths
        if self.beam < sweep:
            raise ValueError(f"beam: must be >= the angle between two sweeps, {sweep:.3g} rad, got {self.beam:.3g} rad")
        if not self.cell <= self.pulse <= self.range / 8:
            limits = f"half a pixel, {self.cell:.6g} m, and <= an eighth of the range, {self.range / 8:.6g} m"
            raise ValueError(f"pulse: must be >= {limits}, got {self.pulse:.6g} m")

    @property
    def cell(self) -> float:
        """Length of a range bin in m."""
        return self.metres_per_pixel / self.bins_per_pixel

    @property
    def centre(self) -> float:
        """Column and row of the antenna in px."""
        return 0.5 * (self.size - 1)

    @property
    def bearings(self) -> Array:
        """Azimuths of the sweeps in rad, clockwise from the bow."""
        return (np.arange(self.azimuths) + 0.5) * (2.0 * np.pi / self.azimuths)

    @property
    def ranges(self) -> Array:
        """Centres of the range bins in m."""
        return (np.arange(int(np.ceil(self.range / self.cell))) + 0.5) * self.cell

    @property
    def spread(self) -> tuple[float, float]:
        """Standard deviations of a point's power in sweeps and in range bins."""
        return self.beam / STANDARD_WIDTH / (2.0 * np.pi / self.azimuths), self.pulse / STANDARD_WIDTH / self.cell

    def strength(self, ranges: Array) -> Array:
        """Return the power of 1 m^2 at ranges (*b) in m."""
        return 10.0 ** (self.echo / 10.0) * (np.maximum(ranges, 10.0) / 1000.0) ** -4

    def add_points(self, power: Float32, azimuths: Array, ranges: Array, strengths: Array) -> None:
        """Add points' echoes (n,) to power (azimuths, range bins)."""
        across, along = self.spread
        rows, i = _window(azimuths * (self.azimuths / (2.0 * np.pi)) - 0.5, across)
        columns, j = _window(ranges / self.cell - 0.5, along)
        echoes = strengths[:, None, None] * rows[:, :, None] * columns[:, None, :]
        i, j = np.broadcast_arrays((i % self.azimuths)[:, :, None], j[:, None, :])
        inside = (j >= 0) & (j < power.shape[1])
        np.add.at(power, (i[inside], j[inside]), echoes[inside].astype(np.float32))

    def levels(self, power: Float32) -> Float32:
        """Return the decibels over black of power (azimuths, range bins), as the receiver passes them on."""
        level: Float32 = np.float32(10.0) * np.log10(np.maximum(power, np.float32(1e-9))) + np.float32(self.gain)
        if self.calm > 0:
            level += (30.0 * np.log10(np.minimum(self.ranges / self.calm, 1.0))).astype(np.float32)
        return level


def _window(at: Array, spread: float) -> tuple[Array, NDArray[np.intp]]:
    """Return the weights of a Gaussian around each place `at` (n,), and the bins that they belong to: (n, w)."""
    reach = int(np.ceil(_REACH * spread))
    bins = np.rint(at).astype(np.intp)[:, None] + np.arange(-reach, reach + 1)
    return np.exp(-0.5 * ((bins - at[:, None]) / spread) ** 2), bins


@final
class Raster:
    """Where each pixel of the disc lies among the sweeps; OpenCV's fixed-point maps, made once."""

    def __init__(self, radar: PpiRadar) -> None:
        middle, n = radar.centre, radar.azimuths
        down, right = (np.mgrid[: radar.size, : radar.size] - middle) * radar.metres_per_pixel
        away = np.hypot(right, down)
        row = np.mod(np.arctan2(right, -down), 2.0 * np.pi) * (n / (2.0 * np.pi)) - 0.5
        column = away / radar.cell - 0.5
        self.outside = away > radar.range
        # One sweep more at either end, so that a pixel between the last and the first lies between two.
        cv2 = opencv()
        self._maps = cv2.convertMaps(column.astype(np.float32), (row + 1.0).astype(np.float32), cv2.CV_16SC2)

    def picture(self, sweeps: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Map sweeps (azimuths, range bins), row 0 up on the screen and then clockwise, to a picture (h, w)."""
        closed = np.concatenate([sweeps[-1:], sweeps, sweeps[:1]])
        cv2 = opencv()
        made: NDArray[np.uint8] = cv2.remap(closed, *self._maps, cv2.INTER_LINEAR)
        made[self.outside] = 0
        return made
