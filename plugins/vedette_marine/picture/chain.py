"""One radar picture, stage by stage: from colours to echoes to blobs to groups. Each stage is kept for inspection."""

from __future__ import annotations

from typing import final

import numpy as np
from attrs import frozen

from vedette import Array, Mask, fields
from vedette_marine.geometry import PictureGeometry
from vedette_marine.picture.artefacts import rain, spokes
from vedette_marine.picture.blobs import Blobs, Image, find_blobs
from vedette_marine.picture.colours import Bytes, Palette, plain_grey
from vedette_standard import Labels, grouped


def _rising(values: Array) -> str | None:
    fine = len(values) > 0 and values[0] > 0 and bool(np.all(np.diff(values) > 0))
    return None if fine else f"must rise and be > 0, got {values.tolist()}"


@final
@frozen
class Chain:
    """How groups of echoes are found in a picture. Threshold and scales are those of the paper's chain, in counts and px.

    Lindeberg, Feature detection with automatic scale selection, 1998 (the determinant of the Hessian).
    """

    tolerance: float = fields.quantity("1", "counts by which an echo's colour may differ from the palette", default=48.0)
    threshold: float = fields.quantity("1", "least grey level of an echo, of 255", default=90.0, at_least=0, at_most=254)
    scales: Array = fields.array("px", "of the blobs, rising", ndim=1, default=(1.5, 2.1, 3.0, 4.2, 6.0), check=_rising)
    strength: float = fields.quantity("1", "least determinant of a blob, of a picture from 0 to 1", default=0.01, above=0)
    derivatives: str = fields.choice(
        "3 x 3 masks on the smoothed picture, or sampled derivatives of the Gaussian", ("masks", "exact"), default="masks"
    )
    link: float = fields.quantity("m", "blobs closer than this are one ship's: .7 to 1 of its length", default=30.0, above=0)
    longest: float = fields.quantity("m", "a longer group is split: the longest ship", default=100.0, above=0)
    nearest: float = fields.quantity("m", "nearer echoes are the own ship's", default=100.0, at_least=0)
    spoke_width: float = fields.quantity(
        "rad", "width of the sectors in which a beacon's spoke is looked for: the beam's", default="1.2 deg", above=0
    )
    spoke_length: float = fields.quantity(
        "m", "a beacon's spoke echoes over so much of one bearing, a ship never", default=600.0, above=0
    )
    rain_side: float = fields.quantity("m", "side of the square in which echoes are counted", default=600.0, above=0)
    rain_share: float = fields.quantity("1", "part of it that echoes in rain or on land; 1: none is", default=0.25, above=0)

    def stages(self, picture: Bytes, geometry: PictureGeometry, palette: Palette | None, land: Mask | None) -> Stages:
        """Return all stages of a picture (h, w) or (h, w, 3); `land` (h, w) is True on land."""
        grey = plain_grey(picture) if palette is None else palette.grey(picture)
        echoes = np.where(blind(geometry, self.nearest), 0, grey).astype(np.uint8)
        if land is not None:
            echoes[land] = 0
        echoes[echoes < self.threshold] = 0
        above = echoes > 0
        beacon = spokes(above, right_ahead(geometry), self.spoke_width, self.spoke_length, max(self.nearest, 300.0))
        side = max(3, round(self.rain_side / geometry.metres_per_pixel))
        wet = rain(above.astype(np.uint8), side, self.rain_share) & above
        left = echoes.copy()
        left[beacon | wet] = 0
        image: Image = left.astype(np.float32) / np.float32(255)
        blobs = find_blobs(image, self.scales.tolist(), self.strength, self.derivatives == "exact")
        scale = geometry.metres_per_pixel
        labels = grouped(blobs.at * scale, blobs.strength, self.link, self.longest)
        return Stages(grey, echoes, beacon, wet, left, blobs, labels, groups(left, blobs, labels))


@frozen(eq=False)
class Groups:
    """Groups of blobs: centres (k, 2) in px, spread (k, 2, 2) in px^2, greatest grey level (k,), number of blobs (k,)."""

    at: Array
    spread: Array
    peak: Array
    count: Array

    @property
    def length(self) -> Array:
        """Greatest standard deviation in any direction (k,) in px, that of a blob being its scale."""
        return np.sqrt(np.linalg.eigvalsh(self.spread)[..., -1])


@frozen(eq=False)
class Stages:
    """Result of each stage: grey levels without the interface; echoes above the threshold, on water; those that a beacon or
    rain explains; those left; their blobs, and the blobs' groups.
    """

    grey: Bytes
    echoes: Bytes
    beacon: Mask
    wet: Mask
    left: Bytes
    blobs: Blobs
    labels: Labels
    groups: Groups


def right_ahead(geometry: PictureGeometry) -> tuple[Array, Array]:
    """Return the positions of columns (w,) and rows (h,) in m to the right of and ahead of the antenna."""
    scale = geometry.metres_per_pixel
    return (
        (np.arange(geometry.width) - geometry.centre[0]) * scale,
        (geometry.centre[1] - np.arange(geometry.height)) * scale,
    )


def blind(geometry: PictureGeometry, nearest: float) -> Mask:
    """Return the pixels (h, w) that show no water: too near, beyond the disc, or under a box of the interface."""
    right, ahead = right_ahead(geometry)
    squared = right**2 + ahead[:, None] ** 2
    hidden: Mask = squared < nearest**2
    if geometry.range is not None:
        hidden |= squared > geometry.range**2
    for x, y, width, height in geometry.overlays.astype(int).tolist():
        hidden[max(y, 0) : max(y + height, 0), max(x, 0) : max(x + width, 0)] = True
    return hidden


def groups(echoes: Bytes, blobs: Blobs, labels: Labels) -> Groups:
    """Return the centre of each group: its blobs' positions weighted by their strength, as k-means with one group gives."""
    k = int(labels.max(initial=-1)) + 1
    mass = np.bincount(labels, blobs.strength, k)
    at = np.stack([np.bincount(labels, blobs.strength * axis, k) for axis in blobs.at.T], axis=-1) / mass[:, None]
    apart = blobs.at - at[labels]
    squares = np.einsum("k,ka,kb->kab", blobs.strength, apart, apart)
    spread = np.stack([np.bincount(labels, square, k) for square in squares.reshape(-1, 4).T], axis=-1) / mass[:, None]
    of_blobs = np.diag([1.0, 1.0]) * (np.bincount(labels, blobs.strength * blobs.scale**2, k) / mass)[:, None, None]
    peak = np.zeros(k)
    columns, rows = np.rint(blobs.at).astype(int).T
    np.maximum.at(peak, labels, echoes[np.clip(rows, 0, None), np.clip(columns, 0, None)])
    return Groups(at, spread.reshape(k, 2, 2) + of_blobs, peak, np.bincount(labels, minlength=k).astype(float))
