"""Cameras whose pixels are counts of photons, bits, or have heavy tails, and one that looks down on the ground in metres."""

from abc import abstractmethod

import numpy as np
from attrs import frozen
from scipy.special import expit

import vedette
from foreign import Foreign

SPREAD = 1.8


class Camera(vedette.ImagingSensor):
    """A round spot of known looks, and independent pixels: what one adds to llr, with slope and information.

    With s(u) the brightness of a pixel: g = sum l'(s) ds/du, J = sum I(s) ds/du ds/du'.
    """

    observes = vedette.Space.of(x="px", y="px")
    measurement = vedette.Space.of(x="px", y="px")
    linear = True

    @abstractmethod
    def pixel(self, seen, s):
        """Return log p(seen | s) - log p(seen | 0), its slope in s, and the information on s."""

    @property
    @abstractmethod
    def height(self):
        """The height of the spot in counts."""

    def measure(self, x):
        return x

    def jacobian(self, x):
        return np.eye(2)

    def detects(self, x):
        return np.array(0.9)

    def _spot(self, u, shape, corner):
        rows, columns = np.indices(shape)
        off = np.stack([columns, rows]) + np.asarray(corner)[..., :, None, None] - u[..., None, None]
        s = self.height * np.exp(-np.sum(off**2, axis=-3) / (2 * SPREAD**2))
        return s, s[..., None, :, :] * off / SPREAD**2

    def noise(self, x):
        side = int(8 * SPREAD)
        s, D = self._spot(np.full(2, side / 2), (side + 1, side + 1), np.zeros(2))
        return np.linalg.inv(np.einsum("ahw,bhw->ab", self.pixel(s, s)[2] * D, D))

    def information(self, x, frame, at):
        seen = np.asarray(frame.pixels, dtype=float)[..., None, :, :]
        alive = ~np.isnan(seen)
        corner = np.zeros(2) if frame.corner is None else np.asarray(frame.corner)
        s, D = self._spot(self.measure(at), seen.shape[-2:], corner[..., None, :])
        llr, slope, fisher = (np.where(alive, part, 0.0) for part in self.pixel(np.where(alive, seen, 0.0), s))
        return (
            np.einsum("...ahw,...bhw->...ab", fisher[..., None, :, :] * D, D),
            np.einsum("...ahw,...hw->...a", D, slope),
            np.sum(llr, axis=(-2, -1)),
        )


@frozen
class PhotonCounter(Camera):
    """Pixels are Poisson: their mean is the background plus the spot.

    Snyder, Miller, Random Point Processes in Time and Space, 1991.
    """

    kind = "photon_counter"
    background: float = vedette.fields.quantity("1", "mean count of a pixel", default=2, above=0.1, at_most=50)
    photons: float = vedette.fields.quantity("1", "mean count of the spot's middle", default=30, at_least=10, at_most=100)

    @property
    def height(self):
        return self.photons

    def pixel(self, seen, s):
        mean = self.background + s
        return seen * np.log(mean / self.background) - s, seen / mean - 1.0, 1.0 / mean

    def draw_frame(self, x, shape, rng):
        return rng.poisson(self.background + self._spot(x, shape, np.zeros(2))[0]).astype(float)


@frozen
class OneBit(Camera):
    """Pixels are 1 or 0: log-odds of a lit one are `odds` in the dark, and grow by the spot.

    Gariepy et al., Single-photon sensitive light-in-fight imaging, Nature Communications 6, 2015 (binary detectors).
    """

    kind = "one_bit"
    odds: float = vedette.fields.quantity("1", "log-odds of a lit pixel in the dark", default=-2, at_least=-3, at_most=-1)
    gain: float = vedette.fields.quantity("1", "log-odds that the spot's middle adds", default=5, at_least=4, at_most=6)

    @property
    def height(self):
        return self.gain

    def pixel(self, seen, s):
        lit = expit(self.odds + s)
        bit = np.where(seen > 0.5, 1.0, 0.0)
        dark = np.log1p(np.exp(self.odds))
        return bit * s - np.log1p(np.exp(self.odds + s)) + dark, bit - lit, lit * (1.0 - lit)

    def draw_frame(self, x, shape, rng):
        s = self._spot(x, shape, np.zeros(2))[0]
        return (rng.random(s.shape) < expit(self.odds + s)).astype(float)


@frozen
class HeavyTailed(Camera):
    """Pixels err as Student's t of `freedom` degrees, so that a hot one moves nothing.

    Lange, Little, Taylor, Robust Statistical Modeling Using the t Distribution, JASA 84, 1989.
    """

    kind = "heavy_tailed"
    scale: float = vedette.fields.quantity("1", "of the noise, in counts", default=1, at_least=0.2, at_most=2)
    freedom: float = vedette.fields.quantity("1", "degrees of freedom", default=4, at_least=3, at_most=30)

    @property
    def height(self):
        return 40.0

    def pixel(self, seen, s):
        nu, rest = self.freedom, seen - s
        spread = nu * self.scale**2
        llr = -(nu + 1) / 2 * (np.log1p(rest**2 / spread) - np.log1p(seen**2 / spread))
        fisher = np.broadcast_to((nu + 1) / ((nu + 3) * self.scale**2), s.shape)
        return llr, (nu + 1) * rest / (spread + rest**2), fisher

    def draw_frame(self, x, shape, rng):
        s = self._spot(x, shape, np.zeros(2))[0]
        return s + self.scale * rng.standard_t(self.freedom, s.shape)


@frozen
class FromAbove(Camera):
    """Looks straight down: a pixel is a square of ground, x to the right, y up, the origin in the middle of the picture.

    Hartley, Zisserman, Multiple View Geometry in Computer Vision, 2004, chapter 6 (affine cameras).
    """

    kind = "from_above"
    linear = False
    observes = vedette.Space.of(x="m", y="m")
    ground: float = vedette.fields.quantity("m", "side of a pixel on the ground", default=2, at_least=0.2, at_most=20)
    sigma: float = vedette.fields.quantity("1", "noise of a pixel, in counts", default=1, at_least=0.2, at_most=3)

    @property
    def height(self):
        return 40.0

    def measure(self, x):
        return x * (np.array([1.0, -1.0]) / self.ground) + np.array([17.0, 12.0])

    def jacobian(self, x):
        return np.diag([1.0, -1.0]) / self.ground

    def pixel(self, seen, s):
        return s * (seen - s / 2) / self.sigma**2, (seen - s) / self.sigma**2, np.full(s.shape, self.sigma**-2.0)

    def draw_frame(self, x, shape, rng):
        s = self._spot(self.measure(x), shape, np.zeros(2))[0]
        return s + self.sigma * rng.standard_normal(s.shape)


COMPONENTS = (
    Foreign("photon counter", "sensor", PhotonCounter),
    Foreign("one-bit camera", "sensor", OneBit),
    Foreign("heavy-tailed camera", "sensor", HeavyTailed),
    Foreign("camera from above", "sensor", FromAbove),
)
