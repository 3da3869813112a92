"""What a marine radar sees besides ships and sea: land, rain, buoys, radar beacons."""

from __future__ import annotations

from typing import final

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from vedette import Array, fields
from vedette_sim.polar_fields import Float32, gaussian_taps, opencv, own_stream
from vedette_sim.ppi import PpiRadar

_DOTS = {
    "A": ".-", "B": "-...", "C": "-.-.", "D": "-..", "E": ".", "F": "..-.", "G": "--.", "H": "....", "I": "..",
    "J": ".---", "K": "-.-", "L": ".-..", "M": "--", "N": "-.", "O": "---", "P": ".--.", "Q": "--.-", "R": ".-.",
    "S": "...", "T": "-", "U": "..-", "V": "...-", "W": ".--", "X": "-..-", "Y": "-.--", "Z": "--..",
}  # fmt: skip
"""The letters of the Morse code."""

_FARTHEST = 1e6
"""Corners farther out than this, in m, are taken for a wrong unit."""

_MOST_CELLS = 50_000_000
"""A raster of land with more cells is taken for a wrong unit."""


def _corners(values: Array) -> str | None:
    if values.shape[0] < 3 or values.shape[1] != 2:
        return f"must hold at least 3 corners [x, y], got {values.tolist()}"
    return None if np.all(np.abs(values) <= _FARTHEST) else f"must lie within {_FARTHEST:g} m, got {values.tolist()}"


@final
@frozen
class Land:
    """Ground within an outline: a static, rough echo that falls by R^-3 and fades inland."""

    outline: Array = fields.array("m", "corners [x, y], east and north", ndim=2, check=_corners)
    level: float = fields.quantity("1", "decibels above the noise at 1 km", default=45.0, at_most=120)
    roughness: float = fields.quantity("1", "standard deviation of its echo's decibels", default=6.0, at_least=0, at_most=30)
    depth: float = fields.quantity("m", "way through land after which it is fainter by 1/e", default=600.0, above=0)


@final
@frozen
class Rain:
    """A shower: an echo with a Gaussian profile around its middle, drifting, which falls by R^-2.

    >>> rain = Rain([100.0, -200.0], radius=300.0, level=20.0, drift=[5.0, -2.0])
    >>> np.allclose(rain.profile(np.array([150.0, 450.0]), np.array([-220.0, -220.0]), 10.0), [100.0, 100 * np.exp(-0.5)])
    True
    """

    at: Array = fields.pair("m", "middle [x, y] at the start")
    radius: float = fields.quantity("m", "standard deviation of its profile", above=0)
    level: float = fields.quantity("1", "decibels above the noise in its middle, were it at 1 km", default=20.0, at_most=100)
    drift: Array = fields.pair("m/s", "velocity [x, y]", default=(0.0, 0.0))

    def profile(self, x: Array, y: Array, time: float) -> Array:
        """Return the mean power relative to the noise's at places x, y (*b), as if each were at 1 km."""
        away = (x - self.at[0] - self.drift[0] * time) ** 2 + (y - self.at[1] - self.drift[1] * time) ** 2
        return 10.0 ** (self.level / 10.0) * np.exp(-0.5 * away / self.radius**2)


@final
@frozen
class Buoy:
    """A small anchored object: one point whose echo fluctuates exponentially from turn to turn."""

    at: Array = fields.pair("m", "place [x, y]")
    cross_section: float = fields.quantity("m^2", "its mean radar cross-section", default=10.0, above=0)


@final
@frozen
class Racon:
    """A radar beacon: while on, it answers each pulse with a Morse letter, a spoke that starts behind its position.

    >>> racon = Racon([0.0, 0.0], letter="N", on=20.0, every=50.0, first=7.0, length=800.0, delay=60.0)
    >>> # a dash, a gap, a dot: 3 + 1 + 1 units of 160 m
    >>> racon.profile(np.array([59.0, 61.0, 539.0, 541.0, 699.0, 701.0, 859.0, 861.0])).tolist()
    [0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0]
    >>> [racon.answers(time) for time in (6.9, 7.1, 26.9, 27.1, 56.9, 57.1)]
    [False, True, True, False, False, True]
    """

    at: Array = fields.pair("m", "place [x, y]")
    letter: str = fields.choice("what it sends", tuple(_DOTS), default="K")
    on: float = fields.quantity("s", "how long it answers", default=18.0, above=0)
    every: float = fields.quantity("s", "from one start to the next", default=45.0, above=0)
    first: float = fields.quantity("s", "its first start", default=0.0)
    length: float = fields.quantity("m", "length of its letter on the screen", default=1800.0, above=0)
    delay: float = fields.quantity("m", "from its place to the letter", default=80.0, at_least=0)
    level: float = fields.quantity("1", "decibels above the noise", default=30.0, at_most=100)

    def __attrs_post_init__(self) -> None:
        if self.on > self.every:
            raise ValueError(f"on: must be <= every, {self.every:.6g} s, got {self.on:.6g} s")

    def answers(self, time: float) -> bool:
        """Tell whether it is on."""
        return bool((time - self.first) % self.every < self.on)

    def profile(self, behind: Array) -> Array:
        """Return 1 where the letter is, else 0, at (*b) m behind its position: a dot is one unit, a dash 3, a gap one."""
        units = [1.0 if dot else 0.0 for sign in _DOTS[self.letter] for dot in ([1] if sign == "." else [1, 1, 1]) + [0]][
            :-1
        ]
        at = np.floor((behind - self.delay) / self.length * len(units)).astype(int)
        inside = (at >= 0) & (at < len(units))
        return np.where(inside, np.array(units)[np.clip(at, 0, len(units) - 1)], 0.0)

    def add_to(self, power: Float32, radar: PpiRadar, azimuth: float, away: float) -> None:
        """Add its spoke to power (azimuths, range bins); the answer passes the antenna once: sqrt 2 wider."""
        across = radar.spread[0] * np.sqrt(2.0)
        apart = np.mod(radar.bearings - azimuth + np.pi, 2.0 * np.pi) - np.pi
        beam = np.exp(-0.5 * (apart * radar.azimuths / (2.0 * np.pi) / across) ** 2)
        rows = np.flatnonzero(beam > 1e-6)
        spoke = 10.0 ** (self.level / 10.0) * self.profile(radar.ranges - away)
        power[rows] += (beam[rows, None] * spoke).astype(np.float32)


@final
class LandRaster:
    """The land's echo on a grid of the world, with fixed roughness, and how much of it an antenna sees."""

    def __init__(self, lands: tuple[Land, ...], radar: PpiRadar, box: Array, seed: int, stream: int) -> None:
        """Set up the grid; `box` holds the antenna's least and greatest x, y on its path (2, 2)."""
        self._step, self._radar = radar.metres_per_pixel, radar
        self._origin = box[0] - radar.range
        columns, rows = np.ceil((box[1] + radar.range - self._origin) / self._step).astype(int) + 1
        if rows * columns * len(lands) > _MOST_CELLS:
            raise ValueError(f"takes {rows} x {columns} cells of {self._step:.6g} m, as far as the own ship goes; too many")
        cv2, self._layers = opencv(), []
        for number, land in enumerate(lands):
            mask = np.zeros((rows, columns), dtype=np.uint8)
            cv2.fillPoly(mask, [np.rint((land.outline - self._origin) / self._step).astype(np.int32)], 1)
            noise = own_stream(seed, stream, number).standard_normal((rows, columns), dtype=np.float32)
            taps = gaussian_taps(1.0)
            rough = cv2.sepFilter2D(noise, -1, taps, taps) / np.float32(np.sum(taps**2))
            echo = mask * np.float32(10.0) ** (np.float32(land.level + land.roughness * rough) / np.float32(10.0))
            self._layers.append((land, mask, echo.astype(np.float32)))

    def mean(self, place: Array, bearings: Array) -> Float32:
        """Return the mean power relative to the noise's of each sweep (azimuths, range bins), from an antenna at `place`."""
        ranges, shape = self._radar.ranges, self._layers[0][1].shape
        total = np.zeros((len(bearings), len(ranges)), dtype=np.float32)
        x, y = ((place - self._origin) / self._step).astype(np.float32)
        steps = (ranges / self._step).astype(np.float32)
        column = _index(x + np.sin(bearings).astype(np.float32)[:, None] * steps, shape[1])
        row = _index(y + np.cos(bearings).astype(np.float32)[:, None] * steps, shape[0])
        for land, mask, echo in self._layers:
            through = np.cumsum(mask[row, column], axis=1, dtype=np.float32) * np.float32(self._radar.cell / land.depth)
            total += echo[row, column] * np.exp(-through)
        return total * ((np.maximum(ranges, 30.0) / 1000.0) ** -3).astype(np.float32)


def _index(at: Float32, size: int) -> NDArray[np.intp]:
    return np.clip(np.rint(at), 0, size - 1).astype(np.intp)


def land_mask(lands: tuple[Land, ...], size: int, step: float) -> NDArray[np.uint8]:
    """Return 255 on land (size, size), north-up, the middle at the origin, pixels of `step` m."""
    mask = np.zeros((size, size), dtype=np.uint8)
    for land in lands:
        pixels = land.outline / step * [1.0, -1.0] + 0.5 * (size - 1)
        opencv().fillPoly(mask, [np.rint(pixels).astype(np.int32)], 255)
    return mask
