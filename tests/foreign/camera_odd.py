"""Cameras of a dark target, of coherent light, of noise that depends on the column, of a target of any brightness."""

import numpy as np
from attrs import frozen

import vedette
from foreign import Foreign
from foreign.camera_spots import Camera


@frozen
class White(Camera):
    """Pixels in white noise: what is common to cameras whose spots differ in looks alone."""

    kind = "white_noise_camera"
    sigma: float = vedette.fields.quantity("1", "noise of a pixel, in counts", default=1, at_least=0.2, at_most=3)
    bright: float = vedette.fields.quantity("1", "of the spot's middle, in counts", default=40, at_least=20, at_most=100)

    @property
    def height(self):
        return self.bright

    def pixel(self, seen, s):
        return s * (seen - s / 2) / self.sigma**2, (seen - s) / self.sigma**2, np.full(s.shape, self.sigma**-2.0)

    def draw_frame(self, x, shape, rng):
        s = self._spot(self.measure(x), shape, np.zeros(2))[0]
        return s + self.sigma * rng.standard_normal(s.shape)


@frozen
class Silhouette(Camera):
    """A target darker than a bright sky of known brightness.

    Blackman, Popoli, Design and Analysis of Modern Tracking Systems, 1999, section 5.8.
    """

    kind = "silhouette"
    sky: float = vedette.fields.quantity("1", "of the sky, in counts", default=90, at_least=60, at_most=200)
    sigma: float = vedette.fields.quantity("1", "noise of a pixel, in counts", default=1.5, at_least=0.2, at_most=3)

    @property
    def height(self):
        return -40.0

    def pixel(self, seen, s):
        above = seen - self.sky
        return s * (above - s / 2) / self.sigma**2, (above - s) / self.sigma**2, np.full(s.shape, self.sigma**-2.0)

    def draw_frame(self, x, shape, rng):
        s = self._spot(x, shape, np.zeros(2))[0]
        return self.sky + s + self.sigma * rng.standard_normal(s.shape)


@frozen
class Speckle(Camera):
    """Pixels of coherent light: exponential, with the mean of background plus spot.

    Goodman, Speckle Phenomena in Optics, 2007, chapter 3.
    """

    kind = "speckle"
    background: float = vedette.fields.quantity("1", "mean of a pixel, in counts", default=2, at_least=0.5, at_most=5)
    bright: float = vedette.fields.quantity(
        "1", "mean of the spot's middle, in counts", default=60, at_least=40, at_most=100
    )

    @property
    def height(self):
        return self.bright

    def pixel(self, seen, s):
        mean = self.background + s
        llr = -np.log(mean / self.background) - seen / mean + seen / self.background
        return llr, (seen - mean) / mean**2, mean**-2.0

    def draw_frame(self, x, shape, rng):
        return rng.exponential(self.background + self._spot(x, shape, np.zeros(2))[0])


@frozen
class Graded(Camera):
    """White noise that grows from the left edge of the picture to the right, as a lens shades: s^2 (1 + column / 20).

    Hasinoff, Photon, Poisson Noise, 2014 (vignetting).
    """

    kind = "graded"
    sigma: float = vedette.fields.quantity("1", "noise of the first column, in counts", default=1, at_least=0.2, at_most=2)

    @property
    def height(self):
        return 50.0

    def _variance(self, shape, first):
        return self.sigma**2 * (1 + np.maximum(np.arange(shape[-1]) + first, 0.0) / 20)

    def pixel(self, seen, s):  # for `noise`, which is that of a spot in the middle
        variance = self._variance(s.shape, 0.0)
        return s * (seen - s / 2) / variance, (seen - s) / variance, np.broadcast_to(1 / variance, s.shape)

    def noise(self, x):
        side = 29
        place = self.measure(x)
        _, D = self._spot(np.full(2, 14.0), (side, side), np.zeros(2))
        column = np.arange(side) - 14.0 + place[..., :1]
        variance = self.sigma**2 * (1 + np.maximum(column, 0.0) / 20)
        J = np.einsum("ahw,bhw,...w->...ab", D, D, 1 / variance)
        return np.linalg.inv(J)

    def information(self, x, frame, at):
        seen = np.asarray(frame.pixels, dtype=float)[..., None, :, :]
        corner = np.zeros(2) if frame.corner is None else np.asarray(frame.corner)
        s, D = self._spot(self.measure(at), seen.shape[-2:], corner[..., None, :])
        columns = np.arange(seen.shape[-1]) + corner[..., :1]
        weight = 1 / (self.sigma**2 * (1 + np.maximum(columns, 0.0) / 20))
        weight = np.where(np.isnan(seen), 0.0, weight[..., None, None, :] if weight.ndim > 1 else weight)
        rest = np.nan_to_num(seen)
        return (
            np.einsum("...ahw,...bhw->...ab", weight[..., None, :, :] * D, D),
            np.einsum("...ahw,...hw->...a", D, weight * (rest - s)),
            np.sum(weight * s * (rest - s / 2), axis=(-2, -1)),
        )

    def draw_frame(self, x, shape, rng):
        s = self._spot(x, shape, np.zeros(2))[0]
        return s + np.sqrt(self._variance(shape, 0.0)) * rng.standard_normal(s.shape)


@frozen
class AnyBrightness(vedette.ImagingSensor):
    """A round spot whose brightness a is a state of its own, which counts as 5 at least.

    With h the spot of height 1: J = a^2 / s^2 sum dh dh', g = a / s^2 sum dh (y - a h), llr = a / s^2 sum h (y - a h / 2).
    Kay, Fundamentals of Statistical Signal Processing: Estimation Theory, 1993, chapter 7.
    """

    kind = "any_brightness"
    observes = vedette.Space.of(amplitude="1", y="px", x="px")
    measurement = vedette.Space.of(x="px", y="px")
    sigma: float = vedette.fields.quantity("1", "noise of a pixel, in counts", default=1, at_least=0.2, at_most=3)

    def measure(self, x):
        return x[..., [2, 1]]

    def noise(self, x):
        _, D = self._shape(np.full(2, 8.0), (17, 17), np.zeros(2))
        J = np.einsum("ahw,bhw->ab", D, D) / self.sigma**2
        return np.linalg.inv(J) / np.maximum(x[..., 0], 5.0)[..., None, None] ** 2

    def detects(self, x):
        return np.array(0.95)

    def _shape(self, u, shape, corner):
        rows, columns = np.indices(shape)
        off = np.stack([columns, rows]) + np.asarray(corner)[..., :, None, None] - u[..., None, None]
        h = np.exp(-np.sum(off**2, axis=-3) / 8.0)
        return h, h[..., None, :, :] * off / 4.0

    def _seen(self, at, frame):
        pixels = np.asarray(frame.pixels, dtype=float)[..., None, :, :]
        corner = np.zeros(2) if frame.corner is None else np.asarray(frame.corner)
        h, D = self._shape(self.measure(at), pixels.shape[-2:], corner[..., None, :])
        return np.nan_to_num(pixels), h, D, np.where(np.isnan(pixels), 0.0, self.sigma**-2.0)

    def information(self, x, frame, at):
        y, h, D, weight = self._seen(at, frame)
        a = np.maximum(at[..., 0], 5.0)
        s = a[..., None, None] * h
        J = np.einsum("...ahw,...bhw->...ab", weight[..., None, :, :] * D, D) * a[..., None, None] ** 2
        g = np.einsum("...ahw,...hw->...a", D, weight * (y - s)) * a[..., None]
        return J, g, np.sum(weight * s * (y - s / 2), axis=(-2, -1))

    def draw_frame(self, x, shape, rng):
        h, _ = self._shape(self.measure(x), shape, np.zeros(2))
        a = np.maximum(x[..., 0], 5.0)[..., None, None]
        return a * h + self.sigma * rng.standard_normal(h.shape)


COMPONENTS = (
    Foreign("white-noise camera", "sensor", White),
    Foreign("silhouette", "sensor", Silhouette),
    Foreign("speckle", "sensor", Speckle),
    Foreign("graded", "sensor", Graded),
    Foreign("any brightness", "sensor", AnyBrightness),
)
