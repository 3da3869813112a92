"""The part of a frame that a track uses, and the noise of its pixels."""

from __future__ import annotations

from functools import lru_cache
from typing import final

import numpy as np
from attrs import field, frozen

from vedette import Array, Frame, Mask, fields, kernels


@frozen(eq=False)
class Window:
    """Part of a frame for each track: values (*b, t, w, w), 0 where not `seen`; first (*b, t, 2): x, y of [0, 0]."""

    values: Array
    seen: Mask
    first: Array

    def offsets(self, spot: Array) -> tuple[Array, Array]:
        """Return the columns' and rows' centres relative to `spot` (*b, t, 2): x and y (*b, t, w) each."""
        steps = np.arange(self.values.shape[-1])
        start = self.first - spot
        return start[..., 0, None] + steps, start[..., 1, None] + steps


def cut(frame: Frame, centre: Array, width: int, saturation: float | None = None) -> Window:
    """Cut the window of `width` pixels around each `centre` (*b, t, 2); unseen: NaN, saturated pixels, and those outside."""
    pixels = frame.pixels
    corner = 0.0 if frame.corner is None else frame.corner[..., None, :]
    height, across = pixels.shape[-2:]
    first = np.rint(centre - corner - 0.5 * (width - 1))
    steps = np.arange(width)
    columns, rows = (first[..., i, None].astype(np.intp) + steps for i in (0, 1))
    inside = ((rows >= 0) & (rows < height))[..., :, None] & ((columns >= 0) & (columns < across))[..., None, :]
    rows, columns = rows.clip(0, height - 1), columns.clip(0, across - 1)
    batch = np.ix_(*(range(size) for size in pixels.shape[:-2]))
    batch = tuple(index.reshape(*index.shape, 1, 1, 1) for index in batch)
    values = pixels[(*batch, rows[..., :, None], columns[..., None, :])]
    seen = inside & ~np.isnan(values)
    if saturation is not None:
        seen &= values < saturation
    return Window(np.where(seen, values, 0.0), seen, first + corner)


@final
@frozen
class Camera:
    """Noise of the pixels, white or with a part correlated over distance d as e^(-d/l), and the size of the window."""

    sigma: float = fields.quantity("count", "standard deviation of a pixel's noise", default=1.0, above=0)
    window: int = fields.integer("pixels along each side of the window", default=8, at_least=4, at_most=512)
    correlated: float = fields.probability(
        "part of the noise's variance that is correlated over space", default=0.0, below=1
    )
    length: float = fields.quantity("px", "distance over which that correlation falls to 1/e", default=2.0, above=0)
    saturation: float | None = fields.quantity(
        "count", "pixels this bright say nothing; default: all do", default=None, tried=(None, 200.0, 2000.0)
    )
    _precision: Array | None = field(init=False, repr=False, eq=False)

    @_precision.default
    def _invert(self) -> Array | None:
        return None if self.correlated == 0 else np.linalg.inv(self.covariance())

    def __attrs_post_init__(self) -> None:
        if self.correlated > 0 and self.window > 32:
            raise ValueError(f"window: correlated noise needs at most 32 pixels, got {self.window}")

    def covariance(self, shape: tuple[int, ...] | None = None) -> Array:
        """Return the covariance of pixels, the window's or those of `shape`, row by row, in count^2: (h w, h w)."""
        y, x = (part.ravel() for part in np.indices(shape or (self.window, self.window), dtype=float))
        distance = np.hypot(x[:, None] - x, y[:, None] - y)
        white = (1.0 - self.correlated) * np.eye(len(x))
        cov: Array = self.sigma**2 * (white + self.correlated * np.exp(-distance / self.length))
        return cov

    def draw_noise(self, shape: tuple[int, ...], rng: np.random.Generator) -> Array:
        """Return noise of frames of `shape` (*b, h, w)."""
        white = rng.standard_normal(shape)
        if self.correlated == 0:
            return self.sigma * white
        return (white.reshape(*shape[:-2], -1) @ _root(self, shape[-2:]).T).reshape(shape)

    def cut(self, frame: Frame, centre: Array) -> Window:
        """Cut the window around each `centre` (*b, t, 2)."""
        return cut(frame, centre, self.window, self.saturation)

    def weigh(self, images: Array, seen: Mask) -> Array:
        """Return R^-1 times images (*b, q, w^2), over the pixels that are `seen` (*b, w^2); the others do not count."""
        if self._precision is None:
            return images * (seen / self.sigma**2)[..., None, :]
        if seen.all():
            weighed: Array = images @ self._precision
            return weighed
        both = seen[..., :, None] & seen[..., None, :]
        among = np.where(both, self.covariance(), self.sigma**2 * np.eye(seen.shape[-1]))
        kept = np.where(seen[..., None, :], images, 0.0)
        return np.swapaxes(np.linalg.solve(among, np.swapaxes(kept, -1, -2)), -1, -2)

    def spot_variance(self, amplitude: Array, spread: Array) -> Array:
        """Return the variance in px^2 that a frame leaves of each axis of a round spot's place: (*b), (*b) -> (*b).

        2 sigma^2 S / (pi a^2), with S the density of the noise over that of white noise at k^2 = 2 / spread^2, the mean over
        the spot's slopes: 1 - c + c 2 pi l^2 / (1 + k^2 l^2)^(3/2).
        """
        length = self.length
        coloured = 2.0 * np.pi * length**2 / (1.0 + 2.0 * (length / spread) ** 2) ** 1.5
        density = 1.0 - self.correlated + self.correlated * coloured
        variance: Array = 2.0 / np.pi * self.sigma**2 * density / np.maximum(amplitude**2, 1e-12)
        return variance

    def information(self, window: Window, image: Array, slopes: Array, level: Array) -> tuple[Array, Array, Array]:
        """Return J = D' R^-1 D, g = D' R^-1 (z - h) and log p(z | h) - log p(z | level) for each track.

        `image` (*b, t, w, w) is what the target adds to the background's `level` (*b, t), `slopes` (*b, t, m, w, w) its
        derivatives D; h is the image and the level.
        """
        flat = (*image.shape[:-2], image.shape[-1] ** 2)
        seen = window.seen.reshape(flat)
        h = image.reshape(flat)
        D = slopes.reshape(*slopes.shape[:-2], flat[-1])
        rest = window.values.reshape(flat) - level[..., None]
        weighed = self.weigh(np.concatenate([D, h[..., None, :]], axis=-2), seen)
        J = weighed[..., :-1, :] @ np.swapaxes(D, -1, -2)
        g = (weighed[..., :-1, :] @ (rest - h)[..., None])[..., 0]
        llr = np.sum(weighed[..., -1, :] * (rest - 0.5 * h), axis=-1)
        return kernels.symmetric(J), g, llr


@lru_cache(maxsize=4)  # it takes as long as a hundred frames, which are drawn one by one
def _root(camera: Camera, shape: tuple[int, ...]) -> Array:
    """Return the root of the covariance of pixels of `shape`."""
    return np.asarray(np.linalg.cholesky(camera.covariance(shape)))
