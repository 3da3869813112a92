"""From polar sweeps to positions, at a constant false-alarm rate."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar, final

import numpy as np
from attrs import field, frozen

from vedette import Array, Detections, InputError, Mask, Preprocessor, Scan, Space, fields
from vedette_marine.geometry import STABILISATIONS, nautical
from vedette_marine.preprocessors.false_alarm_rates import KINDS, factor
from vedette_marine.preprocessors.radar_picture import place
from vedette_marine.screen import POSITION, RadarScreen
from vedette_standard import linked

ROWS = 64
"""Sweeps that the ordered test processes at a time, as it holds every cell's window."""


@final
@frozen
class Cfar(Preprocessor):
    """Tests each range cell of each sweep against its neighbours in range; echoes within the link distance are one return.

    Frames are raw video: power (sweeps, range cells), linear, sweep i at (i + .5) turns / sweeps clockwise from up, cell j
    at (j + .5) cell. Cells without a full window on both sides are not tested. A return's place is the mean of its echoes
    weighted by power; R is diag(sigma_range^2, (r sigma_bearing)^2) along and across the line of sight.

    >>> from vedette import Frame, Pose
    >>> power = np.ones((8, 400))
    >>> power[5, 299:302], power[2, 150], power[2, 250] = [300.0, 900.0, 600.0], 12.5, 12.4  # T = 16 (10^(4/16) - 1) = 12.45
    >>> ship = Pose(np.array([1000.0, 500.0]), heading=np.pi / 2 - 0.3)  # .3 to the right of north
    >>> radar = Cfar({"radar": RadarScreen()}, 5.0, rate=1e-4, window=16, up="head-up", sigma_range=8.0, sigma_bearing=0.01)
    >>> made = radar.process({"radar": Scan(0.0, "radar", Detections.of([], 2), ship, Frame(power))})
    >>> bearing, r = 0.3 + np.array([2.5, 5.5]) * np.pi / 4, 5 * np.array([150.5, (299.5 * 3 + 300.5 * 9 + 301.5 * 6) / 18])
    >>> line = np.stack([np.sin(bearing), np.cos(bearing)], axis=1)
    >>> np.allclose(made.z, [1000.0, 500.0] + r[:, None] * line)
    True
    >>> along, trace = np.sum((made.noise @ line[..., None])[..., 0] * line, axis=1), np.trace(made.noise, axis1=1, axis2=2)
    >>> np.allclose(along, 64.0), np.allclose(trace - along, (0.01 * r) ** 2)
    (True, True)
    >>> two, four = [1, 7, 0, 7, 4], [1, 9, 0, 5, 2]
    >>> tests = {"CA": (2, 0.16, two, 7.5), "GO": (2, 0.1, two, 12.0), "OS": (4, 2 / 7, four, 6.0)}
    >>> for test, (window, rate, row, level) in tests.items():  # T = 3 times 2.5, 4 and 2, the second of 1, 2, 5, 9
    ...     one = Cfar({"radar": RadarScreen()}, 5.0, test, rate, window, guard=int(window == 2), rank=0.5)
    ...     cells = np.array([row, row], dtype=float)
    ...     cells[:, 2] = 0.99 * level, 1.01 * level
    ...     one.echoes(cells)[:, 2].tolist()
    [False, True]
    [False, True]
    [False, True]
    """

    kind: ClassVar[str] = "cfar"
    measurement: ClassVar[Space] = POSITION

    sensors: dict[str, RadarScreen] = fields.part("the one receiver, under the name that its scans bear")
    cell: float = fields.quantity("m", "length of a range cell", above=0)
    test: str = fields.choice("mean of the cells, greater of both halves' means, or a rank of them", KINDS, default="CA")
    rate: float = fields.probability("of a false alarm in a cell of noise", default=1e-6, above=0, below=1)
    window: int = fields.integer("N, reference cells on both sides together", default=32, at_least=2, at_most=1024)
    guard: int = fields.integer("cells between on each side, which the target itself fills", default=4, at_most=1024)
    rank: float = fields.probability("OS: rank over N", default=0.75, above=0)
    up: str = fields.choice("what the first sweep points to", STABILISATIONS, default="north-up")
    link: float = fields.quantity("m", "echoes closer than this are one return", default=40.0, above=0)
    sigma_range: float = fields.quantity("m", "standard deviation of a return's range", default=8.0, above=0)
    sigma_bearing: float = fields.quantity("rad", "standard deviation of its bearing", default="0.4 deg", above=0)
    _factor: float = field(init=False, repr=False, eq=False)

    @_factor.default
    def _solved(self) -> float:
        if self.window % 2:
            raise ValueError(f"window: must be even, half of it on each side, got {self.window}")
        return factor(self.test, self.window, self.place_in_order, self.rate)

    def __attrs_post_init__(self) -> None:
        if len(self.sensors) != 1:
            raise ValueError(f"sensors: must hold one receiver, got {len(self.sensors)}")

    @property
    def place_in_order(self) -> int:
        """OS: k of N, counted from 1."""
        return max(1, math.ceil(self.rank * self.window - 1e-9))

    def echoes(self, power: Array) -> Mask:
        """Return the cells (*b, n) that exceed their threshold; cells at the ends, without a full window, never do."""
        half, side = self.window // 2, self.window // 2 + self.guard
        tested = power.shape[-1] - 2 * side
        exceeds = np.zeros(power.shape, dtype=bool)
        if tested <= 0:
            return exceeds
        middle = slice(side, side + tested)
        if self.test == "OS":
            flat = power.reshape(-1, power.shape[-1])
            level = np.concatenate([self._ordered(flat[i : i + ROWS], tested) for i in range(0, len(flat), ROWS)])
            level = level.reshape(*power.shape[:-1], tested)
        else:
            sums = np.concatenate([np.zeros((*power.shape[:-1], 1)), np.cumsum(power, axis=-1)], axis=-1)
            near = sums[..., half : half + tested] - sums[..., :tested]
            after = side + self.guard + 1
            far = sums[..., after + half : after + half + tested] - sums[..., after : after + tested]
            level = (near + far) / self.window if self.test == "CA" else np.maximum(near, far) / half
        exceeds[..., middle] = power[..., middle] > self._factor * level
        return exceeds

    def _ordered(self, rows: Array, tested: int) -> Array:
        """Return the reference cell of the given rank, for each tested cell of some sweeps."""
        half, after = self.window // 2, self.window // 2 + 2 * self.guard + 1
        windows = np.lib.stride_tricks.sliding_window_view(rows, half, axis=-1)
        both = np.concatenate([windows[:, :tested], windows[:, after : after + tested]], axis=-1)
        k = self.place_in_order - 1
        return np.partition(both, k, axis=-1)[..., k]

    def process(self, scans: Mapping[str, Scan]) -> Detections:
        """Map power (sweeps, cells) to (k, 2) of east and north, and their noise; none without a frame."""
        (scan,) = scans.values()
        if scan.frame is None:
            return Detections.of([], 2)
        power = np.asarray(scan.frame.pixels, dtype=float)
        if power.ndim != 2 or not np.all(power >= 0):
            raise InputError(f"sweeps: must be power >= 0, (sweeps, range cells), got shape {power.shape}")
        sweep, cell = np.nonzero(self.echoes(power))
        turn = nautical(scan.pose) if self.up == "head-up" else 0.0
        bearing = (sweep + 0.5) * (2 * np.pi / len(power)) + turn
        points = ((cell + 0.5) * self.cell)[:, None] * np.stack([np.sin(bearing), np.cos(bearing)], axis=-1)
        labels, weight = linked(points, self.link), power[sweep, cell]
        k = int(labels.max(initial=-1)) + 1
        mass = np.bincount(labels, weight, k)
        z = np.stack([np.bincount(labels, weight * axis, k) for axis in points.T], axis=-1) / mass[:, None]
        r = np.linalg.norm(z, axis=-1)[:, None, None]
        line = z / np.maximum(r[..., 0], 1e-9)
        across = np.stack([-line[:, 1], line[:, 0]], axis=-1)
        noise = (
            self.sigma_range**2 * line[:, :, None] * line[:, None, :]
            + (np.maximum(r, self.cell) * self.sigma_bearing) ** 2 * across[:, :, None] * across[:, None, :]
        )
        return Detections(z + place(scan.pose), np.ones(k, dtype=bool), None, noise)
